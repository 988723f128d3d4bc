"""Reports as HTML pages, and the 3D view in a notebook.

The pages and the view use no network and escape every name. A large report is split: the page has the
summary, and each robot has a file with its details. The page loads a robot's file when the reader opens the
robot's section. The files are scripts, because a page that is opened from disk cannot load other types of
files.
"""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Iterator
from functools import cache
from html import escape
from importlib import resources
from typing import TYPE_CHECKING, Any

from urdfkin.errors.display import format_count
from urdfkin.errors.escape import log_line
from urdfkin.report import pages
from urdfkin.report.figures import distributions, scene
from urdfkin.report.reading import moving_names
from urdfkin.report.words import (
    VERDICTS,
    accuracy_words,
    bound_ratio_of,
    check_name,
    checks_in_order,
    disagreement_cell,
    format_ratio,
    format_units,
    pinocchio_version,
    quantities_by_heading,
    second_oracle_cells,
    second_oracle_heads,
    second_oracle_title,
    second_reader_words,
    summary,
    utc,
    verdict_counts,
    worst,
)
from urdfkin.system.lazy_import import install_command
from urdfkin.validation.document import Document, ReportedRobot, outcome_of
from urdfkin.validation.robot_summary import chain_disagreement, describe
from urdfkin.verify.quantities import format_unvalidated_titles, format_validated_titles
from urdfkin.view.figure import has_matplotlib

if TYPE_CHECKING:
    from jinja2 import Environment
    from markupsafe import Markup

    from urdfkin.model.tree import FloatArray
    from urdfkin.robot import Robot

#: Up to this number of robots, the details of all robots are open at first.
_MAX_OPEN_ROBOTS = 1
#: Maximum number of unverified robots whose details the page shows at first.
_MAX_OPEN_FAILURES = 20
#: If a report has more robots than this number, verified robots have no histograms. The histograms of one
#: robot take a second of computing time.
_MAX_DRAWN = 100
#: If the details of all robots have more characters than this number, each robot has a separate file.
MAX_PAGE_CHARACTERS = 5_000_000


@cache
def environment() -> Environment:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("urdfkin.report"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    environment.policies["json.dumps_kwargs"] = {"separators": (",", ":"), "allow_nan": False}
    environment.filters["format_count"] = format_count
    environment.globals["install_command"] = install_command
    return environment


def render_template(template: str, **values: Any) -> str:
    return environment().get_template(template).render(style=as_is(asset("report.css")), **values)


def asset(name: str) -> str:
    return resources.files("urdfkin.report").joinpath("assets", name).read_text(encoding="utf-8")


def as_is(text: str) -> Markup:
    from markupsafe import Markup

    return Markup(text)


def as_html(document: Document) -> str:
    """Return the report as one page; the template escapes all names."""
    document = _worst_first(document)
    robots = enumerate(document["robots"])
    return _page(document, [_summary(robot, i) | _robot(robot, i, document) for i, robot in robots])


def as_files(document: Document, name: str) -> Iterator[tuple[str, str]]:
    """Yield the path and the text of each file.

    Paths are relative to the page, which is the last file. If all details together are longer than
    `MAX_PAGE_CHARACTERS`, each robot has its own file in a folder.
    """
    document = _worst_first(document)
    robots, folder = document["robots"], f"{name.removesuffix('.html')}-robots"
    token = hashlib.sha256(f"{document['started']} {document['command']}".encode()).hexdigest()[:16]
    waiting, size = list[tuple[str, str]](), 0
    for i, robot in enumerate(robots):
        details = _details(_robot(robot, i, document), document)
        size += len(details)
        waiting.append((f"{folder}/{i}.js", f"urdfkinRobot({json.dumps([token, i, details])});\n"))
        if size > MAX_PAGE_CHARACTERS:
            yield from waiting
            waiting.clear()
    if size <= MAX_PAGE_CHARACTERS:
        yield name, as_html(document)
        return
    beside = ({"file": f"{folder}/{i}.js", "opened": False} for i in range(len(robots)))
    shells = [_summary(robot, i) | file for i, (robot, file) in enumerate(zip(robots, beside, strict=True))]
    yield name, _page(document, shells, token=token, folder=folder)


def _worst_first(document: Document) -> Document:
    return document | {"robots": sorted(document["robots"], key=lambda one: VERDICTS.index(one["verdict"]))}


def _details(robot: dict[str, Any], document: Document) -> str:
    template = environment().get_template("details.html.j2")
    return template.render(robot=robot, document=document, heat_steps=pages.HEAT_EDGES)


def _page(document: Document, robots: list[dict[str, Any]], token: str = "", folder: str = "") -> str:
    quantities = quantities_by_heading(document["robots"])
    return render_template(
        "report.html.j2",
        document=document,
        outcome=outcome_of(document),
        summary=summary(document),
        when=format_date(document["started"]),
        pinocchio=pinocchio_version(document),
        compared=format_validated_titles(),
        not_compared=format_unvalidated_titles(),
        totals=_totals(document),
        model=_linter_verdict(document),
        verdicts=verdict_counts(document),
        quantities=list(quantities),
        overview=[pages.overview_row(robot, list(quantities.values())) for robot in document["robots"]],
        robots=robots,
        opened=len(robots) <= _MAX_OPEN_ROBOTS,
        heat_steps=pages.HEAT_EDGES,
        token=token,
        folder=folder,
        script=as_is(asset("report.js")),
        view_script=as_is(asset("view3d.js")),
        three=as_is(asset("three.min.js")),
        three_licence=asset("three.LICENSE.txt"),
    )


def _summary(robot: ReportedRobot, index: int) -> dict[str, Any]:
    opened = robot["verdict"] != "verified" and index < _MAX_OPEN_FAILURES
    return {
        "index": index,
        "data": robot,
        "summary": pages.overview_row(robot, []),
        "file": "",
        "opened": opened,
    }


def _totals(document: Document) -> dict[str, Any]:
    robots = document["robots"]
    checks = [check for robot in robots for check in robot["checks"]]
    return {
        "robots": len(robots),
        "joints": sum(len(robot["joints"]) for robot in robots),
        "frames": sum(len(robot["frames"]) for robot in robots),
        "results": sum(robot["results"] for robot in robots),
        "failed": sum(robot["failed"] for robot in robots),
        "worst": disagreement_cell(checks),
        "share": format_ratio(worst(map(bound_ratio_of, robots))) if checks else "",
    }


def _linter_verdict(document: Document) -> dict[str, Any]:
    severities = ("error", "warning", "note")
    found = [
        Counter[str](finding["severity"] for finding in robot["findings"]) for robot in document["robots"]
    ]
    unread = [robot["verdict"] == "bad input" for robot in document["robots"]]
    worst_of_file = [
        "error" if bad else next((word for word in severities if counts[word]), "")
        for counts, bad in zip(found, unread, strict=True)
    ]
    worst_word = next((word for word in severities if word in worst_of_file), "")
    affected, files = worst_of_file.count(worst_word), format_count(len(found), "file")
    total = sum(found, Counter[str]())
    words = ", ".join(format_count(total[word], word) for word in severities if total[word])
    if not found:
        colour, title = "warn", "No model was read"
    elif any(unread):
        colour, title = "bad", f"{sum(unread)} of {files} unusable"
    elif worst_word == "error":
        colour, title = "bad", f"Errors in {affected} of {files}"
    elif worst_word == "warning":
        colour, title = "warn", f"Warnings in {affected} of {files}"
    else:
        colour, title = "good", "No errors and no warnings"
    return {
        "verdict": colour,
        "title": title,
        "counts": f"{words}." if words else "The linter has no findings." if found else "",
        "first": worst_of_file.index(worst_word) if worst_word else None,
    }


def _robot(robot: ReportedRobot, index: int, document: Document) -> dict[str, Any]:
    model = robot["model"]
    heads, heat = pages.heat_map(robot, model) if model and robot["checks"] else ([], [])
    return {
        "index": index,
        "moving": len(moving_names(model)) if model else 0,
        "data": robot,
        "reason": pages.reason(robot),
        "scene": scene(model, robot["chains"]) if model else None,
        "joints": pages.joint_rows(model) if model else [],
        "chains": [
            {
                "data": chain,
                "beta": pages.has_beta(chain),
                "tables": {kind: pages.chain_rows(chain, kind) for kind in ("standard", "modified")},
                "agrees": chain_disagreement(chain) is None,
                "metres": f"{chain['metres'] or 0.0:.2g}",
                "worst": format_units(chain["worst"]),
                "share": format_ratio(chain["bound_ratio"]),
            }
            for chain in robot["chains"]
        ],
        "checks": pages.check_rows(robot),
        "failures": pages.failures(robot),
        "has_problems": any(finding["severity"] != "note" for finding in robot["findings"]),
        "second_reader": second_reader_words(robot),
        "second_oracle": (title := second_oracle_title([robot])),
        "second_oracle_heads": second_oracle_heads(title) if title else [],
        "second_oracle_rows": [
            [check_name(check), *second_oracle_cells([check], title)]
            for check in checks_in_order(robot)
            if title and "second_oracle" in check
        ],
        "accuracy": pages.accuracy_rows(robot["accuracy"]) if robot["accuracy"] else [],
        "accuracy_words": accuracy_words(robot["accuracy"]) if robot["accuracy"] else "",
        "many": has_matplotlib(),
        "heat_heads": heads,
        "heat": heat,
        "plot": as_is(_plot(robot, index, document)),
    }


def _plot(robot: ReportedRobot, index: int, document: Document) -> str:
    if not has_matplotlib() or (len(document["robots"]) > _MAX_DRAWN and robot["verdict"] == "verified"):
        return ""
    return distributions(robot, document["histogram_edges"], f"p{index}-")


def format_date(started: str) -> str:
    """Convert an ISO date and time to UTC, and format it. Return any other text unchanged."""
    moment = utc(started)
    return f"{moment.day} {moment:%B %Y, %H:%M} UTC" if moment else started


class NotebookView:
    """The 3D view of `Robot.view` in a notebook.

    `q` (nq,) is the first configuration, and `height` is the height of the view in pixels.
    """

    def __init__(self, robot: Robot, q: FloatArray, height: int) -> None:
        self._name, self._height = robot.name, height
        self._description, self._q = describe(robot), q.tolist()

    def __repr__(self) -> str:
        return log_line(f"<a view of {self._name}, which is displayed as the last line of a notebook cell>")

    def page(self) -> str:
        data: dict[str, Any] = {"source": self._name, "joints": moving_names(self._description), "chains": []}
        return render_template(
            "cell.html.j2",
            data=data,
            robot={"index": 0, "scene": scene(self._description, []) | {"start": self._q}},
            three=as_is(asset("three.min.js")),
            view_script=as_is(asset("view3d.js")),
        )

    def _repr_html_(self) -> str:
        # The HTML frame may run scripts, but it cannot access the notebook.
        return (
            f'<iframe sandbox="allow-scripts" title="{escape(self._name)}" srcdoc="{escape(self.page())}"'
            f' style="width:100%;height:{self._height}px;border:0"></iframe>'
        )
