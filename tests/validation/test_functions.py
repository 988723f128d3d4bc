"""`verify_function` accepts correct functions, and names common mistakes of wrong functions."""

import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import urdfkin
from tests.cli.running import good, refused
from tests.cli.running import urdfkin as run
from tests.report.test_texts import junit_of
from tests.robots.odd_urdfs import random_tree
from tests.urdfs import built, joint
from tests.urdfs import robot as robot_text
from urdfkin.model.conventions import find_convention
from urdfkin.report.junit import function_checks_as_junit
from urdfkin.robot import Robot
from urdfkin.validation import functions
from urdfkin.validation.diagnosis import _SWAPPED_HALVES
from urdfkin.validation.functions import FunctionCheck, verify_function
from urdfkin.validation.programs import Program, ProgramError
from urdfkin.verify.quantities import recursive_quantities
from urdfkin.verify.verifier import compute_oracle_results_with_bound

#: Robots with a frame: arms, a quadruped, and grippers with mimic joints.
FRAMES = {
    "ur5": "tool0", "kinova": "j2s6s200_end_effector", "a1": "FL_foot", "xarm7": "link_eef",
    "panda": "panda_rightfinger",
}  # fmt: skip
MIMICS = {
    "panda": "panda_rightfinger",
    "talos": "gripper_left_fingertip_1_link",
    "pr2": "l_gripper_l_finger_tip_link",
    "romeo": "LFinger22Link",
    "tiago_pro": "gripper_left_fingertip_left_link",
}


@cache
def robot_of(name: str) -> Robot:
    return urdfkin.load(name)


def computed(robot: Robot, quantity: str, frame: str, reference: str | None = None) -> Callable[..., Any]:
    method = getattr(robot, quantity.replace(" ", "_"))
    named = {} if quantity == "placement" else {"reference": reference or "local_world_aligned"}
    return lambda *inputs: method(*inputs, frame, verify=False, **named)


@pytest.mark.parametrize("k", [0.0, -1.0, np.inf, np.nan])
def test_no_function_agrees_within_an_invalid_bound(k: float, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = robot_of("ur5")

    def with_factor(*args: Any) -> Any:
        results, bound = compute_oracle_results_with_bound(*args)
        return results, replace(bound, k=np.full_like(bound.k, k))

    monkeypatch.setattr(functions, "compute_oracle_results_with_bound", with_factor)
    found = verify_function(computed(robot, "placement", "tool0"), robot, "placement", samples=3)
    assert (found.agrees, found.bound_ratio) == (False, np.inf)


def check(
    name: str, quantity: str, function: Callable[..., Any], frames: dict[str, str] = FRAMES
) -> FunctionCheck:
    return verify_function(function, robot_of(name), quantity, frame=frames[name], samples=60)


def ur5_jacobian(q: np.ndarray) -> np.ndarray:
    return robot_of("ur5").jacobian(q, "tool0", verify=False)


def check_diagnosis(found: FunctionCheck, words: str) -> None:
    assert not found.agrees
    assert any(words in diagnosis for diagnosis in found.diagnoses), found


def scale_angles(q: np.ndarray, robot: Robot, factor: float) -> np.ndarray:
    at = [robot.tree.q_index[i] for i, x in enumerate(robot.tree.joints) if x.kind.turns and not x.mimic]
    q[..., at] *= factor
    return q


Wrong = Callable[[Callable[..., Any], Robot, str], Callable[..., Any]]

#: Mistakes: quantities, part of the diagnosis, and a function that makes a right function wrong.
SIX = ("velocity", "jacobian", "jacobian rate", "hessian", "acceleration")
MISTAKES: dict[str, tuple[tuple[str, ...], str, Wrong]] = {
    "angular rows first": (
        SIX, "the angular rows come first", lambda f, r, x: lambda *i: f(*i)[_SWAPPED_HALVES],
    ),
    "transposed": (("placement", "jacobian"), "transposed", lambda f, r, x: lambda *i: f(*i).T),
    "degrees": (("placement", "jacobian", "acceleration"), "takes q in degrees",
                lambda f, r, x: lambda q, *i: f(scale_angles(q, r, np.pi / 180), *i)),
    "millimetres": (("velocity", "jacobian"), "millimetres",
                    lambda f, r, x: lambda *i: (f(*i).T * ([1000.0] * 3 + [1.0] * 3)).T),
    "spatial acceleration": (("acceleration",), "the spatial acceleration was computed",
                             lambda f, r, x: lambda q, v, a: f(q, v, a) - bend(r, q, v, x)),
    "gravity": (("acceleration",), "gravity",
                lambda f, r, x: lambda *i: f(*i) + np.array([0, 0, 9.81, 0, 0, 0])),
    "no J-dot term": (("acceleration",), "the term J' v is missing",
                      lambda f, r, x: lambda q, v, a: f(q, 0 * v, a)),
    "inverted": (("placement",), "inverted", lambda f, r, x: lambda q: np.linalg.inv(f(q))),
}  # fmt: skip


def bend(robot: Robot, q: np.ndarray, v: np.ndarray, frame: str) -> np.ndarray:
    six = robot.velocity(q, v, frame, verify=False)
    return np.concatenate((np.cross(six[3:], six[:3]), np.zeros(3)))


@pytest.mark.parametrize("mistake", MISTAKES)
@pytest.mark.parametrize("name", FRAMES)
def test_the_diagnosis_describes_each_mistake_of_a_function(name: str, mistake: str) -> None:
    quantities, words, wrong = MISTAKES[mistake]
    robot, frame = robot_of(name), FRAMES[name]
    for quantity in quantities:
        found = check(name, quantity, wrong(computed(robot, quantity, frame), robot, frame))
        check_diagnosis(found, words)


@pytest.mark.parametrize("quantity", SIX)
@pytest.mark.parametrize("name", FRAMES)
def test_the_diagnosis_names_a_wrong_reference_frame(name: str, quantity: str) -> None:
    for reference in ("local", "world"):
        found = check(name, quantity, computed(robot_of(name), quantity, FRAMES[name], reference))
        check_diagnosis(found, f"is in {reference.upper()} instead of ")


@pytest.mark.parametrize("quantity", [row.name for row in recursive_quantities()])
@pytest.mark.parametrize("name", FRAMES)
def test_the_diagnosis_names_a_wrong_frame(name: str, quantity: str) -> None:
    robot, frame = robot_of(name), FRAMES[name]
    tree = robot.tree
    joint = next(i for i in reversed(tree.path(tree.frame_link(frame))) if tree.joints[i].kind.nv)
    other = tree.links[tree.joints[joint].parent]  # the link before the last moving joint
    found = check(name, quantity, computed(robot, quantity, f"link:{other}"))
    check_diagnosis(found, f"computes the result for the frame {other!r}")


def flip(x: np.ndarray, at: list[int]) -> np.ndarray:
    x = x.copy()
    x[at[0]] *= -1.0
    return x


def exchange(x: np.ndarray, at: list[int]) -> np.ndarray:
    x = x.copy()
    x[at] = x[at[::-1]]
    return x


@pytest.mark.parametrize("quantity", [row.name for row in recursive_quantities()])
@pytest.mark.parametrize("name", FRAMES)
def test_the_diagnosis_names_a_reversed_joint_and_exchanged_joints(name: str, quantity: str) -> None:
    robot, frame = robot_of(name), FRAMES[name]
    tree = robot.tree
    path = [i for i in tree.path(tree.frame_link(frame)) if tree.joints[i].nv][1:3]
    at_q, at_v = ([each[i] for i in path] for each in (tree.q_index, tree.v_index))
    one, other = (tree.joints[i].name for i in path)
    right = computed(robot, quantity, frame)
    shape = next(row.shape for row in recursive_quantities() if row.name == quantity)

    def wrong(change: Callable[..., np.ndarray]) -> Callable[..., Any]:
        def function(q: np.ndarray, *rates: np.ndarray) -> Any:
            result = right(change(q, at_q), *(change(x, at_v) for x in rates))
            for axis in range(1, result.ndim) if "nv" in str(shape) else ():
                result = np.moveaxis(change(np.moveaxis(result, axis, 0), at_v), 0, axis)
            return result

        return function

    check_diagnosis(check(name, quantity, wrong(flip)), f"{one!r} has the opposite sign")
    check_diagnosis(check(name, quantity, wrong(exchange)), f"{one!r} and {other!r} are exchanged")


def without_mimic_columns(robot: Robot, frame: str, **options: Any) -> Callable[[np.ndarray], np.ndarray]:
    """Return a Jacobian to which the columns of mimic joints are not added."""
    free = urdfkin.load(robot.source, mimic=False, verify=False, **options)
    own = [free.velocity_names.index(x) for x in robot.velocity_names]
    return lambda q: free.jacobian(free.from_pinocchio(robot.to_pinocchio(q)), frame)[:, own]


@pytest.mark.filterwarnings("ignore::urdfkin.UrdfWarning")  # the PR2's file has a warning about an inertia
@pytest.mark.parametrize("name", MIMICS)
def test_the_diagnosis_names_a_missing_mimic_column(name: str) -> None:
    function = without_mimic_columns(robot_of(name), MIMICS[name])
    found = check(name, "jacobian", function, MIMICS)
    check_diagnosis(found, "the columns of the mimic joints (")
    check_diagnosis(found, ") are not added")


def test_the_diagnosis_describes_two_mistakes_and_the_joint_order_of_another_tool() -> None:
    local = computed(robot_of("ur5"), "jacobian", "tool0", "local")
    (words,) = check("ur5", "jacobian", lambda q: local(q)[_SWAPPED_HALVES]).diagnoses
    assert "is in LOCAL" in words
    assert words.endswith("and the angular rows come first")
    tool = robot_of("a1").with_convention("isaaclab")
    check_diagnosis(check("a1", "jacobian", computed(tool, "jacobian", "FL_foot")), "order of isaaclab")  # type: ignore[arg-type]


# -- correct functions ----------------------------------------------------------------------------------


def pinocchio_function(robot: Robot, quantity: str, frame: str) -> Callable[..., Any]:
    model = robot.pinocchio_model()
    data, at = model.createData(), model.getFrameId(frame)
    aligned = pin.LOCAL_WORLD_ALIGNED

    def function(q: np.ndarray, v: np.ndarray | None = None, a: np.ndarray | None = None) -> Any:
        if quantity == "placement":
            pin.framesForwardKinematics(model, data, q)
            return data.oMf[at].homogeneous
        if quantity == "jacobian":
            return pin.computeFrameJacobian(model, data, q, at, aligned)
        pin.forwardKinematics(model, data, q, v, np.zeros(model.nv) if a is None else a)
        if quantity == "velocity":
            return pin.getFrameVelocity(model, data, at, aligned).vector
        return pin.getFrameClassicalAcceleration(model, data, at, aligned).vector

    return lambda q, *rates: function(robot.to_pinocchio(q), *rates)


@pytest.mark.filterwarnings("ignore::urdfkin.UrdfWarning")  # axes that are not of unit length
@pytest.mark.parametrize("seed", range(200))
def test_a_correct_function_has_no_diagnosis_of_a_mistake(seed: int) -> None:
    robot = urdfkin.load(random_tree(1000 + seed), mimic=False)
    leaves = list(robot.tree.leaves())
    frame = robot.tree.links[leaves[seed % len(leaves)]]
    quantity = ("placement", "velocity", "jacobian", "acceleration")[seed % 4]
    function = pinocchio_function(robot, quantity, frame)
    found = verify_function(function, robot, quantity, frame=f"link:{frame}", samples=20, seed=seed)
    assert found.agrees, found
    assert not found.diagnoses


def test_a_function_with_another_algorithm_or_that_reuses_its_arrays_agrees() -> None:
    robot = robot_of("ur5")
    screws = robot.screws("tool0")
    found = verify_function(screws.placement, robot, "placement", frame="tool0", samples=200)
    assert found.agrees, found
    out = np.zeros((6, 6))

    def function(q: np.ndarray) -> np.ndarray:
        out[:] = ur5_jacobian(q)
        q[:] = 0.0
        return out

    assert check("ur5", "jacobian", function).agrees


# -- what a check reports -------------------------------------------------------------------------------


def test_the_diagnosis_names_one_wrong_number_and_the_needed_factor() -> None:
    wrong = np.zeros((6, 6))
    wrong[1, 3] = 1e-9
    found = check("ur5", "jacobian", lambda q: ur5_jacobian(q) + wrong)
    assert not found.agrees
    assert [name for name, share in found.rows.items() if share > 1] == ["vy"]
    assert [name for name, share in found.columns.items() if share > 1] == ["wrist_1_joint"]
    assert "The number vy, wrist_1_joint is" in str(found)

    def single(q: np.ndarray) -> np.ndarray:
        return ur5_jacobian(q).astype(np.float32)

    found = check("ur5", "jacobian", single)
    check_diagnosis(found, "single precision")
    how: dict[str, Any] = {"samples": 60, "factor": found.smallest_factor * 1.0001}
    assert verify_function(single, robot_of("ur5"), "jacobian", frame="tool0", **how).agrees


def test_exceptions_and_wrong_shapes_of_a_checked_function_are_counted_as_errors() -> None:
    def function(q: np.ndarray) -> Any:
        if q[0] > 0:
            raise ValueError("no solution")
        return ur5_jacobian(q) if q[1] > 0 else [1.0, 2.0]

    found = check("ur5", "jacobian", function)
    assert not found.agrees
    assert 0 < found.compared < found.samples == 63
    assert found.errors == found.samples - found.compared
    messages = {error.message for error in found.first_errors}
    assert {"ValueError: no solution", "shape (2,), expected (6, 6)"} >= messages
    assert found.bound_ratio == 0.0


def test_numbers_that_are_not_finite_disagree_and_an_exit_of_the_function_is_an_error() -> None:
    found = check("ur5", "jacobian", lambda q: np.full((6, 6), np.nan))
    assert not found.agrees
    assert found.diagnoses == ("63 results are not finite",)
    assert found.as_dict()["bound_ratio"] is None

    def function(q: np.ndarray) -> np.ndarray:
        raise SystemExit(0)

    found = check("ur5", "jacobian", function)
    assert not found.agrees
    assert found.errors == found.samples


def test_a_function_of_batches_is_called_once_for_each_batch() -> None:
    robot, sizes = robot_of("ur5"), list[int]()

    def function(q: np.ndarray, v: np.ndarray) -> np.ndarray:
        sizes.append(len(q))
        return robot.velocity(q, v, "tool0", verify=False)

    assert verify_function(function, robot, "velocity", frame="tool0", samples=300, batch=True).agrees
    assert sum(sizes) == 303
    assert len(sizes) == 2


@pytest.mark.parametrize("convention", ["drake", "mujoco", "rtb", "isaaclab"])
@pytest.mark.parametrize("quantity", [row.name for row in recursive_quantities()])
def test_a_function_in_a_convention_agrees_and_exchanged_rows_are_named(
    convention: str, quantity: str
) -> None:
    robot = urdfkin.load("a1", root_joint="floating")
    tool = robot.with_convention(convention)
    right = computed(tool, quantity, "FL_foot")  # type: ignore[arg-type]
    how: dict[str, Any] = {"frame": "FL_foot", "samples": 20, "convention": convention}
    moving = not tool.conversion.is_constant and quantity in ("jacobian rate", "hessian")
    if moving:
        with pytest.raises(urdfkin.InputError, match="floating or planar joint has other axes"):
            verify_function(right, robot, quantity, **how)
        return
    assert verify_function(right, robot, quantity, **how).agrees
    if quantity != "placement":
        found = verify_function(lambda *i: right(*i)[_SWAPPED_HALVES], robot, quantity, **how)
        check_diagnosis(found, "rows come first")


@pytest.mark.parametrize("quantity", ["imu", "analytical jacobian"])
@pytest.mark.parametrize("convention", ["pinocchio", "mujoco"])
def test_a_quantity_that_no_convention_defines_is_refused(quantity: str, convention: str) -> None:
    robot = urdfkin.load("ur5", root_joint="floating")
    with pytest.raises(urdfkin.InputError, match="does not define how to convert this quantity"):
        verify_function(lambda *_: None, robot, quantity, samples=2, convention=convention)


@pytest.mark.parametrize("quantity", ["jacobian rate", "hessian"])
def test_a_function_for_the_centre_of_mass_in_the_axes_of_the_body_is_checked(quantity: str) -> None:
    robot = urdfkin.load("go2", root_joint="floating")
    convention = replace(find_convention("urdfkin"), name="centre", point="centre of mass")
    right = computed(robot.with_convention(convention), quantity, "FL_foot")  # type: ignore[arg-type]
    how: dict[str, Any] = {"frame": "FL_foot", "samples": 20, "convention": convention}
    assert verify_function(right, robot, quantity, **how).agrees
    assert not verify_function(computed(robot, quantity, "FL_foot"), robot, quantity, **how).agrees


def test_a_function_is_compared_without_an_oracle_and_the_result_says_so() -> None:
    arm = urdfkin.load("planar_two_link")
    arm.verifier.known_refusal = "a reason"
    found = verify_function(lambda q: arm.jacobian(q, "tip", verify=False), arm, samples=5)
    assert found.oracle_bound_ratio is None
    assert "NOT checked" in str(found)
    failures = [case.get("type") for case in junit_of(function_checks_as_junit([found])).iter("failure")]
    assert failures == ["not verified"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [({"quantity": "torque"}, "torque"), ({"quantity": "joint jacobian"}, "cannot check functions"),
     ({"factor": 0.0}, "factor must be positive"), ({"samples": -1}, "samples"), ({"frame": "hand"}, "hand")],
)  # fmt: skip
def test_a_wrong_argument_is_an_error(arguments: dict[str, Any], words: str) -> None:
    with pytest.raises(urdfkin.UrdfkinError, match=words):
        verify_function(lambda q: q, robot_of("ur5"), **arguments)


@pytest.mark.parametrize(
    ("result", "words"),
    [
        (lambda J: J + 1j, "complex128, expected real numbers"),
        (lambda J: J.astype(str), "expected real numbers"),
        (lambda J: np.ma.masked_array(J, True), "a masked array"),
        (lambda J: None, "the function returns None; is `return` missing?"),
    ],
)
def test_a_result_that_is_no_array_of_real_numbers_is_an_error(result: Any, words: str) -> None:
    found = check("ur5", "jacobian", lambda q: result(ur5_jacobian(q)))
    assert not found.agrees
    assert words in found.first_errors[0].message


def test_a_mistake_that_leaves_two_percent_of_the_difference_is_not_reported() -> None:
    fixed = [joint(f"to_{x}", "fixed", "arm", f"at_{x}", f'xyz="{x} 0 0"', "") for x in ("0.02", "1")]
    robot = built(joint("j", "continuous", "base", "arm"), *fixed)

    def at_the_arm(q: np.ndarray) -> np.ndarray:
        T = robot.placement(q, "arm")
        T[0, 3] += 5e-4
        return T

    found = verify_function(at_the_arm, robot, "placement", frame="at_1")
    assert found.diagnoses == ("the function computes the result for the frame 'arm' instead of 'at_1'",)


def test_equal_messages_share_a_line_and_a_transposed_result_is_named() -> None:
    found = verify_function(lambda q: np.zeros((2, 6)), urdfkin.load("planar_two_link"), samples=7)
    lines = str(found).splitlines()
    assert lines[2:] == [
        "10 configurations without a usable result; the first ones:",
        "  samples 0, 1, 2, 3, 4: shape (2, 6), expected (6, 2)",
        "Diagnosis: the result is transposed: its shape is (2, 6) in place of (6, 2).",
    ]


def test_a_function_that_only_raises_exceptions_has_no_diagnosis() -> None:
    def refuses_zero(q: np.ndarray) -> np.ndarray:
        assert q.any(), "zero"
        return ur5_jacobian(q)

    found = check("ur5", "jacobian", refuses_zero)
    assert (found.agrees, found.errors, found.diagnoses) == (False, 1, ())


@pytest.mark.parametrize("convention", ["mujoco", "pinocchio"])
def test_a_wrong_function_of_a_convention_with_values_of_mimic_joints_is_reported(convention: str) -> None:
    robot = robot_of("panda")
    own = robot.convention(convention)

    def shifted(q: np.ndarray) -> np.ndarray:
        return robot.placement(own.from_(q), "panda_hand") + 1.0

    options: dict[str, Any] = {"frame": "panda_hand", "convention": convention, "samples": 5}
    found = verify_function(shifted, robot, "placement", **options)
    assert (found.agrees, found.errors, found.diagnoses) == (False, 0, ())


def test_the_diagnosis_of_a_robot_with_mimic_joints_uses_the_options_of_the_quantity() -> None:
    robot, free = robot_of("panda"), urdfkin.load("panda", mimic=False)
    names = [free.coordinate_names.index(name) for name in robot.coordinate_names]

    def without_mimic(q: np.ndarray) -> np.ndarray:
        whole = np.zeros(free.nq)
        whole[names] = q
        return free.relative_placement(whole, "panda_rightfinger", "panda_link5")

    found = verify_function(
        without_mimic,
        robot,
        "relative placement",
        frame="panda_rightfinger",
        relative_to="panda_link5",
        samples=5,
    )
    check_diagnosis(found, "the mimic joints ('panda_finger_joint2') do not move")


def test_a_robot_without_moving_joints_is_compared_and_a_missing_column_of_a_locked_robot_is_named() -> None:
    robot = urdfkin.load(robot_text(joint("j", "fixed", "a", "b", 'xyz="1 0 0"', "")))
    assert verify_function(lambda q: np.zeros((6, 0)), robot, "jacobian", samples=3).agrees
    assert not verify_function(lambda q: np.eye(4), robot, "placement", samples=3).agrees
    answers = iter([None, *[np.zeros((6, 0))] * 10])
    found = verify_function(lambda q: next(answers), robot, "jacobian", samples=3)
    assert (found.errors, found.worst) == (1, None)
    assert "1 configuration without a usable result" in str(found)
    lock, frame = {"panda_joint3": 0.5}, "panda_rightfinger"
    robot = urdfkin.load("panda", lock=lock)
    function = without_mimic_columns(robot, frame, lock=lock)
    found = verify_function(function, robot, "jacobian", frame=frame, samples=30)
    check_diagnosis(found, "not added")


# -- programs and the command ---------------------------------------------------------------------------

ADAPTERS = Path(__file__).parents[2] / "examples" / "adapters"
ADAPTER = """
import json, sys, time
import urdfkin
robot = None
for k, line in enumerate(sys.stdin):
    request = json.loads(line)
    if robot is None:
        robot = urdfkin.load(request["robot"], verify=False)
    {fault}
    J = robot.jacobian(request["q"], request["frame"], request["reference"])
    print(json.dumps({{"result": J.tolist()}}), flush=True)
"""
FAULTS = {
    "hang": ("if k == 3: time.sleep(60)", "no answer within"),
    "crash": ("if k == 3: sys.exit('out of luck')", "ended with exit code 1: out of luck"),
    "nan": ("if k == 3: print(json.dumps({'result': [[float('nan')] * 6] * 6}), flush=True); continue", ""),
    "shape": ("if k == 3: print(json.dumps(dict(result=[1, 2])), flush=True); continue", "shape (2,)"),
    "garbage": ("if k == 3: print('hello', flush=True); continue", "not JSON: 'hello'"),
    "error": ("if k == 3: print(json.dumps(dict(error='too far')), flush=True); continue", "too far"),
    "no result": ("if k == 3: print('[]', flush=True); continue", 'no member "result"'),
}


@pytest.mark.long
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_of_a_program_is_reported_and_the_check_continues(fault: str, tmp_path: Path) -> None:
    code, words = FAULTS[fault]
    adapter = tmp_path / "adapter.py"
    adapter.write_text(ADAPTER.format(fault=code))
    done = run(
        *("verify", f"{sys.executable} {adapter}", "ur5", "--program", "--frame", "tool0", "--samples", "7"),
        *("--timeout", "20" if fault != "hang" else "5", "--format", "json"),
    )
    assert done.code == 1, done.err
    data = done.data
    if fault == "nan":
        assert data["diagnoses"] == ["1 result is not finite"]
    else:
        assert words in data["first_errors"][0]["message"]
    assert data["compared"] >= 10 - 3


@pytest.mark.slow
def test_a_late_line_of_a_program_is_not_the_answer_to_the_next_request(tmp_path: Path) -> None:
    adapter = tmp_path / "adapter.py"
    answer = "print(json.dumps(dict(result=robot.jacobian(request['q'], 'tip').tolist())), flush=True)"
    late = f"if k == 3: print('debug', flush=True); time.sleep(0.5); {answer}; continue"
    adapter.write_text(ADAPTER.format(fault=late))
    done = run(
        *("verify", f"{sys.executable} {adapter}", "planar_two_link", "--program", "--samples", "3"),
        *("--timeout", "60", "--format", "json"),
    )
    assert (done.data["compared"], done.data["errors"]) == (5, 1)
    assert done.data["bound_ratio"] <= 1.0


def test_a_program_that_answers_with_errors_gets_all_requests() -> None:
    arm = urdfkin.load("planar_two_link")
    command = ["sed", "-u", r's/.*"q": *\[ *0.0,.*/{"error": "singular"}/; t; s/.*/{"result": [1]}/']
    with Program(command, arm, "jacobian", "tip", "local_world_aligned") as program:
        for _ in range(4):
            with pytest.raises(ProgramError, match="singular"):
                program(np.zeros(2))
        assert program(np.ones(2)) == [1]


def test_a_file_named_like_a_library_does_not_replace_the_library_and_requests_have_locked_joints(
    tmp_path: Path,
) -> None:
    file = tmp_path / "mujoco.py"
    file.write_text("def jacobian(q):\n    return q\n")
    pytest.importorskip("mujoco")
    done = run("verify", f"{file}:jacobian", "planar_two_link", "--oracle", "mujoco", "--samples", "3")
    assert done.code == 1, done.err
    assert "shape (2,)" in done.text
    kept = tmp_path / "request"
    command = f"sed -u 's/.*/&/w {kept}'"
    options = "--lock", "joint_1=1", "--samples", "0"
    done = run("verify", command, "planar_two_link", "--program", *options)
    assert done.code == 1
    request = json.loads(kept.read_text().splitlines()[0])
    assert request["coordinates"] == ["joint_2"]
    assert request["lock"] == {"joint_1": 1.0}
    assert run("verify", "a'b", "planar_two_link", "--program").code == 2


@pytest.mark.parametrize("mimic", [True, False])
def test_a_request_states_that_mimic_joints_move_freely(mimic: bool, tmp_path: Path) -> None:
    kept = tmp_path / "request"
    robot = urdfkin.load("panda", mimic=mimic, verify=False)
    command = ["sed", "-u", "-e", f"w {kept}", "-e", 's/.*/{"result": [1]}/']
    with Program(command, robot, "jacobian", "panda_hand", "local_world_aligned") as program:
        program(robot.neutral())
    request = json.loads(kept.read_text().splitlines()[0])
    assert len(request["coordinates"]) == (8 if mimic else 9)
    assert request.get("mimic", True) is mimic


@pytest.mark.long
@pytest.mark.parametrize("tool", ["g++", "octave"])
def test_the_examples_in_cpp_and_octave_agree(tool: str, tmp_path: Path) -> None:
    if shutil.which(tool) is None:
        pytest.skip(f"no {tool}")
    target = f"octave -q {ADAPTERS / 'planar.m'}"
    if tool == "g++":
        target = str(tmp_path / "planar")
        subprocess.run(["g++", "-O2", ADAPTERS / "planar.cpp", "-o", target], check=True)
    done = good("verify", target, "planar_two_link", "--program", "--samples", "20", "--timeout", "60")
    assert "23 of 23 results compared" in done.text


def test_the_command_checks_a_function_of_a_file(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(
        "import urdfkin\nrobot = urdfkin.load('ur5', verify=False)\n"
        "def jacobian(q):\n    return robot.jacobian(q, 'tool0')\n"
        "def jacobian_in_local(q):\n    return robot.jacobian(q, 'tool0', 'local')\n"
    )
    right = good("verify", f"{file}:jacobian", "ur5", "--samples", "20")
    assert "agrees" in right.text
    bad = run("verify", f"{file}:jacobian_in_local", "ur5", "--samples", "20")
    assert bad.code == 1
    assert "Diagnosis: the result is in LOCAL" in bad.text
    assert "urdfkin jacobian ur5 --frame tool0" in bad.text


def test_all_functions_of_a_file_are_checked(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(
        "import urdfkin\nfrom urdfkin import load\nrobot = load('ur5', verify=False)\n"
        "def tool_jacobian(q):\n    return robot.jacobian(q, 'tool0')\n"
        "def placement(q):\n    return robot.placement(q, 'tool0')\n"
        "def velocity(q, v):\n    return robot.velocity(q, -v, 'tool0')\n"
        "def helper():\n    pass\n"
        "import functools\nacceleration = functools.partial(lambda q, v, a: [0.0] * 6)\n"
    )
    done = run("verify", str(file), "ur5", "--samples", "10", "--format", "json")
    assert done.code == 1
    found = {check["function"]: check["agrees"] for check in done.data["checks"]}
    assert found == {"tool_jacobian": True, "placement": True, "velocity": False, "partial": False}
    junit = tmp_path / "checks.xml"
    text = run("verify", str(file), "ur5", "--samples", "10", "--junit", str(junit)).text
    root = junit_of(junit.read_bytes())
    failed = [case.get("name") for case in root.iter("testcase") if case.find("failure") is not None]
    assert failed == ["velocity by velocity", "acceleration by partial"]
    assert root.get("tests") == "4"
    assert "tool_jacobian: agrees" in text
    assert "velocity: DISAGREES" in text


def test_a_wrong_target_is_refused_in_one_line(tmp_path: Path) -> None:
    for name, text in (
        ("mine", "def jacobian(q):\n    return q\n\n\ncompute = jacobian\n"),
        *(("empty", "x = 1\n"), ("ends", "raise SystemExit(0)\n"), ("broken", "1 / 0\n")),
    ):
        (tmp_path / f"{name}.py").write_text(text)
    assert "FILE.py:FUNCTION" in refused("verify", "mine", "ur5")
    for target, words in (
        ("none.py:jacobian", "no such file"),
        ("mine.py:jacobean", "jacobian"),
        ("mine.py:compute", "pass --quantity"),
        ("empty.py", "no function in the file"),
        ("ends.py", "SystemExit"),
        ("broken.py:jacobian", "ZeroDivisionError"),
    ):
        assert words in refused("verify", str(tmp_path / target), "ur5")
