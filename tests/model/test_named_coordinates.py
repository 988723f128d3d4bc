"""q, v and a as text, mappings and tables: each notation gives the same numbers or an error."""

import contextlib
import math
import shlex
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import urdfkin
from tests import urdfs
from tests.cli.running import good
from tests.robots.odd_urdfs import urdf_of
from tests.urdfs import joint, limit, mimic
from urdfkin.errors import InputError, UnknownNameError, UrdfkinError
from urdfkin.errors.numbers import parse_quantity, radians_from_degrees
from urdfkin.model.configuration import coordinate_layout
from urdfkin.model.configuration_like import CoordinateLayout
from urdfkin.robot import Robot
from urdfkin.urdf.catalogue import catalogue

#: The limits of echo narrow those of elbow, which a test relies on.
pytestmark = pytest.mark.filterwarnings("ignore:.*URDF527")

ARM = urdfs.robot(
    joint("lift", "prismatic", "a", "b", more=limit(0, 0.5)),
    joint("shoulder", "revolute", "b", "c", axis="0 1 0", more=limit(-3.14, 3.14)),
    joint("elbow", "revolute", "c", "d", axis="0 1 0", more=limit(0.5, 1.5)),
    joint("echo", "revolute", "d", "e", axis="0 1 0", more=mimic("elbow") + limit(-1, 1.25)),
    name="arm",
)
Q = [0.005, math.pi / 6, math.pi / 2]


@pytest.fixture(scope="module")
def arm() -> Robot:
    return urdfkin.load(ARM, verify=False)


def q_of(robot: Robot, text: Any) -> list[float]:
    return coordinate_layout(robot.tree, "q").parse(text).tolist()  # type: ignore[no-any-return]


@pytest.mark.parametrize(
    "text",
    [
        "0.005,30deg,pi/2", "0.005 0.5235987755982988 90°", "[5mm, 30 deg, 90 degrees]", "(5 mm 30 deg π/2)",
        "lift=5mm, shoulder=30deg, elbow=pi/2", "elbow = pi / 2 lift=0.005 shoulder=30 deg",
        "neutral, elbow=90deg, shoulder=pi/6, lift=.5e-2", " ready,lift=5mm,shoulder=30deg,elbow=0.5*pi,",
        {"lift": 0.005, "shoulder": "30deg", "elbow": np.pi / 2},
    ],
    ids=str,
)  # fmt: skip
def test_each_notation_gives_the_same_bits(text: Any, arm: Robot) -> None:
    assert q_of(arm, text) == Q
    np.testing.assert_array_equal(arm.jacobian(text, "e"), arm.jacobian(Q, "e"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("0,0", "q: 3 numbers are expected (lift, shoulder, elbow): found 2, none for elbow"),
        ("0,0,0,0", "q has that length: robot.from_pinocchio(q, mimic=False) converts it to urdfkin's"),
        ("0,0,0,0", "load with mimic=False"),
        ("shoulder=1,lift=0", "q: no value for elbow; give a value for each joint, or begin with"),
        ("elbo=1,shoulder=1,lift=0", "unknown coordinate 'elbo'; did you mean elbow?"),
        ("echo=1,elbow=1", "'echo' is not a coordinate; this joint mimics elbow: give the value of elbow"),
        ("elbow=1,elbow=2,shoulder=1,lift=0", "found 'elbow' twice"),
        ("0.1,shoulder=1,elbow=1", "q: unknown pose '0.1'"),
        ("neutral,0,0", "q, lift: not a finite number: found 'neutral'"),
        ("0,0,5mm", "q, elbow: wrong unit: found '5mm'; use rad or deg"),
        ("pi,0,0", "q, lift: wrong unit: found 'pi'; use m or mm"),
        ("0,0,1 deg/s", "q, elbow: wrong unit"),
        ("0,0,1-2", "q, elbow: not a finite number: found '1-2'"),
        ("0,0,1/0", "q, elbow: not a finite number"),
        ("0,0,30dge", "q, elbow: not a finite number: found '30dge'; write 0.5, 30deg, pi/2 or 5mm"),
        ("rady", "q: unknown pose 'rady'; did you mean ready"),
        ({}, "q: no value for lift, shoulder, elbow"),
        ({"lift": [0.0, 1.0], "shoulder": [0.0] * 3, "elbow": 0}, "q: the batches have different shapes"),
        ({1: 0.0}, "q: the name of a coordinate must be text: found 1"),
        ({"lift": None, "shoulder": 0, "elbow": 0}, "q, lift must be real numbers: found None"),
    ],
)  # fmt: skip
def test_an_invalid_value_is_refused_with_place_and_remedy(text: Any, message: str, arm: Robot) -> None:
    with pytest.raises(UrdfkinError) as error:
        arm.placement(text, "e")
    assert message in str(error.value)


def test_a_mapping_may_hold_batches_which_broadcast(arm: Robot) -> None:
    bend = np.linspace(0.5, 1.5, 7)
    q = np.stack([np.full(7, 0.1), np.zeros(7), bend], axis=-1)
    found = arm.placement({"elbow": bend, "lift": 0.1, "shoulder": "0"}, "e")
    np.testing.assert_array_equal(found, arm.placement(q, "e"))


def test_units_of_rates_are_accepted_with_and_without_seconds(arm: Robot) -> None:
    v, a = [0.0, math.pi / 6, 0.1], [0.0, 0.0, math.pi]
    for rate, second in (("30deg/s", "180 deg/s^2"), ("30deg", "pi rad/s²")):
        written = f"neutral,shoulder={rate},elbow=0.1", f"neutral,elbow={second}"
        found = arm.acceleration("ready", *written, "e")
        np.testing.assert_array_equal(found, arm.acceleration("ready", v, a, "e"))
    with pytest.raises(InputError, match="v, elbow: wrong unit: found '1 rad/s"):
        arm.velocity("ready", "neutral,elbow=1 rad/s^2", "e")


def test_values_that_look_like_degrees_get_a_hint(arm: Robot) -> None:
    def of_shoulder(value: float) -> str:
        return next((line for line in arm.limit_violations([0.0, value, 1.0]) if "shoulder" in line), "")

    assert of_shoulder(30.0) == "joint shoulder: 30 is outside [-3.14, 3.14]; degrees? write 30deg"
    assert of_shoulder(-90.0).endswith("degrees? write -90deg")
    assert of_shoulder(4.0) == "joint shoulder: 4 is outside [-3.14, 3.14]"
    assert "degrees" not in of_shoulder(200.0), "they would be outside, too"
    assert "degrees" not in of_shoulder(math.radians(400.0)), "nobody types that"
    assert "degrees" not in " ".join(arm.limit_violations([30.0, 0.0, 1.0])), "metres"


@pytest.mark.parametrize(
    ("lower", "upper", "largest"),
    [(12, 15, 15), (-15, -12, 15), (10, 11, 11), (12, 1e6, 22), (-1e6, 1e6, 10)],
)
def test_samples_and_ready_are_within_limits_far_from_zero(
    lower: float, upper: float, largest: float
) -> None:
    text = urdfs.robot(joint("slide", "prismatic", "a", "b", more=limit(lower, upper)))
    slide = urdfkin.load(text, verify=False)
    q = np.vstack([slide.sample(1000), slide.poses["ready"]])
    assert slide.limit_violations(q) == []
    assert np.ptp(q[:-1]) > 0.0
    assert 0.99 * largest < np.abs(q).max() <= largest


def test_ready_is_within_the_limits_of_mimic_joints(arm: Robot) -> None:
    assert arm.limit_violations("neutral") != []
    assert arm.limit_violations("ready") == []
    assert arm.poses["ready"].tolist() == [0.0, 0.0, pytest.approx((0.5 + 1.25) / 2)]


def test_several_coordinates_of_a_joint_are_given_by_name_or_together() -> None:
    robot = urdfkin.load(ARM, root_joint="floating", verify=False)
    place = [0.1, 0.2, 0.3, 0.0, 0.0, 1.0, 0.0]
    q = robot.neutral()
    q[:7], q[-1] = place, 1.0
    expected = robot.placement(q, "e")
    by_name = "neutral,root_joint.x=100mm,root_joint.y=.2,root_joint.z=.3,root_joint.qz=1,root_joint.qw=0"
    np.testing.assert_array_equal(robot.placement(by_name + ",elbow=1", "e"), expected)
    together: dict[str, Any] = {"root_joint": place, "elbow": 1.0, "shoulder": 0.0, "lift": 0.0}
    np.testing.assert_array_equal(robot.placement(together, "e"), expected)
    with pytest.raises(InputError, match=r"root_joint: 7 numbers are expected \(root_joint.x, .*found 3"):
        robot.placement({**together, "root_joint": place[:3]}, "e")
    for mapping in ({**together, "root_joint.x": 0.5}, {"root_joint.x": 0.5, **together}):
        with pytest.raises(InputError, match=r"a number is given twice: found root_joint\.x"):
            robot.placement(mapping, "e")


def test_the_error_for_a_q_of_pinocchios_length_names_the_conversion() -> None:
    with pytest.warns(urdfkin.UrdfWarning, match="URDF"):
        robot = urdfkin.load(ARM.replace('"revolute"', '"continuous"'), verify=False)
    for length, word in ((5, "mimic=True"), (7, "mimic=False")):
        with pytest.raises(InputError, match=rf"robot.from_pinocchio\(q, {word}\)"):
            robot.placement(np.zeros(length), "e")
    for call in (robot.velocity, robot.jacobian_rate):
        with pytest.raises(InputError, match="Pinocchio's v has that length: leave out the mimic joints"):
            call(robot.neutral(), np.zeros(4), "e")
    words = r"use mimic=True for a model of buildModelFromUrdf\(..., mimic=True\)"
    with pytest.raises(InputError, match=words):
        robot.from_pinocchio(np.zeros(5))


def test_prepared_frames_and_dh_tables_accept_text(arm: Robot) -> None:
    text = "lift=5mm, shoulder=30deg, elbow=pi/2"
    fast = arm.prepare("e")
    for _ in range(2):  # before a kernel was made, and after
        np.testing.assert_array_equal(fast.jacobian(text), arm.jacobian(Q, "e"))
        fast.jacobian(np.array(Q))
    table = arm.dh("e", verify=False)
    np.testing.assert_array_equal(table.placement(text), table.placement(Q))
    with pytest.raises(InputError, match="no value for lift, shoulder"):
        table.placement({"elbow": 1.0})
    with pytest.raises(InputError, match="lift: wrong unit"):
        table.placement("lift=5deg, shoulder=0, elbow=0")


def test_a_robot_without_moving_joints_accepts_empty_input() -> None:
    robot = urdfkin.load(urdf_of("fixed_only"), verify=False)
    nothings: list[Any] = ["", "[]", "neutral", "ready", {}]
    for nothing in nothings:
        assert q_of(robot, nothing) == []
    with pytest.raises(InputError, match="none: no joint moves"):
        q_of(robot, "0")


@given(st.floats(-1e6, 1e6), st.sampled_from(["", "rad", " deg", "°", "m", " mm"]))
@settings(max_examples=200)
def test_a_printed_number_is_read_back_in_its_unit(value: float, unit: str) -> None:
    found = parse_quantity(f"{value!r}{unit}")
    assert found is not None
    scaled = {"deg": radians_from_degrees(value), "°": radians_from_degrees(value), "mm": value / 1000.0}.get(
        unit.strip(), value
    )
    assert found.value == scaled


@pytest.mark.slow
@given(st.text(max_size=30) | st.from_regex(r"[0-9.eEpi*/+ deg°πms^-]{0,30}", fullmatch=True))
@settings(max_examples=400)
def test_any_text_gives_finite_numbers_or_a_urdfkin_error(text: str) -> None:
    found = parse_quantity(text)
    assert found is None or math.isfinite(found.value)
    robot = urdfkin.load("one_link", verify=False)
    with contextlib.suppress(UrdfkinError):
        assert np.isfinite(coordinate_layout(robot.tree, "q").parse(text)).all()


def test_an_invalid_text_of_any_length_is_refused_without_delay(arm: Robot) -> None:
    for text in (" " * 200_000 + "1", *(each * 50_000 for each in ("1 ", "pi*", "==", "xx", "99"))):
        with pytest.raises((InputError, UnknownNameError)):
            q_of(arm, text)


class Columns:
    """A batch whose last axis has labels, as a data frame has without `keys`."""

    def __init__(self, data: Any, columns: Any) -> None:
        self._data, self.columns = np.array(data), list(columns)

    def __getitem__(self, label: Any) -> Any:
        return self._data[..., self.columns.index(label)]

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Any:
        return np.array(self._data, dtype=dtype)


class Labelled(Columns):
    """A series or a data frame of pandas."""

    def keys(self) -> list[Any]:
        return self.columns

    def __len__(self) -> int:
        return len(self._data)


SHUFFLED = ["elbow", "lift", "shoulder"]


def test_a_series_is_read_by_its_labels_in_any_order(arm: Robot) -> None:
    named = Labelled([1.25, 0.1, -0.5], SHUFFLED)
    expected = arm.jacobian([0.1, -0.5, 1.25], "e")
    np.testing.assert_array_equal(arm.jacobian(named, "e"), expected)
    np.testing.assert_array_equal(arm.prepare("e").jacobian(named), expected)
    path = arm.chain("e", "a")
    np.testing.assert_array_equal(path.placement(named), path.placement([0.1, -0.5, 1.25]))
    with pytest.raises(InputError, match="no value for elbow"):
        arm.jacobian(Labelled([0.1, -0.5], ["lift", "shoulder"]), "e")
    with pytest.raises(UnknownNameError, match="unknown coordinate 'elbo'; did you mean elbow"):
        arm.jacobian(Labelled([0.1, -0.5, 1.0], ["lift", "shoulder", "elbo"]), "e")


@pytest.mark.parametrize("kind", [Labelled, Columns])
def test_a_data_frame_is_a_batch_with_named_columns(kind: Any, arm: Robot) -> None:
    q = arm.sample(5, 3)
    found = arm.placement(kind(q[:, [2, 0, 1]], SHUFFLED), "e")
    np.testing.assert_array_equal(found, arm.placement(q, "e"))


def test_labels_0_1_2_mean_the_order_of_the_coordinates(arm: Robot) -> None:
    expected = arm.placement([0.1, -0.5, 1.25], "e")
    np.testing.assert_array_equal(arm.placement(Labelled([0.1, -0.5, 1.25], range(3)), "e"), expected)
    np.testing.assert_array_equal(arm.placement(Labelled([[0.1, -0.5, 1.25]], range(3)), "e")[0], expected)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (Labelled([1.25, 0.1, -0.5], [2, 0, 1]), "the name of a coordinate must be text: found 2"),
        (Labelled([0.1, -0.5, 1.25], ["lift", "shoulder", "lift"]), "q: a label occurs twice: found 'lift'"),
        ([Labelled([1.25, 0.1, -0.5], SHUFFLED)] * 2, "q: a list of labelled objects"),
    ],
    ids=["numbers in another order", "a label twice", "a list of them"],
)
def test_invalid_labels_are_refused(given: Any, message: str, arm: Robot) -> None:
    with pytest.raises(InputError) as caught:
        arm.placement(given, "e")
    assert message in str(caught.value)


#: A planar joint `a`, whose first coordinate would be called as the joint `a.x` is.
ALIKE = urdfs.robot(
    joint("a", "planar", "o", "p"),
    joint("a.x", "revolute", "p", "s", 'xyz="1 0 0"', more=limit()),
    name="alike",
)


def test_coordinate_names_are_unique() -> None:
    robot = urdfkin.load(ALIKE)
    assert robot.coordinate_names == ("a:x", "a:y", "a:angle", "a.x")
    assert robot.velocity_names == ("a.vx", "a.vy", "a.wz", "a.x")
    moved = robot.placement("neutral, a.x=0.5", "s")
    np.testing.assert_array_equal(moved, robot.placement([0.0, 0.0, 0.0, 0.5], "s"))
    all_named = {"a:x": 0.1, "a:y": 0.2, "a:angle": 0.3, "a.x": 0.4}
    np.testing.assert_array_equal(robot.placement(all_named, "s"), robot.placement([0.1, 0.2, 0.3, 0.4], "s"))
    together: dict[str, Any] = {"a": [0.1, 0.2, 0.3], "a.x": 0.4}
    np.testing.assert_array_equal(robot.placement(together, "s"), robot.placement([0.1, 0.2, 0.3, 0.4], "s"))
    with pytest.raises(UnknownNameError, match=r"unknown coordinate 'a\.y'; did you mean .*a:y"):
        robot.placement({"a.x": 0.5, "a.y": 1.0, "a.angle": 0.0}, "s")


def test_a_third_separator_avoids_a_third_equal_name() -> None:
    text = ALIKE.replace("</robot>", f'<link name="t"/>{joint("a:y", "fixed", "s", "t", axis="")}</robot>')
    assert urdfkin.load(text).coordinate_names == ("a::x", "a::y", "a::angle", "a.x")


def test_equal_names_never_set_a_coordinate_to_zero() -> None:
    twice = CoordinateLayout("q", ("a", "a"), ("rad", "rad"))
    with pytest.raises(InputError, match="no value for a"):
        twice.parse({"a": 0.5})


def swapped(*asked: Any, right: Any = CoordinateLayout._combine_values) -> Any:
    found = right(*asked)
    found[..., [0, 1]] = found[..., [1, 0]]
    return found


NAMED: dict[str, Any] = {
    "a mapping": {"lift": 0.1, "shoulder": "30deg", "elbow": 1.0},
    "a mapping with a batch": {"elbow": [1.0, 1.1], "lift": 0.1, "shoulder": [[0.2], [0.3]]},
    "a text": "lift=100mm, shoulder = 30 deg, elbow=pi/3",
    "a text with blanks": "elbow=pi / 3 lift=.1 shoulder=30 deg",
    "a text with brackets": "[shoulder=30deg,lift=5mm,elbow=1]",
    "a pose and a name": "ready, lift=.3",
    "a series": Labelled([1.0, 0.1, -0.5], SHUFFLED),
    "a data frame": Labelled([[1.0, 0.1, -0.5], [1.1, 0.2, -0.6]], SHUFFLED),
}


@pytest.mark.parametrize("given", NAMED)
def test_values_assigned_to_the_wrong_coordinate_name_are_detected(
    given: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = urdfkin.load(ARM)
    robot.placement(NAMED[given], "e")
    assert robot.certificate().verified
    monkeypatch.setattr(CoordinateLayout, "_combine_values", swapped)
    with pytest.raises(urdfkin.VerificationError):
        robot.placement(NAMED[given], "e")


@pytest.mark.parametrize("root_joint", ["planar", "floating"])
def test_an_exchanged_number_of_a_joint_with_several_disagrees(
    root_joint: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = urdfkin.load(ARM, root_joint=root_joint)
    numbers = [0.1, 0.2, 0.3, *([0.0, 0.0, 0.6, 0.8] * (root_joint != "planar"))]
    mapping: Any = {"lift": 0.0, "shoulder": 0.1, "elbow": 1.0, "root_joint": numbers}
    written = "neutral, root_joint.x=0.1, root_joint.y=20mm", "neutral,root_joint.y=.5", mapping
    for q in written:
        robot.placement(q, "e")
    v = "neutral, root_joint.vx=0.1, root_joint.wz=3deg/s"
    robot.velocity("neutral", v, "e")
    assert robot.certificate().verified
    monkeypatch.setattr(CoordinateLayout, "_combine_values", swapped)
    for q in written:
        with pytest.raises(urdfkin.VerificationError):
            robot.placement(q, "e")
    with pytest.raises(urdfkin.VerificationError):
        robot.velocity(robot.neutral(), v, "e")


def test_names_with_special_characters_are_found_by_both() -> None:
    hard = {"lift": "a=b", "shoulder": "a", "elbow": "b (left).x"}
    text = ARM
    for name, other in hard.items():
        text = text.replace(f'"{name}"', f'"{other}"')
    robot = urdfkin.load(text)
    assert set(robot.coordinate_names) == set(hard.values())
    for written in ("a=b=5mm, a=1deg, b (left).x=1.0", "neutral, a=1", "neutral,b (left).x=pi/4,a=b=.1"):
        robot.placement(written, "e")
    assert robot.certificate().verified
    assert urdfkin.load(ALIKE).placement({"a:x": 0.1, "a:y": 0.2, "a:angle": 0.3, "a.x": 0.4}, "s").any()


@pytest.mark.parametrize("name", ["upper arm", "arm,1", "a=b", "turn 1 = x"])
def test_the_name_of_a_single_locked_joint_may_contain_blanks_commas_and_equals_signs(name: str) -> None:
    path = catalogue()["planar_two_link"].path
    text = path.read_text("utf-8").replace('"joint_1"', f'"{name}"')
    locked = urdfkin.load(text, lock=f"{name}=0.5")
    assert locked.origin.lock == ((name, 0.5),)
    q = urdfkin.load(text, joints=[name])
    assert q.placement(f" {name} = 30deg ", "tip").tolist() == q.placement([math.pi / 6], "tip").tolist()
    line = shlex.split(locked.origin.command_line_options)
    assert good("info", "-", *line, stdin=text).text.count("locked at 0.5") == 1
