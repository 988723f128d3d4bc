"""Test vectors: their values, tolerances, files and readers.

`tests/urdf_standard.py` computes the values a second time, without code of urdfkin. The tolerances are
computed a second time from the formulas in docs/vectors.md.
"""

import hashlib
import json
import os
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator, Mapping, Sequence
from decimal import Decimal
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

import urdfkin
from tests import urdfs
from tests.cli.running import good, refused
from tests.cli.running import urdfkin as run
from tests.reading import module_of
from tests.urdf_standard import Robot, mp
from tests.urdfs import joint, limit, mimic
from urdfkin.system.resources import example_robots_dir, robots_dir
from urdfkin.urdf.catalogue import catalogue
from urdfkin.validation.vectors import (
    VECTORS,
    file_stem,
    load_features,
    write_features,
    write_robot,
    write_sums,
)
from urdfkin.verify.adapters import LIBRARIES

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore::urdfkin.UrdfWarning")]

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples" / "vectors"
EPS = 2.0**-52
FACTORS = {"placement": 1, "velocity": 2, "jacobian": 2}
#: Features of the fast test; they have each kind of joint, mimic rule and number.
SOME = (
    "skew axis of any length", "order of rpy", "quat_xyzw of length 2 (URDF 1.1)", "planar", "floating",
    "mimic chain of three", "mimic joint nearer the base", "two joints follow one", "mimic with multiplier 0",
    "large and small origins", "UTF-16", "no moving joint",
)  # fmt: skip


wrong: Callable[..., Iterator[str]] = module_of(EXAMPLES / "compare.py").wrong


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the test vectors of all features."""
    made = tmp_path_factory.mktemp("vectors")
    write_sums(made, list(write_features(made)))
    return made


def document(path: Path, **how: Any) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(path.read_text("utf-8"), **how)
    return found


def results(data: Mapping[str, Any]) -> list[dict[str, Any]]:
    return [one for sample in data["samples"] for one in sample["results"]]


def urdf_of(path: Path, written: Mapping[str, Any]) -> bytes:
    folders = path.parent, example_robots_dir(), robots_dir()
    return next(file.read_bytes() for one in folders if (file := one / str(written["file"])).is_file())


# -- values: a second implementation --------------------------------------------------------------------


def agree(path: Path) -> int:
    """Compare all values of a file with the second implementation, and return their number."""
    data, count = document(path, parse_float=str, parse_int=str), 0
    joints = [one | {name: list(map(int, one[name])) for name in "qv"} for one in data["joints"]]
    second = Robot(urdf_of(path, data))
    for sample in data["samples"]:
        inputs = {name: list(map(float, sample[name])) for name in "qva"}
        for link in {one["frame"] for one in sample["results"]}:
            expected = second.quantities(link, inputs, joints)
            for one in (one for one in sample["results"] if one["frame"] == link):
                unit, values = mp.mpf(one["k"]) * EPS, expected.pop((one["quantity"], one["reference"]))
                for x, text, tolerance in zip(values, one["value"], one["tolerance"], strict=True):
                    count += 1
                    if x == 0 and text == "0":
                        continue
                    size = mp.mpf(tolerance) / unit or 1
                    # half a unit of the 17th digit, and the error of the differences
                    most = mp.mpf("0.5001e-16") * abs(mp.mpf(text)) + size * mp.mpf("1e-24")
                    assert abs(x - mp.mpf(text)) <= most, (path.stem, one["quantity"], one["reference"], text)
            assert not expected
    return count


@pytest.mark.parametrize("name", SOME)
def test_an_implementation_written_from_the_standard_agrees(name: str, folder: Path) -> None:
    assert agree(folder / f"{file_stem(name)}.json") >= 3 * 19


@pytest.mark.long
def test_an_implementation_written_from_the_standard_agrees_with_all_features(folder: Path) -> None:
    assert sum(agree(path) for path in folder.glob("*.json")) > 50_000


@pytest.mark.long
@pytest.mark.parametrize("name", catalogue())
def test_an_implementation_written_from_the_standard_agrees_for_catalogue(name: str, tmp_path: Path) -> None:
    assert run("vectors write", str(tmp_path), name, "--samples", "2").code == 0
    assert agree(tmp_path / f"{name}.json") > 0


def own(robot: urdfkin.Robot) -> Callable[..., Any]:
    """Return a function that computes each quantity with urdfkin."""

    def answer(quantity: str, frame: str, reference: str, q: Any, v: Any, a: Any) -> Any:
        if quantity == "placement":
            return robot.placement(q, frame)
        if quantity != "spatial acceleration":
            taken = {"velocity": 2, "jacobian rate": 2, "acceleration": 3}.get(quantity, 1)
            return robot.compute(quantity, (q, v, a)[:taken], frame, reference)
        R, p = robot.placement(q, frame)[:3, :3], robot.placement(q, frame)[:3, 3]
        velocity, found = robot.velocity(q, v, frame), robot.acceleration(q, v, a, frame)
        linear, angular = found[:3] - np.cross(velocity[3:], velocity[:3]), found[3:]
        if reference == "world":
            linear = linear - np.cross(angular, p)
        back = R.T if reference == "local" else np.eye(3)
        return np.concatenate((back @ linear, back @ angular))

    return answer


def test_the_errors_of_urdfkin_are_at_most_a_twentieth_of_the_tolerances(folder: Path) -> None:
    for name, feature in load_features().items():
        path = folder / f"{file_stem(name)}.json"
        answer = own(urdfkin.load(feature.text, verify=False))
        data = document(path)
        for one in results(data):
            one["tolerance"] = [0.05 * x for x in one["tolerance"]]
        (narrow := folder.parent / "narrow.txt").write_text(json.dumps(data), "utf-8")
        assert not list(wrong(narrow, answer)), name


# -- tolerances: the formulas of the page ---------------------------------------------------------------


class Sizes:
    """Sizes of terms and number of roundings for a link in a sample, by the formulas in docs/vectors.md."""

    def __init__(self, robot: Robot, link: str, sample: Mapping[str, Any], joints: Sequence[Any]) -> None:
        self.robot, self.path = robot, robot.path(link)
        at = {one["name"]: one for one in joints}
        #: For each column: index in v, |multiplier|, whether the joint is revolute, index of the joint.
        self.columns = list[tuple[int, float, bool, int]]()
        self.p = self.w = self.u = self.d = self.c = e = 0.0
        rules = 0
        for order, name in enumerate(self.path):
            joint = robot.joints[name]
            if joint.angles is not None:
                e += sum(map(abs, joint.angles)) / 2
            mimicked_joint, m, _ = robot.rule(name)
            X, error, count = self._mimic(name, at, sample)
            rules += count
            turns = joint.kind in ("revolute", "continuous")
            e += error + (count - 1) / 2 * X if turns and count else 0.0
            own = at.get(mimicked_joint, {"q": (0, 0), "v": (0, 0)})
            q, v, a = (sample[key][slice(*own["q" if key == "q" else "v"])] for key in "qva")
            L = float(np.linalg.norm(joint.origin[:3, 3].astype(float)))
            if joint.kind == "prismatic":
                L += X
            elif joint.kind in ("planar", "floating"):
                L += float(np.linalg.norm(q[: 2 if joint.kind == "planar" else 3]))
            self.c += (self.d + self.w**2) * L
            self.u += self.w * L
            self.p += L
            if turns or joint.kind == "prismatic":
                s, s_2 = abs(float(m) * v[0]), abs(float(m) * a[0])
                self.columns.append((at[mimicked_joint]["v"][0], abs(float(m)), turns, order))
            if turns:
                self.w += s
                self.d += self.w * s + s_2
            elif joint.kind == "prismatic":
                self.c += 2 * self.w * s + s_2
                self.u += s
            elif joint.kind in ("planar", "floating"):
                k = 2 if joint.kind == "planar" else 3
                slide, turn, slide_2, turn_2 = map(float, map(np.linalg.norm, (v[:k], v[k:], a[:k], a[k:])))
                self.c += (2 * self.w + turn) * slide + slide_2
                self.w += turn
                self.u += slide
                self.d += self.w * turn + turn_2
                first = at[mimicked_joint]["v"][0]
                self.columns += [(first + i, 1.0, i >= k, order) for i in range(len(v))]
        self.nv = len(sample["v"])
        self.roundings = 24 * (len(self.path) + 1) + e + 1.5 * rules

    def _mimic(self, name: str, at: Mapping[str, Any], sample: Mapping[str, Any]) -> tuple[float, float, int]:
        joint = self.robot.joints[name]
        if not joint.mimicked_joint:
            q = sample["q"][slice(*at[name]["q"])] if name in at else []
            return abs(q[0]) if q else 0.0, 0.0, 0
        x, error, count = self._mimic(joint.mimicked_joint, at, sample)
        m, c = abs(float(joint.multiplier)), abs(float(joint.offset))
        return m * x + c, m * error + 1.5 * m * x + c, count + 1

    def k(self, quantity: str, reference: str | None) -> float:
        return (FACTORS.get(quantity, 3) + (reference in ("local", "world"))) * self.roundings

    def of(self, quantity: str, reference: str | None) -> np.ndarray:
        """Return the sizes of the terms of all numbers."""
        p, w, u, d, c, nv = self.p, self.w, self.u, self.d, self.c, self.nv
        world, local = reference == "world", reference == "local"
        if quantity == "placement":
            return np.array([[1, 1, 1, p]] * 3 + [[0] * 4]).ravel()
        if quantity == "velocity":
            return np.repeat([u + w * p if world else u, w], 3)
        if quantity.endswith("acceleration"):
            return np.repeat([c + w * u + (w * u + (d + w**2) * p if world else 0.0), d], 3)
        if quantity == "hessian":
            return self.hessian(local, world)
        T, S = np.zeros(nv), np.zeros(nv)
        for at, m, turns, _ in self.columns:
            (T if turns else S)[at] += m
        if quantity == "jacobian":
            return np.repeat([T * p + S, T], 3, axis=0).ravel()
        linear, angular = T * (w * p + u) + w * S, w * T
        if local:
            linear, angular = linear + w * (T * p + S), 2 * angular
        return np.repeat([linear, angular], 3, axis=0).ravel()

    def hessian(self, local: bool, world: bool) -> np.ndarray:
        sizes = np.zeros((2, self.nv, self.nv))
        near, far = ((0, 0), (3, 1)) if local else ((2, 1), (0, 0)) if world else ((5, 2), (2, 1))
        for of, m_i, turns_i, i in self.columns:
            for by, m_j, turns_j, j in self.columns:
                before = j <= i
                (f, g), size = near if before else far, m_i * m_j
                factor = f * self.p if turns_i and turns_j else g if turns_i != turns_j else 0
                sizes[0, of, by] += size * factor
                sizes[1, of, by] += size * (turns_i and turns_j and before != local)
        return np.repeat(sizes, 3, axis=0).ravel()


def demand_the_tolerances_of_the_page(path: Path) -> None:
    data = document(path)
    second = Robot(urdf_of(path, data))
    for sample in data["samples"]:
        for one in sample["results"]:
            sizes = Sizes(second, one["frame"], sample, data["joints"])
            k = sizes.k(one["quantity"], one["reference"])
            assert one["k"] == pytest.approx(k, rel=1e-12, abs=1e-6)
            expected = k * EPS * sizes.of(one["quantity"], one["reference"])
            given = np.array(one["tolerance"])
            where = path.stem, one["quantity"], one["reference"]
            assert np.all(given >= expected * (1 - 1e-9)), where
            assert np.all(given <= expected * 1.0101), where


@pytest.mark.parametrize("name", load_features())
def test_the_formulas_on_the_page_give_every_tolerance(name: str, folder: Path) -> None:
    demand_the_tolerances_of_the_page(folder / f"{file_stem(name)}.json")


def chained(rng: np.random.Generator, large: bool) -> str:
    """Return a URDF with a chain of two to four mimic rules.

    The offsets cancel. If `large`, the last offset is slightly above a power of two and has the largest
    rounding error.
    """
    constant, parts, count = Decimal(0), list[str](), int(rng.integers(3, 6))
    for k in range(count):
        rule = ""
        if k:
            m = Decimal(f"{10 ** rng.uniform(-1 if large else -2, 0 if large else 2):.3f}")
            m *= rng.choice([-1, 1])
            c = Decimal(f"{10 ** rng.uniform(0, 4):.3f}")
            if large:
                c = Decimal(f"{2**16 + rng.uniform(0, 60):.6f}" if k == count - 1 else "0.3")
            elif k > 1 and rng.random() < 0.7:
                c = round(-m * constant, int(rng.integers(2, 7)))
            constant = m * constant + c
            rule = mimic(f"j{k - 1}", m, c)
        most = "1e12" if k else "2"
        kind = "revolute" if large else rng.choice(["prismatic", "revolute"])
        origin = f'xyz="0.1 0.2 0" rpy="0 {rng.uniform(-3, 3):.3f} 0"'
        axis = " ".join(map(str, rng.permutation([1, 0, 0])))
        parts.append(joint(f"j{k}", kind, f"l{k}", f"l{k + 1}", origin, axis, rule + limit(f"-{most}", most)))
    return urdfs.robot(*parts)


def one_by_one(text: str) -> Callable[..., Any]:
    """Return a function that applies the mimic rules one after the other and then computes placements."""
    free = urdfkin.load(text, verify=False, mimic=False)
    rules = [
        tuple(float(rule.get(name, "")) for name in ("multiplier", "offset"))
        for rule in ET.fromstring(text).iterfind("joint/mimic")
    ]

    def answer(quantity: str, frame: str, reference: str, q: Any, v: Any, a: Any) -> Any:
        values = list(q)
        for m, c in rules:
            values.append(m * values[-1] + c)
        return free.placement(values, frame) if quantity == "placement" else None

    return answer


@pytest.mark.parametrize("large", [False, True])
def test_the_tolerances_of_chains_of_rules_hold_if_offsets_cancel_or_are_large(
    large: bool, tmp_path: Path
) -> None:
    rng, worst = np.random.default_rng(0), 0.0
    for number in range(40):
        text = chained(rng, large)
        robot = urdfkin.load(text, verify=False)
        (made := tmp_path / str(number)).mkdir()
        write_robot(made, robot, 5)
        path = made / "r.json"
        demand_the_tolerances_of_the_page(path)
        if number % 20 == 0:
            assert agree(path) > 0
        for answer in (own(robot), one_by_one(text)):
            assert not list(wrong(path, answer)), text
        for sample in document(path)["samples"]:
            for one in sample["results"][:1]:
                error = np.abs(robot.placement(sample["q"], one["frame"]).ravel() - one["value"])
                worst = max(worst, float((error[:12] / one["tolerance"][:12]).max()))
    assert worst > 0.3, "the tolerances are not much larger than the errors"


# -- the readers ----------------------------------------------------------------------------------------


def changed(data: Mapping[str, Any], which: int) -> Iterator[list[float]]:
    """Yield the numbers of each result, one of them changed by 1e-9 of its size."""
    for one in results(data):
        values = list(one["value"])
        if values:
            i = which % len(values)
            values[i] += 1e-9 * (one["tolerance"][i] / (one["k"] * EPS) or 1.0)
        yield values


def in_turn(rows: Sequence[Sequence[float]]) -> Callable[..., Any]:
    """Return a function that returns one row for each call."""
    found = iter(rows)
    return lambda *_: next(found)


@pytest.mark.parametrize("which", [0, 3, 7, 16, 41])
def test_the_reader_in_python_finds_every_number_changed_by_a_billionth(which: int, folder: Path) -> None:
    kinds = set()
    for path in folder.glob("*.json"):
        data = document(path)
        right = [one["value"] for one in results(data)]
        kinds |= {(one["quantity"], one["reference"]) for one in results(data) if one["value"]}
        assert not list(wrong(path, in_turn(right)))
        found = list(wrong(path, in_turn(list(changed(data, which)))))
        assert len(found) == sum(map(bool, right)), path
    assert len(kinds) == 19


def test_the_reader_reports_nan_and_a_wrong_shape_and_the_page_contains_the_reader(folder: Path) -> None:
    path = folder / "mimic.json"
    assert len(list(wrong(path, lambda *_: np.full(16, np.nan)))) == 3 * 16 + 3 * 18
    assert "1 numbers, expected 16" in next(wrong(path, lambda *_: 1.0))
    assert not list(wrong(path, lambda *_: None))
    assert (EXAMPLES / "compare.py").read_text("utf-8") in (ROOT / "docs" / "vectors.md").read_text("utf-8")


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The compiled reader in C++."""
    if shutil.which("g++") is None:
        pytest.skip("no C++ compiler")
    made = tmp_path_factory.mktemp("reader") / "compare"
    command = "g++", "-std=c++17", "-Wall", "-Wextra", "-Werror", EXAMPLES / "compare.cpp", "-o", made
    subprocess.run(command, check=True)
    return made


def compared(program: Path, *files: Path) -> tuple[int, str]:
    done = subprocess.run([program, *files], capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


@pytest.mark.parametrize(
    "name", ["mimic of a mimic", "floating", "origin of a nanometre", "names beyond ASCII"]
)
def test_the_reader_in_cpp_finds_every_number_changed_by_a_billionth(
    name: str, program: Path, folder: Path, tmp_path: Path
) -> None:
    vectors, answers = folder / f"{file_stem(name)}.tsv", tmp_path / "answers.tsv"
    lines = [line.split("\t") for line in vectors.read_text("utf-8").splitlines() if line[0] != "#"]
    data = document(folder / f"{file_stem(name)}.json")

    def write(rows: Sequence[Sequence[float]]) -> None:
        given = zip((fields for fields in lines if fields[1] != "-"), rows, strict=True)
        words = ["\t".join((*fields[:4], " ".join(map(repr, row)))) for fields, row in given]
        answers.write_text("".join(f"{line}\n" for line in words), "utf-8")

    right = [one["value"] for one in results(data)]
    write(right)
    assert compared(program, vectors, answers) == (
        0, f"{sum(map(len, right))} numbers compared, 0 wrong, 0 lines without an answer\n",
    )  # fmt: skip
    for which in (0, 4):
        write(list(changed(data, which)))
        code, words = compared(program, vectors, answers)
        assert code == 1
        assert f", {len(right)} wrong" in words
    write([[float("nan")] * len(row) for row in right])
    assert f", {sum(map(len, right))} wrong" in compared(program, vectors, answers)[1]
    answers.write_text("0\ttip\t-\tplacement\t1 2 3\n")
    assert "3 numbers, expected 16" in compared(program, vectors, answers)[1]
    answers.write_text("")
    assert compared(program, vectors, answers)[0] == 2
    assert compared(program, vectors, tmp_path / "missing")[0] == 2


# -- the files ------------------------------------------------------------------------------------------


def test_both_file_formats_have_the_same_numbers_and_conform_to_the_schema(folder: Path) -> None:
    schema = VECTORS.schema()
    for path in folder.glob("*.json"):
        data = document(path)
        jsonschema.validate(data, schema)
        VECTORS.read(path)
        feature = load_features()[data["robot"]]
        assert data["sha256"] == hashlib.sha256((folder / data["file"]).read_bytes()).hexdigest()
        assert (data["rule"], data["note"], data["license"]) == (feature.rule, feature.note, "CC0-1.0")
        rows = [line.split("\t") for line in path.with_suffix(".tsv").read_text("utf-8").splitlines()[3:]]
        lines = [row for row in rows if row[1] != "-"]
        for row, one in zip(lines, results(data), strict=True):
            assert [float(x) for x in row[4].split()] == one["value"]
            assert [float(x) for x in row[5].split()] == one["tolerance"]
            assert row[1:4] == [one["frame"], one["reference"] or "-", one["quantity"]]
            assert np.prod(one["shape"]) == len(one["value"]) == len(one["tolerance"])
        inputs = [sample[name] for sample in data["samples"] for name in "qva"]
        assert [[float(x) for x in row[4].split()] for row in rows if row[1] == "-"] == inputs


def test_files_are_equal_in_a_process_with_a_different_hash_seed(folder: Path, tmp_path: Path) -> None:
    command = "from urdfkin.cli import main; main()"
    subprocess.run(
        [sys.executable, "-c", command, "vectors", "write", str(tmp_path), "--no-catalogue"],
        env={**os.environ, "PYTHONHASHSEED": "4711", "LC_ALL": "C"}, stdout=subprocess.DEVNULL, check=True,
    )  # fmt: skip
    assert (tmp_path / "SHA256SUMS").read_bytes() == (folder / "SHA256SUMS").read_bytes()
    assert len(list(tmp_path.iterdir())) == 3 * len(load_features()) + 1
    subprocess.run(["sha256sum", "--quiet", "--check", "SHA256SUMS"], cwd=tmp_path, check=True)


@pytest.mark.long
def test_files_of_all_features_and_robots_are_equal_if_written_twice(tmp_path: Path) -> None:
    first, second = tmp_path / "a", tmp_path / "b"
    for made in (first, second):
        assert run("vectors write", str(made)).code == 0
    assert (first / "SHA256SUMS").read_bytes() == (second / "SHA256SUMS").read_bytes()
    found = [document(path) for path in first.glob("*.json")]
    assert len(found) == len(load_features()) + len(catalogue())
    assert all(one["k"] * EPS < 1e-10 for data in found for one in data["samples"][1]["results"])


def test_features_have_unique_names_and_notes_on_libraries_that_differ() -> None:
    assert len(load_features()) >= 60
    names = [file_stem(name).casefold() for name in (*load_features(), *catalogue())]
    assert len(set(names)) == len(names)
    assert len({feature.data for feature in load_features().values()}) == len(load_features())
    table = document(ROOT / "docs" / "libraries.json")["cells"]
    for library, column in table.items():
        for name, cell in column.items():
            named = LIBRARIES[library].title in (load_features()[name].note or "")
            assert named == (cell["verdict"] != "right"), (library, name)
    for feature in load_features().values():
        try:
            urdfkin.load(feature.data, verify=False)
        except urdfkin.UrdfError:
            assert "urdfkin refuses the file" in (feature.note or ""), feature.name
        else:
            assert "urdfkin" not in (feature.note or "")


# -- the command ----------------------------------------------------------------------------------------


def test_vectors_of_a_catalogue_robot_have_no_urdf_file_and_vectors_of_other_robots_have_one(
    tmp_path: Path,
) -> None:
    text = urdfkin.load("planar_two_link").urdf
    (tmp_path / "mine.urdf").write_text(text.replace('"planar_two_link"', '"my arm"'))
    done = good(
        *("vectors", "write", str(tmp_path / "out"), "ur5", str(tmp_path / "mine.urdf")),
        *("--samples", "2", "--format", "json"),
    )
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        "ur5.json", "ur5.tsv", "my_arm.json", "my_arm.tsv", "my_arm.urdf", "SHA256SUMS",
    }  # fmt: skip
    assert [one["robot"] for one in done.data["robots"]] == ["ur5", "my arm"]
    ur5, mine = (document(tmp_path / "out" / name) for name in ("ur5.json", "my_arm.json"))
    assert (ur5["license"], mine["license"]) == ("CC0-1.0", None)
    assert len(ur5["samples"]) == 2
    assert hashlib.sha256((example_robots_dir() / ur5["file"]).read_bytes()).hexdigest() == ur5["sha256"]
    assert agree(tmp_path / "out" / "my_arm.json") > 0


def test_invalid_arguments_of_vectors_write_are_clear_errors(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    assert "cannot be written" in refused("vectors write", str(tmp_path / "file"), "ur5")
    assert "name the folder" in run("vectors write").err
    assert "two robots have the same name" in refused("vectors write", str(tmp_path), "ur5", "ur5")
    assert json.loads(run("vectors write --schema").text)["title"] == VECTORS.name
