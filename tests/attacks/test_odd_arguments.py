"""For any value of a public argument, urdfkin returns a result or raises an error of its own."""

import inspect
import math
import os
import warnings
from collections.abc import Callable
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import urdfkin
from tests.urdfs import joint, limit
from tests.urdfs import robot as robot_of
from urdfkin import dh
from urdfkin.compiled import evaluate
from urdfkin.compiled.plan import LANES
from urdfkin.dh import DHRow, DHTable
from urdfkin.dh.screws import screws_from_rows
from urdfkin.dh.units import COLUMNS
from urdfkin.kinematics import bodies, rotation
from urdfkin.model.tree import JointKind, Limit, Mimic
from urdfkin.robot import Robot
from urdfkin.robot.trajectory import make_line_trajectory
from urdfkin.verify.singular_values import SingularValues

ODD: dict[str, Any] = {
    "None": None, "a half": 1.5, "zero": 0, "minus one": -1, "text": "2", "a list": [], "a mapping": {},
    "a set": {1, 2}, "a tuple": (1, "x"), "an object": object(), "nan": math.nan, "inf": math.inf,
    "too large": 10**400, "bytes": b"x", "True": True, "a class": int, "a function": len, "complex": 1j,
    "lists of two lengths": [[1.0], [1.0, 2.0]],
    "masked": np.ma.masked_array([1.0, 2.0], mask=[True, False]),
    "text in an object array": np.array(["1", "2"], dtype=object),
    "dates": np.array(["2020-01-01"], dtype="M8[D]"),
    "records": np.zeros(2, dtype=[("x", float)]),
    "a surrogate": "\ud800", "a null": "\x00", "a long text": "x" * 10_000,
}  # fmt: skip

ARM = robot_of(
    joint("j", "revolute", "a", "b", more=limit()), joint("k", "continuous", "b", "c", 'xyz="1 0 0"', "0 1 0")
)
#: Valid arguments for every parameter without a default.
GOOD: dict[str, Any] = {
    "q": [0.1, 0.2], "v": [0.1, 0.2], "a": [0.1, 0.2], "frame": "c", "n": 2,
    "start": [0.1, 0.2], "end": [0.3, 0.2],
    "name": "velocity", "inputs": ([0.1, 0.2], [0.1, 0.2]), "to": "numpy", "relative_to": "b",
}  # fmt: skip


def methods() -> list[str]:
    names = [name for name in dir(Robot) if not name.startswith("_")]
    # These methods take objects of the package.
    inside = {"plan", "select"}
    return [name for name in names if inspect.isfunction(getattr(Robot, name)) and name not in inside]


def cases() -> list[tuple[str, str]]:
    parameters = {method: [*inspect.signature(getattr(Robot, method)).parameters][1:] for method in methods()}
    return [(method, parameter) for method, names in parameters.items() for parameter in names]


@pytest.fixture(scope="module")
def robot() -> Robot:
    return urdfkin.load(ARM)


def failure(function: Callable[..., Any], arguments: dict[str, Any]) -> str | None:
    """Return a description of a wrong exception; None for a result, or for an error of urdfkin."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            function(**arguments)
        except urdfkin.UrdfkinError as error:
            return None if str(error) else "an error without words"
        except Exception as error:
            return f"{type(error).__name__}: {error}"
    return None


def failures(
    function: Callable[..., Any], good: dict[str, Any], parameter: str, odd: Any = None
) -> dict[str, str]:
    """Return the unusual values of a parameter that cause a wrong exception, with its description."""
    found = {label: failure(function, good | {parameter: x}) for label, x in (odd or ODD).items()}
    return {label: words for label, words in found.items() if words}


def good_for(function: Callable[..., Any]) -> dict[str, Any]:
    return {
        name: GOOD[name]
        for name, parameter in inspect.signature(function).parameters.items()
        if parameter.default is inspect.Parameter.empty
    }


@pytest.mark.parametrize(("method", "parameter"), cases())
def test_an_unusual_argument_of_a_method_gives_a_result_or_an_error_of_urdfkin(
    method: str, parameter: str, robot: Robot
) -> None:
    function = getattr(robot, method)
    for verify in (True, False):
        good = good_for(function)
        if "verify" in inspect.signature(function).parameters and parameter != "verify":
            good["verify"] = verify
        assert failure(function, good) is None
        assert failures(function, good, parameter) == {}, f"{verify=}"


@pytest.mark.parametrize("method", ["placement", "velocity", "jacobian", "acceleration"])
def test_an_unusual_argument_of_a_prepared_frame_gives_a_result_or_an_error_of_urdfkin(
    method: str, robot: Robot
) -> None:
    function = getattr(robot.prepare("c"), method)
    good = good_for(function)
    for name in (*good, "out"):
        assert failures(function, good, name) == {}, name


FUNCTIONS: dict[str, dict[str, Any]] = {
    "load": {"source": ARM}, "check": {"source": ARM}, "validate": {"robots": ARM, "samples": 1},
}  # fmt: skip
#: Arguments whose methods urdfkin calls, and whose exceptions are the caller's.
OBJECTS = {("validate", "executor"), ("validate", "progress"), ("check", "limits")}
ARGUMENTS = [(name, x) for name in FUNCTIONS for x in inspect.signature(getattr(urdfkin, name)).parameters]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "parameter"), [pair for pair in ARGUMENTS if pair not in OBJECTS])
def test_an_unusual_argument_of_a_function_gives_a_result_or_an_error_of_urdfkin(
    name: str, parameter: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # a text may be the path of a store
    # A very large number of processes or samples is valid, but takes too long.
    odd = {key: x for key, x in ODD.items() if key != "too large" or parameter not in ("jobs", "samples")}
    assert failures(getattr(urdfkin, name), FUNCTIONS[name], parameter, odd) == {}


def table_of_arm() -> DHTable:
    return urdfkin.load(ARM, verify=False).dh()


def calls() -> dict[str, tuple[Callable[..., Any], dict[str, Any]]]:
    """Return functions and methods outside `Robot`, each with valid arguments."""
    arm = urdfkin.load(ARM, verify=False)
    q, rows = [0.1, 0.2], [[0.5, 0.0, 0.0, 0.0]]
    path, table, screws, tree = arm.chain(), arm.dh(), arm.screws(), arm.tree_parameters()
    conversion, batch = arm.convention("drake"), [q, q]
    values, parts = arm.singular_values(batch, "c"), arm.acceleration_breakdown(batch, q, q, "c")
    motion = urdfkin.frame_motion(arm, (batch, batch, batch), "c")
    found, report = urdfkin.same(ARM, ARM, bounds=False), arm.certificate()
    angles = [0.0, 1.0, 2.0]
    row = {"a": 0.5, "alpha": 0.0, "d": 0.0, "theta": 0.0, "kind": JointKind.REVOLUTE, "joint": "j"}
    matrices = {"J": np.ones((6, 2)), "rate": np.ones((6, 2)), "H": np.ones((6, 2, 2))}
    return {
        "path.frames": (path.frames, {"q": q}),
        "table.placement": (table.placement, {"q": q}),
        "table.tolerance": (table.tolerance, {"q": q}),
        "table.to_html": (table.to_html, {"angles": "radians", "lengths": "metres", "digits": 10}),
        "screws.placement": (screws.placement, {"q": q}),
        "tree.reach": (tree.reach, {"q": q}),
        "tree.placements": (tree.placements, {"q": q}),
        "DHRow": (DHRow, {**row, "sense": 1, "beta": 0.0, "mimic": None, "limit": None}),
        "DHTable": (DHTable, {"convention": "standard", "rows": table.rows, "robot": "r", "snap": None}),
        "table_from_rows": (urdfkin.table_from_rows, {"rows": rows, "convention": "standard"}),
        "table_from_mapping": (dh.table_from_mapping, {"data": {"convention": "standard", "rows": rows}}),
        "make_dh_table": (dh.make_dh_table, good_options(arm)),
        "export": (dh.export, {"table": table, "format": "csv", "units": None, "verify": False}),
        "to_convention": (dh.to_convention, {"table": table, "convention": "modified"}),
        "to_tree": (dh.to_tree, {"table": table}),
        "to_urdf": (dh.to_urdf, {"table": table}),
        "Units": (dh.Units, {"angles": "degrees", "lengths": "metres", "digits": 3, "columns": COLUMNS}),
        "screws_from_rows": (screws_from_rows, {"screws": screws.space, "M": screws.M, "frame": "space"}),
        "read_table": (urdfkin.read_table, {"path": "robots/dh/ur5.toml"}),
        "to": (conversion.to, {"q": q, "v": q, "a": q}),
        "from_": (conversion.from_, {"q": q, "v": q, "a": q}),
        "layout": (conversion.layout, {"symbol": "q"}),
        "matrix_rate": (conversion.matrix_rate, {"q": q, "v": q}),
        "reorder_six_vector": (conversion.reorder_six_vector, {"x": np.ones(6), "axis": -1}),
        "jacobian_rate": (conversion.jacobian_rate, {"q": q, "v": q, **without(matrices, "H")}),
        "hessian": (conversion.hessian, {"q": q, **without(matrices, "rate")}),
        "singularity": (one_sample(values), {"sample": 0}),
        "contributions": (lambda sample: list(parts.contributions(sample)), {"sample": (0,)}),
        "singular_values_of": (motion.singular_values_of, {"rows": slice(0, 3)}),
        "manipulability": (motion.manipulability, {"rows": slice(0, 3)}),
        "frame_motion": (urdfkin.frame_motion, {"robot": arm, "motion": (batch,) * 3, "frame": "c"}),
        "make_line_trajectory": (
            make_line_trajectory,
            {"robot": arm, "start": q, "end": q, "duration": 1.0, "samples": 3},
        ),
        "within": (found.within, {"most": 0.5}),
        "exit_code": (found.exit_code, {"strict": False, "within": None}),
        "same": (urdfkin.same, {"a": ARM, "b": ARM, "bounds": False, "within": None}),
        "diff": (urdfkin.diff, {"a": ARM, "b": ARM, "effects": False}),
        "verify_function": (
            urdfkin.verify_function,
            {"function": len, "robot": arm, "quantity": "jacobian", "frame": "c", "samples": 1},
        ),
        "save": (report.save, {"path": os.devnull}),
        "unskew": (rotation.unskew, {"S": np.zeros((3, 3)), "tolerance": 1e-9}),
        "euler_rates": (rotation.euler_rates, {"name": "ZYZ", "angles": angles, "w": angles, "nearest": 0}),
        "quaternion_rates": (rotation.quaternion_rates, {"quat": [0, 0, 0, 1], "w": angles, "frame": "body"}),
        "jacobian_column": (bodies.jacobian_column, {"z": [0, 0, 1], "arm": [1, 0, 0], "turns": True}),
        "orientation_of": (bodies.orientation_of, {"representation": "quaternion", "R": np.eye(3)}),
    }  # fmt: skip


def one_sample(values: SingularValues) -> Callable[..., Any]:
    def singularity(sample: Any) -> Any:
        return values.singularity(sample)

    return singularity


def without(mapping: dict[str, Any], key: str) -> dict[str, Any]:
    return {name: value for name, value in mapping.items() if name != key}


def good_options(arm: Robot) -> dict[str, Any]:
    defaults = {
        name: parameter.default
        for name, parameter in inspect.signature(dh.make_dh_table).parameters.items()
        if parameter.default is not parameter.empty
    }
    return {"tree": arm.tree, "tip": "c", **defaults}


def test_an_unusual_argument_outside_a_robot_gives_a_result_or_an_error_of_urdfkin(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    odd = {
        **ODD, "an array": np.zeros((2, 3)), "an empty array": np.zeros(0), "without axes": np.array(0.5),
        "a signalling nan": Decimal("sNaN"), "an array of text": np.array(["a", "b"]),
    }  # fmt: skip
    found = {}
    for name, (function, good) in calls().items():
        with monkeypatch.context() as context:
            assert failure(function, good) is None, name
            context.chdir(tmp_path)
            for parameter in good:
                found[name, parameter] = failures(function, good, parameter, odd)
    assert {place: words for place, words in found.items() if words} == {}


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_path_a_table_and_screws_refuse_numbers_that_are_not_finite(bad: float) -> None:
    arm = urdfkin.load(ARM, verify=False)
    path, table, screws = arm.chain(), arm.dh(), arm.screws()
    methods = (path.frames, path.placement, path.axes, path.origins, path.interorigin)
    for method in (*methods, table.frames, table.placement, table.rounding, screws.placement):
        for q in ([0.1, bad], {"j": 0.1, "k": bad}, [[0.1, 0.1], [0.1, bad]]):
            with pytest.raises(urdfkin.InputError, match=r"k: q must be finite: found -?(nan|inf)"):
                method(q)


def test_very_large_numbers_cause_no_warning_of_numpy() -> None:
    arm = urdfkin.load("polar", verify=False)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for path in (arm.dh(), arm.screws()):
            assert path.rounding([0.0, 1e300]) > 1e280
        for check, value in ((rotation.rotation_from_quaternion, 4 * [1e300]), (as_axis, 3 * [1e300])):
            with pytest.raises(urdfkin.InputError, match="norm inf"):
                check(value)
        with pytest.raises(urdfkin.errors.RangeError):
            rotation.exp_rotation([1e300, 0.0, 0.0])


def as_axis(value: Any) -> Any:
    return rotation.rotation_about(value, 0.5)


def test_units_accept_the_names_of_the_units() -> None:
    # The text "radians" was once printed with the heading deg.
    assert dh.Units("degrees", "millimetres") == dh.parse_units("degrees", "millimetres")  # type: ignore[arg-type]
    assert dh.Units("radians").angle_name == "rad"  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "wrong",
    [
        {"mimic": Mimic("k", math.nan, 0.0)}, {"mimic": Mimic("k", 1.0, math.inf)},
        {"limit": Limit(2.0, 1.0, 1.0, 1.0)}, {"limit": Limit(math.nan, 1.0, 1.0, 1.0)},
        {"limit": "0 to 1"}, {"a": None}, {"a": True}, {"kind": "revolute"}, {"joint": None},
    ],
)  # fmt: skip
def test_a_row_refuses_wrong_values(wrong: dict[str, Any]) -> None:
    with pytest.raises(urdfkin.InputError):
        replace(table_of_arm().rows[0], **wrong)


@pytest.mark.parametrize("digits", [0, 18, -1, 2.5, "3", None, True])
def test_a_table_is_printed_with_1_to_17_digits(digits: Any) -> None:
    table = table_of_arm()
    for method in (table.to_html, table.to_latex, table.to_markdown):
        with pytest.raises(urdfkin.InputError, match="digits must be"):
            method(digits=digits)


def test_a_conversion_without_q_is_refused() -> None:
    # The velocities were once converted as configurations.
    conversion = urdfkin.load(ARM, verify=False).convention("drake")
    for method in (conversion.to, conversion.from_):
        with pytest.raises(urdfkin.InputError, match="q must be real numbers: found None"):
            method(None, [0.1, 0.2])  # type: ignore[call-overload]


def test_rows_of_a_frame_motion_must_be_a_slice(robot: Robot) -> None:
    motion = urdfkin.frame_motion(robot, [[[0.1, 0.2]]] * 3, "c")
    wrong: list[Any] = [2, None, True, [0, 1], slice("a", None)]
    for rows in wrong:
        for method in (motion.manipulability, motion.singular_values_of):
            with pytest.raises(urdfkin.InputError, match="rows must be a slice"):
                method(rows)


def test_check_refuses_an_unknown_root_joint() -> None:
    with pytest.raises(urdfkin.InputError, match="root_joint must be 'floating', 'planar' or None"):
        urdfkin.check(ARM, root_joint="flaoting")


@pytest.mark.parametrize("option", [{"executor": 1}, {"progress": "x"}, {"xacro_args": "x"}])
def test_validate_refuses_an_option_of_a_wrong_type(option: dict[str, Any]) -> None:
    with pytest.raises(urdfkin.InputError, match=f"`{next(iter(option))}` must be"):
        urdfkin.validate(ARM, samples=1, **option)


@pytest.mark.parametrize(
    ("value", "shown"),
    [("90deg", " --lock j=1.57"), ("x", ""), (10**400, "")],
    ids=["degrees", "text", "large"],
)
def test_a_lock_with_a_missing_robot_does_not_end_a_validation(value: Any, shown: str) -> None:
    report = urdfkin.validate(["missing.urdf", ARM], samples=1, lock={"j": value})
    assert report.robots_requested == 2
    assert f"missing.urdf{shown}" in report.robots[0].origin.command_line


def test_equal_paths_and_tables_can_be_compared_and_hashed(robot: Robot) -> None:
    for make in (robot.chain, robot.tree_parameters, robot.dh, robot.screws):
        first, second = make(), make()
        assert first == first  # noqa: PLR0124
        assert first != second
        assert hash(first) != hash(second)


@pytest.mark.parametrize("odd", [key for key in ODD if key != "a half"])
def test_an_invalid_duration_is_refused(odd: str, robot: Robot) -> None:
    with pytest.raises(urdfkin.InputError):
        make_line_trajectory(robot, robot.neutral(), robot.neutral(), ODD[odd], 5)


@pytest.mark.slow
@pytest.mark.parametrize("odd", [1.5, "2", True, 0, -1, None.__class__, math.nan])
@pytest.mark.parametrize("n", [1, 3, 40])
def test_threads_must_be_a_positive_integer_for_every_batch_size(odd: object, n: int, robot: Robot) -> None:
    with pytest.raises(urdfkin.InputError, match="threads"):
        robot.jacobian(robot.sample(n), "c", threads=odd)  # type: ignore[arg-type]


@pytest.mark.slow
def test_the_number_of_parts_is_limited_by_the_batch_and_the_processors(
    robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Ten million threads once caused ten million parts, which took 3.5 s.
    counted = []
    parts = evaluate._split_rows

    def counting(n: int, threads: int) -> list[slice]:
        counted.append(threads)
        return parts(n, threads)

    monkeypatch.setattr(evaluate, "_split_rows", counting)
    q = robot.sample(1000)
    many = robot.jacobian(q, "c", verify=False, threads=10**7)
    np.testing.assert_array_equal(many, robot.jacobian(q, "c", verify=False, threads=1))
    assert counted[0] <= min(1000 // LANES, len(os.sched_getaffinity(0)))


ARRAYS_REFUSED: dict[str, Any] = {
    "masked": np.ma.masked_array([1.0, 2.0], mask=True),
    "one masked": np.ma.masked_array([1.0, 2.0], mask=[True, False]),
    "a list of masked arrays": [np.ma.masked_array([1.0, 2.0], mask=True)],
    "a masked number in a list": [np.ma.masked, 1.0],
    "text": np.array(["1", "2"], dtype=object),
    "underscores": np.array(["1_0", "2"], dtype=object),
    "text beside a number": np.array([1.0, "2"], dtype=object),
    "None beside a number": [1.0, None],
    "bytes": np.array([b"1", b"2"], dtype=object),
    "complex numbers": np.array([1j, 2j], dtype=object),
}


@pytest.mark.parametrize("verify", [True, False])
@pytest.mark.parametrize("given", ARRAYS_REFUSED)
def test_arrays_that_are_not_real_numbers_are_refused(given: str, verify: bool, robot: Robot) -> None:
    with pytest.raises(urdfkin.InputError, match="q must be real numbers"):
        robot.placement(ARRAYS_REFUSED[given], "c", verify=verify)
    with pytest.raises(urdfkin.InputError, match="q must be real numbers"):
        robot.prepare("c").placement(ARRAYS_REFUSED[given])


@pytest.mark.slow
@pytest.mark.parametrize(
    "given",
    [
        np.ma.masked_array([1.0, 2.0], mask=False),
        np.array([Fraction(1), Decimal(2)], dtype=object),
        np.array([1, 2.0], dtype=object),
        (1, np.float32(2.0)),
    ],
)
def test_real_numbers_of_every_type_are_accepted(given: Any, robot: Robot) -> None:
    np.testing.assert_array_equal(robot.placement(given, "c"), robot.placement([1.0, 2.0], "c"))


def test_a_message_shows_that_a_long_value_is_cut() -> None:
    with pytest.raises(urdfkin.errors.InputError, match=r"found array\(.{51}\.\.\.$"):
        urdfkin.load(ARM, verify=False).placement(np.array(["0.123456789"] * 20), "j")
