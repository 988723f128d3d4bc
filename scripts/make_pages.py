"""Write the generated parts of pages: equations, performance, findings, reports, accuracy, enclosures.

    python scripts/make_pages.py                  # all pages
    python scripts/make_pages.py findings accuracy   # some pages

Run this script after a change of an equation, a finding, a robot or a schema. Tests compare the pages
with the output of this script. The pages on accuracy and enclosures take minutes to compute, so tests check
only some numbers on these two pages. In docs/performance.md, the picture and the parts `figures: ...` show
the numbers of docs/performance.json. `python scripts/benchmark.py --json docs/performance.json` measures
these numbers.
"""

import argparse
import json
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

import urdfkin
from scripts.benchmarking import tables
from scripts.benchmarking.picture import draw
from scripts.pages import DOCS, insert_parts, table
from urdfkin.compiled.preload import use_only
from urdfkin.kinematics.registry import equations_page
from urdfkin.model.configuration import draw_base_motion
from urdfkin.report.words import more_accurate_counts
from urdfkin.robot import Robot
from urdfkin.system.documents import as_json_data
from urdfkin.urdf.catalogue import catalogue
from urdfkin.urdf.findings import MAX_COMPLETE_FINDINGS, shorten
from urdfkin.urdf.lint import DEFAULT_SIZE_LIMITS, Finding, Severity, check
from urdfkin.urdf.lint.pages import URDF_RULES
from urdfkin.urdf.lint.pages import page as page_of
from urdfkin.validation.accuracy import AccuracyLine, AccuracyStudy, accuracy_study
from urdfkin.validation.document import VALIDATION
from urdfkin.verify.exact.enclosure import Enclosures
from urdfkin.verify.pinocchio import version


def _escape(text: str) -> str:
    return text.replace("|", "\\|").replace("<", "&lt;").replace("*", "\\*")


FAMILIES = {
    "1": "Text and XML",
    "2": "Dialect, elements and attributes",
    "3": "Numbers",
    "4": "Names and structure",
    "5": "Joints",
    "6": "Suspicious",
    "7": "Inertials, geometry and materials",
}

#: Maps the code of a warning about a catalogue robot to an explanation.
REMARKS = {
    "URDF207": "URDF has no origin in a link; every reader ignores this pose.",
    "URDF405": "A slash in a name is legal; urdfkin does not use names as paths.",
    "URDF508": "Both limits are zero; missing limits count as zero. Samples do not move the joint.",
    "URDF510": "The value has no effect, as expected.",
    "URDF527": "The multiplier -1 gives negative values below the limit 0; kinematics uses these values.",
    "URDF702": "No body can have this mass and these moments of inertia; kinematics uses neither.",
    "URDF706": "The address of the mesh is wrong, or is a path on another machine; kinematics needs no mesh.",
    "URDF708": "Only a colour is missing.",
}

#: Maps an option of `urdfkin check` to its default limit and the unit. The last limit has no option.
LIMITS = {
    "--max-bytes": (DEFAULT_SIZE_LIMITS.bytes, "bytes"),
    "--max-depth": (DEFAULT_SIZE_LIMITS.depth, "levels of nesting"),
    "--max-elements": (DEFAULT_SIZE_LIMITS.elements, "elements"),
    "--max-attributes": (DEFAULT_SIZE_LIMITS.attributes, "attributes of one element"),
    "--max-name": (DEFAULT_SIZE_LIMITS.name, "characters of a name"),
    "--max-number": (DEFAULT_SIZE_LIMITS.number, "characters of a number"),
    "--max-markup": (DEFAULT_SIZE_LIMITS.markup, "bytes of one tag or comment"),
    "": (MAX_COMPLETE_FINDINGS, "complete findings for each code and severity, in all output formats"),
}


def make_findings_parts() -> dict[str, str]:
    limits = [
        (f"{limit:,} {meaning}", f"`{option}`" * bool(option)) for option, (limit, meaning) in LIMITS.items()
    ]
    codes = []
    for digit, family in FAMILIES.items():
        rows = [
            (
                rule.id,
                rule.slug,
                rule.severity.value,
                _escape(shorten(page_of(rule.id).title, 200)),
                f"*{rule.pinocchio_reading.value}*" if rule.pinocchio_reading else "",
            )
            for rule in URDF_RULES.values()
            if rule.id[4] == digit
        ]
        heads = ("code", "name", "severity", "finding", "Pinocchio")
        codes.append(f"### {family}\n\n{table(heads, rows)}\n")
    robot_rows = []
    for name, finding in ((robot, finding) for robot in catalogue() for finding in list_warnings(robot)):
        lines = f"line {finding.line}" + (
            f" and {len(finding.other_lines)} more" if finding.other_lines else ""
        )
        description = f"{finding.subject}: {finding.message}" if finding.subject else finding.message
        robot_rows.append(
            (name, finding.code, lines, _escape(shorten(description, 200)), REMARKS[finding.code])
        )
    return {
        "limits": table(("limit", "option"), limits).replace("|  |", "| |"),
        "codes": "\n".join(codes),
        "robots": table(("robot", "code", "where", "what", "meaning"), robot_rows),
    }


def list_warnings(robot: str) -> list[Finding]:
    return [finding for finding in check(robot, fold=True) if finding.severity is not Severity.NOTE]


def make_reports_parts() -> dict[str, str]:
    whole = VALIDATION.schema()
    parts = {"The document": whole, **{f"`{name}`": part for name, part in whole["$defs"].items()}}
    layout = []
    for title, part in parts.items():
        rows = []
        for name, entry in part["properties"].items():
            # If an entry has no description, the page shows the description of the entry's data type.
            kind = whole["$defs"].get(entry.get("$ref", "").rpartition("/")[2], {})
            rows.append(
                (f"`{name}`", _format_type(entry), _escape(entry.get("description") or kind["description"]))
            )
        heads = ("entry", "type", "meaning")
        layout.append(f"### {title}\n\n{part['description']}\n\n{table(heads, rows)}\n")
    return {"layout": "\n".join(layout)}


def _format_type(entry: dict[str, Any]) -> str:
    if "$ref" in entry:
        return f"`{entry['$ref'].rpartition('/')[2]}`"
    if "anyOf" in entry:
        return " or ".join(_format_type(choice) for choice in entry["anyOf"])
    if "const" in entry:
        return f"`{entry['const']}`"
    if "enum" in entry:
        return ", ".join("null" if word is None else f"`{word}`" for word in entry["enum"])
    if entry["type"] == "array":
        count = entry.get("minItems")
        return f"{f'{count} ×' if count else 'list of'} {_format_type(entry['items'])}"
    return str(entry["type"])


STUDIED_ROBOTS = {
    "panda": "arm with seven joints, gripper with a mimic joint",
    "ur5": "arm with six-digit angles",
    "xarm7": "arm from CAD",
    "kinova": "arm with three fingers",
    "allegro_left_hand": "hand, short fingers",
    "tiago_pro": "mobile manipulator with mimic joints",
    "talos": "humanoid",
    "icub": "humanoid, long chains, skew axes",
    "anymal": "quadruped",
    "so100": "hobby arm, skew axes",
    "polar": "polar robot of the textbook",
}
MOVING_BASE_ROBOTS = ("talos", "anymal", "ur5")
#: Number of samples per robot in the accuracy study.
SAMPLES = 10
#: Number of samples per robot in the table of enclosures.
ENCLOSURE_SAMPLES = 5


def make_accuracy_parts() -> dict[str, str]:
    studies = {
        f"{name}: {kind}": accuracy_study(urdfkin.load(name), samples=SAMPLES)
        for name, kind in STUDIED_ROBOTS.items()
    }
    for name in MOVING_BASE_ROBOTS:
        base = draw_base_motion(SAMPLES, np.random.default_rng([0, 1]))
        studies[f"{name} on a moving base"] = accuracy_study(urdfkin.load(name), samples=SAMPLES, base=base)
    return format_studies(studies)


def format_studies(studies: dict[str, AccuracyStudy]) -> dict[str, str]:
    lines = [line for study in studies.values() for line in as_json_data(study)["lines"]]
    ratios = [line["urdfkin"]["typical"] / line["pinocchio"]["typical"] for line in lines]
    inputs = f"{SAMPLES} samples of each robot (seed 0), all links, and Pinocchio {version()}"
    counts = f"""The study used {inputs}.
Each line of the tables below compares the typical errors of urdfkin and Pinocchio:
{more_accurate_counts(lines)}. Equal errors are
the same double. The median ratio of urdfkin's typical error to Pinocchio's is
{median(ratios):.2f}. The ratios lie between {min(ratios):.2f} and {max(ratios):.2f}."""
    sections = [f"## {name}\n\n{_make_error_table(study.lines)}" for name, study in studies.items()]
    return {"counts": counts, "tables": "\n\n".join(sections)}


def _make_error_table(lines: tuple[AccuracyLine, ...]) -> str:
    sides = [f"{side} {error}" for error in ("worst", "typical") for side in ("urdfkin", "Pinocchio")]
    rows = [
        (
            line.quantity,
            line.reference or "-",
            f"{line.numbers:,}",
            *(f"{errors.worst:.2f}" for errors in (line.urdfkin, line.pinocchio)),
            *(f"{errors.typical:.3f}" for errors in (line.urdfkin, line.pinocchio)),
        )
        for line in lines
    ]
    return table(("quantity", "reference", "numbers", *sides), rows, left=2)


#: Robots whose enclosures are measured.
ENCLOSED_ROBOTS = ("panda", "ur5", "xarm7", "allegro_left_hand", "talos", "icub", "anymal", "so100")
CHAIN_LENGTHS = (3, 10, 30, 100)


def make_enclosures_parts() -> dict[str, str]:
    heads = ("robot", "joints", "digits", "widest, steps", "urdfkin inside", "Pinocchio inside", "ms")
    long = ("joints", "digits", "acceleration", "widest interval", "ms")
    with use_only("compiled"):
        robots = table(heads, _robot_rows(), left=1)
        return {
            "robots": f"{ENCLOSURE_SAMPLES} samples, Pinocchio {version()}:\n\n{robots}",
            "chains": table(long, _chain_rows(), left=0),
        }


def _robot_rows() -> Iterator[tuple[object, ...]]:
    for name in ENCLOSED_ROBOTS:
        robot = urdfkin.load(name)
        depth = len(robot.tree.path(robot.tree.frame_link(robot.tip_frame)))
        for digits in (15, None):
            proofs, ms = _compute_enclosures(robot, ENCLOSURE_SAMPLES, digits)
            parts = [
                part
                for p in proofs
                for part in (p.placement, p.velocity, p.acceleration, p.jacobian, p.jacobian_rate)
            ]
            # `steps` is the largest width of an interval, as a multiple of the distance between doubles at
            # the largest absolute value of the quantity.
            ends = [np.maximum(np.abs(part.lower), np.abs(part.upper)).max(initial=1e-300) for part in parts]
            steps = max(
                float((part.width / np.spacing(end)).max()) for part, end in zip(parts, ends, strict=True)
            )
            # Exact results have intervals of width 0 and are not counted.
            inside = [
                np.concatenate([p.contains(getattr(p, side))[p.width > 0.0] for p in parts]).mean()
                for side in ("urdfkin", "pinocchio")
            ]
            yield name, depth, proofs[0].digits, f"{steps:.3g}", *(f"{x:.0%}" for x in inside), f"{ms:.1f}"


def _chain_rows() -> Iterator[tuple[object, ...]]:
    for length in CHAIN_LENGTHS:
        robot = urdfkin.load(make_askew_chain(length), verify=False)
        for digits in (15, 50, None):
            (proof,), ms = _compute_enclosures(robot, 1, digits)
            size = float(np.abs(proof.acceleration.urdfkin).max())
            widest = float(proof.acceleration.width.max())
            yield length, proof.digits, f"{size:.1e}", f"{widest:.1e}", f"{ms:.1f}"


def _compute_enclosures(robot: Robot, count: int, digits: int | None) -> tuple[list[Enclosures], float]:
    """Return enclosures, and the time (ms) per motion."""
    enclosures, times = [], []
    for seed in (0, *range(count)):  # The first motion is not timed.
        v, a = np.random.default_rng(seed).standard_normal((2, robot.nv))
        q, begin = robot.sample(1, seed)[0], time.process_time()
        enclosures.append(robot.enclose(q, v, a, robot.tip_frame, digits=digits))
        times.append(time.process_time() - begin)
    return enclosures[1:], 1e3 * sum(times[1:]) / count


def make_askew_chain(length: int) -> str:
    joints = "".join(
        f'<link name="l{i + 1}"/><joint name="j{i}" type="continuous"><parent link="l{i}"/>'
        f'<child link="l{i + 1}"/><origin xyz="0.1 0.2 0.3" rpy="1.5708 0.3 -0.2"/>'
        '<axis xyz="0.36 0.48 0.8"/></joint>'
        for i in range(length)
    )
    return f'<robot name="askew"><link name="l0"/>{joints}</robot>'


PARTS: dict[str, Callable[[], dict[str, str]]] = {
    "findings": make_findings_parts,
    "reports": make_reports_parts,
    "accuracy": make_accuracy_parts,
    "enclosures": make_enclosures_parts,
}
PAGES = ("equations", "performance", *PARTS)
FIGURES, PICTURE = DOCS / "performance.json", DOCS / "images" / "performance.svg"


def page_path(name: str) -> Path:
    return DOCS / f"{name}.md"


def make_page(name: str) -> str:
    if name == "equations":
        return equations_page()
    text = page_path(name).read_text("utf-8")
    if name == "performance":
        return tables.make_page(text, json.loads(FIGURES.read_text("utf-8")))
    return insert_parts(text, **PARTS[name]())


def main(words: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("pages", nargs="*", choices=[*PAGES, []], metavar="PAGE", help="default: all pages")
    for name in parser.parse_args(words).pages or PAGES:
        page_path(name).write_text(make_page(name), "utf-8")
        print(page_path(name))
        if name == "performance":
            PICTURE.write_bytes(draw(json.loads(FIGURES.read_text("utf-8")), PICTURE))


if __name__ == "__main__":
    main()
