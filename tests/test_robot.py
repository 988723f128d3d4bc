"""A robot returns checked results; an error is clear, and states how to reproduce the result."""

import inspect
import io
import pickle
import re
import shlex
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import urdfkin
from tests import urdfs
from tests.cli.running import good
from tests.cli.running import urdfkin as command
from tests.robots.odd_urdfs import urdf_of
from tests.urdfs import joint, limit
from urdfkin.errors import InputError, UnknownNameError, UrdfkinError
from urdfkin.kinematics import roundings
from urdfkin.kinematics.rotation import exp_rotation
from urdfkin.model.base_motion import BaseMotion
from urdfkin.model.reference import Reference
from urdfkin.robot import _INTERNAL_NAMES, Robot
from urdfkin.robot.loading import as_robot
from urdfkin.verify import verifier
from urdfkin.verify.comparison import BatchComparison
from urdfkin.verify.oracle import QueryBatch
from urdfkin.verify.pinocchio import PinocchioOracle
from urdfkin.verify.quantities import QUANTITIES, Quantity


@pytest.fixture
def panda() -> Robot:
    return urdfkin.load("panda")


@pytest.fixture
def no_room(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make all bounds smaller than rounding errors, so that correct results raise VerificationError."""
    monkeypatch.setattr(roundings, "PINOCCHIO_ROUNDINGS", 1e-9)


HAND = "panda_hand"
METHODS = ["placement", "velocity", "jacobian", "jacobian_rate", "hessian", "acceleration"]


def disagreement(robot: Robot, quantity: str, **base: BaseMotion) -> urdfkin.VerificationError:
    """Return the error of a call with a batch (2, 3), in LOCAL if the quantity has a reference frame."""
    q = robot.sample(6, 1).reshape(2, 3, robot.nq)
    v, a = np.random.default_rng(2).normal(size=(2, 2, 3, robot.nv))
    inputs = {"velocity": (q, v), "jacobian_rate": (q, v), "acceleration": (q, v, a)}.get(quantity, (q,))
    reference = () if quantity == "placement" else ("local",)
    with pytest.raises(urdfkin.VerificationError) as caught:
        getattr(robot, quantity)(*inputs, robot.tip_frame, *reference, **base)
    return caught.value


@pytest.mark.usefixtures("no_room")
def test_a_verification_error_states_quantity_frame_difference_and_bound(panda: Robot) -> None:
    error = disagreement(panda, "acceleration")
    assert error.is_disagreement
    assert (error.quantity, error.frame, error.reference) == ("acceleration", "panda_hand_tcp", "LOCAL")
    assert len(error.index) == 2
    assert error.ours.shape == error.theirs.shape == error.bound.shape == (6,)
    assert (np.abs(error.ours - error.theirs) > error.bound).any()
    assert "the acceleration of panda_hand_tcp (LOCAL) disagrees with Pinocchio's" in str(error)
    assert f"sample {list(error.index)}" in str(error)
    copy = pickle.loads(pickle.dumps(error))
    assert str(copy) == str(error)
    assert (copy.ours == error.ours).all()
    assert copy.reproduce == error.reproduce


@pytest.mark.slow
@pytest.mark.parametrize("quantity", METHODS)
@pytest.mark.parametrize("root_joint", [None, "floating"])
@pytest.mark.usefixtures("no_room")
def test_the_replay_line_repeats_the_disagreement(
    quantity: str, root_joint: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    error = disagreement(urdfkin.load("panda", root_joint=root_joint, mimic=False), quantity)
    words = shlex.split(error.reproduce)
    assert words[:3] == ["urdfkin", quantity.replace("_", "-"), "panda"]
    again = command(*words[1:])
    assert again.code == 1
    assert f"the {error.quantity} of panda_hand_tcp" in again.err
    monkeypatch.undo()
    result = good(*words[1:], "--format", "json")
    # A single configuration and a batch may differ in the last digits.
    assert np.abs(np.array(result.data["result"][0]) - error.ours).max() < 1e-12


@pytest.mark.usefixtures("no_room")
def test_the_replay_line_reads_a_text_from_standard_input_and_quotes_a_path(tmp_path: Path) -> None:
    text = urdf_of("odd_names")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", urdfkin.UrdfWarning)
        words = shlex.split(disagreement(urdfkin.load(text), "jacobian").reproduce)
        assert command(*words[1:], stdin=text).code == 1
        path = tmp_path / "my robot's.urdf"
        path.write_text(text, encoding="utf-8")
        words = shlex.split(disagreement(urdfkin.load(path), "jacobian").reproduce)
        assert words[2] == str(path)
        assert command(*words[1:]).code == 1


@pytest.mark.slow
@pytest.mark.parametrize("quantity", METHODS)
@pytest.mark.parametrize("batch", [(), (2, 3)])
@pytest.mark.usefixtures("no_room")
def test_the_replay_line_is_python_for_a_moving_base(
    panda: Robot, quantity: str, batch: tuple[int, ...]
) -> None:
    generator = np.random.default_rng(3)
    T = np.tile(np.eye(4), (*batch, 1, 1))
    T[..., :3, :3] = exp_rotation(generator.normal(size=(*batch, 3)))
    error = disagreement(panda, quantity, base=BaseMotion(T, *generator.normal(size=(2, *batch, 6))))
    with pytest.raises(urdfkin.VerificationError) as again:
        eval(error.reproduce, {"urdfkin": urdfkin})
    assert again.value.quantity == error.quantity
    assert np.abs(again.value.ours - error.ours).max() < 1e-12


@pytest.mark.parametrize(
    ("name", "velocity", "reason"), [("universe", 1, "reads another robot"), ("j", -1, "refuses the file")]
)
def test_results_that_pinocchio_cannot_check_cause_a_warning_and_are_not_verified(
    name: str, velocity: int, reason: str
) -> None:
    more = limit().replace('velocity="1"', f'velocity="{velocity}"')
    text = urdfs.robot(joint(name, "revolute", "a", "b", axis="", more=more))
    with pytest.warns(urdfkin.UrdfWarning):
        robot = urdfkin.load(text)
    for _ in range(2):
        with pytest.warns(urdfkin.NotVerifiedWarning, match=f"not verified: Pinocchio {reason}"):
            assert robot.jacobian([0.3], "b")[3:, 0].tolist() == [1.0, 0.0, 0.0]
    certificate = robot.certificate()
    assert [(line.checked, line.unchecked) for line in certificate.lines] == [(0, 2)]
    assert not certificate.verified
    assert reason in certificate.not_verified[0]


def test_a_result_that_is_nan_is_a_disagreement(monkeypatch: pytest.MonkeyPatch, panda: Robot) -> None:
    from urdfkin.compiled import evaluate

    monkeypatch.setattr(evaluate, "jacobians", lambda plan, q, *_, **__: np.full((len(q), 1, 6, 8), np.nan))
    with pytest.raises(urdfkin.VerificationError, match="disagrees"):
        panda.jacobian(panda.neutral()[np.newaxis], "panda_hand")


def test_a_disagreement_with_a_nan_ratio_is_raised_too(monkeypatch: pytest.MonkeyPatch, panda: Robot) -> None:
    # An infinite disagreement with an infinite bound has the share NaN, in either part of a check.
    wrong, right = BatchComparison(1, np.inf, np.nan, (0, 0)), BatchComparison(1, 1.0, 0.5, (0, 0))
    for results in ([wrong], [wrong, right], [right, wrong]):
        found = iter(results)
        monkeypatch.setattr(verifier, "compare", lambda *_, found=found: next(found))
        monkeypatch.setattr(verifier, "_MAX_CONFIGURATIONS", 1)
        with pytest.raises(urdfkin.VerificationError):
            panda.placement(panda.sample(len(results)), "panda_hand", verify=True)


class _RequiresGradient:
    def __array__(self, *_: Any, **__: Any) -> Any:
        raise RuntimeError("Can't call numpy() on Tensor that requires grad. Use tensor.detach().numpy()")


def test_symbols_of_casadi_and_tensors_with_a_gradient_are_input_errors(panda: Robot) -> None:
    casadi: Any = pytest.importorskip("casadi")
    for value, message in (
        (casadi.SX.sym("q", 8), "q must be real numbers: found SX"),
        (casadi.DM.zeros(8), r"q needs 8 numbers .* found shape \(8, 1\)"),
        (_RequiresGradient(), "q cannot be converted to a NumPy array: .* Use tensor.detach"),
    ):
        with pytest.raises(InputError, match=message):
            panda.placement(value, "panda_hand")
    found = panda.placement(casadi.DM.zeros(8).T, "panda_hand")
    assert np.array_equal(found[0], panda.placement(np.zeros(8), "panda_hand"))


@pytest.mark.parametrize(
    "value",
    ["abc", np.ones(8) * 1j, [[1.0], [1.0, 2.0]], None, np.zeros(8, dtype="M8[s]"), ["0"] * 8],
    ids=repr,
)
def test_inputs_that_are_not_numbers_are_refused(panda: Robot, value: Any) -> None:
    no_numbers = "must be real numbers|needs 8 numbers"
    with pytest.raises(UrdfkinError, match=f"q ({no_numbers})|unknown pose 'abc'"):
        panda.placement(value, "panda_hand")
    with pytest.raises(UrdfkinError, match=f"v ({no_numbers})|unknown pose 'abc'"):
        panda.velocity(np.zeros(8), value, "panda_hand")
    with pytest.raises(UrdfkinError, match=r"q must be (real numbers|finite)|wrong length"):
        panda.from_pinocchio(value)


Z = np.zeros
REFUSED: list[tuple[Callable[[Robot], object], str]] = [
    (lambda x: x.placement(Z(7), HAND), r"q needs 8 numbers for panda: panda_joint1, .*found shape \(7,\)"),
    (lambda x: x.acceleration(Z(8), Z(8), Z((3, 9)), HAND), "a needs 8 numbers for panda: panda_joint1"),
    (lambda x: urdfkin.load(urdf_of("single_link")).placement([1.0], "base"), "none, no joint moves"),
    (lambda x: x.from_pinocchio(Z(8)), "wrong length"),
    *((lambda x, bad=bad: x.from_pinocchio(np.full(9, bad)), "finite") for bad in (np.nan, np.inf, -np.inf)),
    (lambda x: x.velocity(Z((2, 8)), Z((3, 8)), HAND), r"do not broadcast: found \(2,\), \(3,\)"),
    (
        lambda x: x.placement(Z((2, 8)), HAND, base=BaseMotion(velocity=Z((4, 6)))),
        r"do not broadcast: found \(2,\), \(4,\)",
    ),
    *(
        (lambda x, frame=frame: x.jacobian(x.neutral(), frame), "a frame must be a name of a link or joint")
        for frame in (3, b"panda_hand", ["panda_hand", 3], iter(["panda_hand"]))
    ),
    (lambda x: x.placement(Z(8), {HAND}), "a list of frames must have an order, and a set has none"),  # type: ignore[arg-type]
    (lambda x: x.export("numpy", HAND, {"jacobian"}), "quantities must have an order"),  # type: ignore[arg-type]
    (lambda x: x.placement(Z(8), HAND, base={}), "base must be a BaseMotion or None: found dict"),  # type: ignore[arg-type]
]


@pytest.mark.parametrize(("compute", "message"), REFUSED)
def test_a_wrong_argument_is_refused_with_what_is_wrong(
    panda: Robot, compute: Callable[[Robot], object], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        compute(panda)


def test_a_frame_that_does_not_exist_offers_the_nearest(panda: Robot) -> None:
    with pytest.raises(UnknownNameError, match="unknown frame 'hand'; did you mean panda_hand") as caught:
        panda.jacobian(panda.neutral(), "hand")
    assert caught.value.nearest[0] == HAND


def test_a_reference_is_a_member_or_its_name_in_upper_or_lower_case(panda: Robot) -> None:
    q, v = panda.sample(2, 1)
    expected = panda.velocity(q, v, "panda_hand", Reference.LOCAL)
    for name in ("local", "LOCAL", "Local"):
        assert (panda.velocity(q, v, "panda_hand", name) == expected).all()
    for wrong in ("global", 0, None, True):
        with pytest.raises(UnknownNameError, match="unknown reference"):
            panda.velocity(q, v, "panda_hand", wrong)  # type: ignore[arg-type]


def test_a_quaternion_must_have_norm_one_within_a_millionth_and_is_normalised() -> None:
    robot = urdfkin.load("ur5", root_joint="floating")
    q = robot.sample(1, 1)[0]
    exact = robot.placement(q, "tool0")
    q[3:7] *= 1.0 + 5e-7
    assert np.abs(robot.placement(q, "tool0") - exact).max() < 1e-14
    for factor in (0.0, 1.0 + 1e-5, -2.0):
        wrong = q.copy()
        wrong[3:7] *= factor
        with pytest.raises(InputError, match="the quaternion of joint root_joint must be a unit quaternion"):
            robot.placement(wrong, "tool0")


def test_an_invalid_base_is_refused() -> None:
    reflection = np.diag([1.0, 1.0, -1.0, 1.0])
    for words, message in (
        ({"placement": 2.0 * np.eye(4)}, "last row"),
        ({"placement": reflection}, "rotation"),
        ({"placement": np.eye(3)}, r"\(\.\.\., 4, 4\)"),
        ({"velocity": [1.0, 2.0]}, r"\(\.\.\., 6\)"),
        ({"velocity": "fast"}, "real numbers"),
        ({"acceleration": [0, 0, 0, 0, 0, np.nan]}, "finite"),
        ({"velocity": np.zeros((2, 6)), "acceleration": np.zeros((3, 6))}, "do not broadcast"),
    ):
        with pytest.raises(InputError, match=message):
            BaseMotion(**words)


def test_a_base_is_read_only_and_survives_pickling() -> None:
    base = BaseMotion(velocity=np.arange(6.0))
    for motion in (base, pickle.loads(pickle.dumps(base))):
        assert (motion.velocity == np.arange(6.0)).all()
        with pytest.raises(ValueError, match="read-only"):
            motion.velocity[0] = 1.0


def test_errors_survive_pickling_unchanged() -> None:
    ur5 = urdfkin.load("ur5")
    attempts: Any = (urdfkin.load, "pnda"), (urdfkin.load, "/nowhere/x.urdf"), (urdfkin.load, "<robot/>")
    for attempt, wrong in (*attempts, (ur5.placement, np.zeros(5))):
        with pytest.raises(urdfkin.UrdfkinError) as caught:
            attempt(wrong)
        error, copy = caught.value, pickle.loads(pickle.dumps(caught.value))
        assert type(copy) is type(error)
        assert str(copy) == str(error)
        assert copy.__dict__.keys() == error.__dict__.keys()


def test_sources_of_every_kind_give_the_same_robot(panda: Robot, tmp_path: Path) -> None:
    path = tmp_path / "panda.urdf"
    path.write_text(panda.urdf, encoding="utf-8")
    q, expected = panda.sample(2, 1), None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", urdfkin.UrdfWarning)
        for source in (
            path, str(path), panda.urdf, panda.urdf.encode(), io.StringIO(panda.urdf),
            io.BytesIO(panda.urdf.encode()), panda.urdf.encode("utf-8-sig"),
            "\n  " + panda.urdf.partition("?>")[2],
        ):  # fmt: skip
            result = urdfkin.load(source).jacobian(q, "panda_hand")
            expected = result if expected is None else expected
            assert (result == expected).all()
    with pytest.raises(InputError, match="found int"):
        urdfkin.load(3)  # type: ignore[arg-type]


def test_a_robot_is_used_as_it_is_and_another_source_is_loaded(panda: Robot) -> None:
    assert as_robot(panda) is panda
    loaded = as_robot("panda")
    assert (loaded.name, loaded.source, loaded.urdf) == (panda.name, panda.source, panda.urdf)


def test_a_sample_is_within_limits_and_reproducible(panda: Robot) -> None:
    q = panda.sample(500, 4)
    assert panda.limit_violations(q) == []
    assert (q == panda.sample(500, 4)).all()
    assert (q != panda.sample(500, 5)).all()
    assert panda.limit_violations(panda.neutral()) == ["joint panda_joint4: 0 is outside [-3.0718, -0.0698]"]
    with pytest.raises(InputError, match="must be at least 0"):
        panda.sample(-1)


@pytest.mark.slow
def test_the_oracle_refuses_models_that_would_crash_the_process() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", urdfkin.UrdfWarning)
        robot = urdfkin.load(snake(4000, fixed=True))
        assert robot.placement([0.1], robot.tip_frame).shape == (4, 4)
        assert robot.certificate().verified
        robot = urdfkin.load(snake(330, fixed=False))
    with pytest.warns(urdfkin.NotVerifiedWarning, match="memory grows with nv"):
        robot.placement(robot.neutral(), robot.tip_frame)


def snake(links: int, *, fixed: bool) -> str:
    kinds = ["continuous"] + ["fixed" if fixed else "continuous"] * (links - 1)
    joints = (joint(f"j{i}", k, f"l{i}", f"l{i + 1}", 'xyz="0.01 0 0"') for i, k in enumerate(kinds))
    return urdfs.robot(*joints, name="snake")


def test_the_oracle_reads_only_names_and_layout_from_the_tree(panda: Robot) -> None:
    # The oracle's results do not depend on the poses and axes in the tree.
    other = urdfkin.load("panda")
    for each in other.tree.joints:
        object.__setattr__(each, "T_parent_joint", np.eye(4))
        object.__setattr__(each, "axis", np.array([1.0, 0.0, 0.0]))
    x = QueryBatch(["panda_hand", "panda_rightfinger"], (panda.sample(3, 2),))
    one, two = (PinocchioOracle(panda.urdf, robot.tree).placements(x) for robot in (panda, other))
    assert (one == two).all()


@pytest.mark.parametrize("name", sorted({name for name in vars(Robot) if name[0] != "_"} - _INTERNAL_NAMES))
def test_the_help_of_a_method_describes_each_argument_in_the_order_of_its_signature(name: str) -> None:
    text, method = inspect.getdoc(vars(Robot)[name]) or "", vars(Robot)[name]
    section = text.partition("Args:\n")[2].partition("\n\n")[0]
    arguments = list(inspect.signature(method).parameters)[1:] if inspect.isfunction(method) else []
    if name not in {"limit_violations", "with_convention"}:  # their first lines describe the arguments
        assert re.findall(r"^    (\w+): [^ ]", section, re.MULTILINE) == arguments


@pytest.mark.parametrize("row", QUANTITIES.values(), ids=lambda row: row.name)
def test_the_help_of_a_quantity_has_its_equations_and_what_its_method_raises(row: Quantity) -> None:
    if (method := getattr(Robot, row.method, None)) is None or row.method == "screws":
        return
    text = inspect.getdoc(method) or ""
    assert all(number in text for number in row.equations)
    raised = text.partition("Raises:\n")[2].partition("\n\n")[0]
    for error in ("InputError", "UnknownNameError", "VerificationError"):
        assert f"    {error}: " in raised
    assert text.index("Args:") < text.index("Returns:") < text.index("Raises:") < text.index(">>> ")
