"""For any value of a public argument, urdfkin returns a result or raises an error of its own."""

import inspect
import math
import os
import warnings
from collections.abc import Callable
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import urdfkin
from tests.urdfs import joint, limit
from tests.urdfs import robot as robot_of
from urdfkin.compiled import evaluate
from urdfkin.compiled.plan import LANES
from urdfkin.robot import Robot
from urdfkin.robot.trajectory import make_line_trajectory

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
