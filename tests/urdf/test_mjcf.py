"""The conversion of MJCF files to kinematic trees, compared with MuJoCo."""

import io
import json
import math
import time
import warnings
from collections.abc import Callable, Mapping
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import urdfkin
from scripts.survey_mjcf import describe_result
from tests.cli.running import good
from tests.cli.running import urdfkin as command
from tests.reading import present
from tests.urdf.lint.cases.arm import arm
from tests.urdfs import loaded
from urdfkin.errors import InputError, OracleError
from urdfkin.model.tree import FloatArray, pose
from urdfkin.system.processes import run_python
from urdfkin.urdf import mjcf
from urdfkin.urdf.mjcf import Mjcf, is_mjcf
from urdfkin.urdf.sources import Source
from urdfkin.verify import mjcf_check, mjcf_process

pytestmark = pytest.mark.slow

TWO = """
<mujoco model="two">
  <compiler angle="degree"/>
  <default><default class="x"><joint axis="0 1 0" range="-90 90"/></default></default>
  <asset><mesh name="nope" file="nope.stl"/></asset>
  <worldbody>
    <body name="base" pos="0 0 1" euler="10 20 30">
      <freejoint name="root"/>
      <geom type="mesh" mesh="nope"/>
      <site name="imu" pos="0.1 0 0" quat="1 1 0 0"/>
      <body name="shoulder" pos="0.1 0.2 0.3" quat="1 2 3 4">
        <joint name="yaw" axis="0 0 1" pos="0.01 0.02 0.03" range="-100 100"/>
        <joint name="pitch" class="x" pos="0 0 0.05" ref="30"/>
        <joint name="out" type="slide" axis="1 1 0" ref="0.2"/>
        <body name="tip" pos="0.5 0 0">
          <joint name="f" axis="1 0 0" pos="0 0.1 0"/><site name="tool" pos="0 0 0.2"/>
        </body>
        <body pos="0 0.5 0"><joint axis="1 0 0" name="g"/></body>
      </body>
    </body>
  </worldbody>
  <equality>
    <joint name="couple" joint1="f" joint2="pitch" polycoef="0.1 2 0 0 0"/>
    <joint name="curve" joint1="g" joint2="f" polycoef="0 1 0.3 0 0"/>
    <weld name="glue" body1="tip" body2="base"/>
  </equality>
  <tendon><fixed name="t"><joint joint="f" coef="1"/></fixed></tendon>
  <actuator><motor joint="f"/><position tendon="t"/></actuator>
</mujoco>
"""
Write = Callable[..., Path]


@pytest.fixture
def patch(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """Read MJCF in this process, so that a test can replace functions."""

    def ask(request: Mapping[str, Any], timeout: float) -> tuple[list[dict[str, Any]], str]:
        return json.loads(json.dumps(list(mjcf_process.compute_answers(request)))), "ended"

    monkeypatch.setattr(mjcf_check, "_request_answers", ask)
    return monkeypatch


MASS = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'


def one_joint(joint: str) -> str:
    return (
        f'<mujoco><compiler angle="radian"/><worldbody><body name="b" pos="1 0 0">{MASS}{joint}'
        '<site name="s" pos="0 0 0.5"/></body></worldbody></mujoco>'
    )


def test_the_limits_of_a_hinge_determine_its_kind() -> None:
    robot = loaded(one_joint('<joint name="a" range="-1 2"/><joint name="b" axis="0 1 0"/>'))
    a, b = (robot.tree.joints[i] for i in (0, 1))
    limit = present(a.limit)
    assert (a.kind.value, limit.lower, limit.upper) == ("revolute", -1.0, 2.0)
    assert (b.kind.value, b.limit) == ("continuous", None)


@pytest.mark.parametrize("more", ["", 'range="-1 2"', 'type="slide"'])
@pytest.mark.parametrize(("bounds", "effort"), [("-5 10", 10.0), ("-10 5", 10.0), ("-10 -5", 10.0)])
def test_the_effort_of_any_joint_is_the_largest_absolute_value_of_actuatorfrcrange(
    bounds: str, effort: float, more: str
) -> None:
    robot = loaded(one_joint(f'<joint name="a" {more} actuatorfrcrange="{bounds}"/>'))
    assert present(robot.tree.joints[0].limit).effort == effort
    assert robot.verifier.known_refusal is None


def of_mujoco(text: str, qpos: FloatArray, body: str) -> FloatArray:
    """Return MuJoCo's placement of a body in the unchanged file."""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_kinematics(model, data)
    T: FloatArray = np.eye(4)
    T[:3, :3], T[:3, 3] = data.body(body).xmat.reshape(3, 3), data.body(body).xpos
    return T


def random_mjcf(rng: np.random.Generator) -> tuple[str, list[str]]:
    """Write a tree of bodies with up to three joints each, with anchors and reference values."""

    def vector(size: float = 1.0, n: int = 3) -> str:
        return " ".join(repr(float(x)) for x in size * rng.normal(size=n))

    names, open_bodies, text = [], 0, ""
    for i in range(int(rng.integers(2, 7))):
        while open_bodies and rng.random() < 0.3:
            text += "</body>"
            open_bodies -= 1
        turned = f'quat="{vector(n=4)}"' if rng.random() < 0.5 else f'euler="{vector()}"'
        text += f'<body name="b{i}" pos="{vector()}" {turned}>{MASS}'
        open_bodies += 1
        for j in range(int(rng.integers(0, 4))):
            kind = rng.choice(["hinge", "slide"])
            anchor = f'pos="{vector()}"' if rng.random() < 0.7 else ""
            names.append(f"j{i}_{j}")
            text += f'<joint name="{names[-1]}" type="{kind}" axis="{vector()}" {anchor}'
            text += f' ref="{rng.normal()!r}" limited="true" range="-3 3"/>'
    compiler = f'<compiler angle="radian" eulerseq="{rng.choice(["xyz", "ZYX", "zxz"])}"/>'
    return f"<mujoco>{compiler}<worldbody>{text}{'</body>' * open_bodies}</worldbody></mujoco>", names


@pytest.mark.parametrize("seed", range(25))
def test_the_placements_of_any_tree_of_hinges_and_slides_are_those_of_mujoco(seed: int) -> None:
    rng = np.random.default_rng(seed)
    text, names = random_mjcf(rng)
    robot = loaded(text, verify=False)
    assert sorted(robot.coordinate_names) == sorted(names)
    value = dict(zip(names, rng.uniform(-3.0, 3.0, len(names)), strict=True))
    q = [value[name] for name in robot.coordinate_names]
    for link in robot.link_names:
        if link.startswith("b"):
            theirs = of_mujoco(text, np.array(list(value.values())), link)
            assert robot.placement(q, f"link:{link}") == pytest.approx(theirs, abs=1e-12)


def test_a_file_with_many_features_is_verified_and_its_findings_are_warnings(write: Write) -> None:
    path = write(TWO, "two.xml")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        robot = urdfkin.load(path)
    assert len(caught) == 3
    assert all("two.xml" in str(w.message) and "MJCF101" in str(w.message) for w in caught)
    assert {w.filename for w in caught} == {__file__}
    assert (robot.nq, robot.nv) == (11, 10)
    assert {"world", "base", "imu", "tool"} <= set(robot.link_names)
    robot.placement(robot.sample(3), robot.link_frames)
    certificate = robot.certificate()
    assert certificate.verified
    assert "MuJoCo" in certificate.source_notes
    assert "Pinocchio's MJCF reader" in str(certificate)
    rule = next(present(joint.mimic) for joint in robot.tree.joints if joint.name == "f")
    assert (rule.mimicked_joint, rule.multiplier) == ("pitch", 2.0)
    assert rule.offset == pytest.approx(0.1 - math.pi / 3)  # f - 0 = 0.1 + 2 (pitch - 30 degrees)
    assert loaded(TWO, mimic=False).nq == robot.nq + 1


@pytest.mark.parametrize(
    "broken",
    [
        ("pose", lambda R=None, p=None: np.eye(4) if R is None else pose(R, p)),
        ("rotation_about", lambda axis, angle: np.eye(3)),
    ],
    ids=["moved by nothing", "turned by nothing"],
)
def test_load_finds_an_error_of_the_reader(broken: tuple[str, object], patch: pytest.MonkeyPatch) -> None:
    patch.setattr(mjcf, *broken)
    with pytest.raises(OracleError, match="differs from the file"):
        loaded(TWO)


@pytest.mark.parametrize(
    ("text", "what"),
    [
        (one_joint('<joint name="j" type="ball"/>'), "joint j: urdfkin does not support ball joints"),
        ("<mujoco><worldbody><body/></mujoco>", "MuJoCo does not accept this MJCF"),
        ("<mujoco><include file='nowhere.xml'/></mujoco>", "MuJoCo does not accept this MJCF"),
    ],
)
def test_a_file_that_cannot_be_read_is_an_error_with_the_reason(text: str, what: str) -> None:
    with pytest.raises(InputError, match=what):
        loaded(text)


@pytest.mark.parametrize(
    ("text", "where"),
    [
        (one_joint('<joint name="a"/>').replace('"1 0 0"', '"inf 0 0"'), "body b"),
        (one_joint('<joint name="a" ref="nan"/>'), "joint a"),
        (one_joint('<joint axis="nan 0 1"/>'), "joint 0"),
        (one_joint('<joint name="a"/>').replace('"0 0 0.5"', '"0 0 nan"'), "site s"),
    ],
)
def test_the_error_about_a_number_that_is_not_finite_names_the_element(text: str, where: str) -> None:
    with pytest.raises(
        InputError, match=rf"<text>: {where}: .* is not finite: found (nan|inf); write finite"
    ):
        loaded(text)


@pytest.mark.parametrize("root", ["robot", "mujoco"])
def test_the_search_for_the_root_element_takes_linear_time(root: str) -> None:
    began = time.process_time()
    assert is_mjcf("<?xml?>" + "<!-- x --> <?y z?> " * 20_000 + f"<{root}/>") is (root == "mujoco")
    assert not is_mjcf("<!--" + "<!-- -- " * 20_000)
    assert time.process_time() - began < 1.0


def test_a_file_with_the_root_element_mujoco_is_mjcf(write: Write) -> None:
    commented = f"<?xml version='1.0'?><!-- robot -->{TWO}"
    texts = {"a.xml": TWO, "b.xml": arm(), "c.mjcf": commented, "d.urdf": TWO}
    a, b, c, d = (write(text, name) for name, text in texts.items())
    assert [is_mjcf(path) for path in (a, b, c, d)] == [True, False, True, False]
    assert loaded(b).nq == 2
    assert not is_mjcf(a.with_name("nothing.xml"))
    with pytest.raises(
        urdfkin.UrdfError, match="this is an MJCF file; `load` and the commands read MJCF files"
    ):
        urdfkin.load(d)


def test_mjcf_is_loaded_from_text_bytes_streams_and_standard_input(monkeypatch: pytest.MonkeyPatch) -> None:
    text = one_joint('<joint name="j" axis="0 0 1" pos="0 2 0"/>')
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(text.encode())))
    data = text.encode()
    sources: list[Source] = [text, data, b"\xef\xbb\xbf" + data, io.StringIO(text), io.BytesIO(data), "-"]
    for source in sources:
        robot = loaded(source)
        assert robot.placement([math.pi], "b")[:3, 3] == pytest.approx([1.0, 4.0, 0.0])
        assert robot.certificate().verified
    with pytest.raises(InputError, match="<bytes>: MuJoCo does not accept this MJCF"):
        loaded(b"<mujoco>\xff</mujoco>")
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(b"<mujoco><wrong/></mujoco>")))
    with pytest.raises(InputError, match="<stdin>: MuJoCo does not accept this MJCF"):
        loaded("-")


def test_all_commands_accept_an_mjcf_file(write: Write) -> None:
    text = one_joint('<joint name="a" range="-1 2"/><joint name="b" axis="0 1 0" pos="1 1 1"/>')
    path = write(text, "arm.xml")
    report = path.with_name("report.json")
    good("info", str(path))
    good("jacobian", str(path), "--q", "random")
    good("dh", str(path))
    good("validate", str(path), "--samples", "2", "--oracle", "mujoco", "--json", str(report))
    robot = json.loads(report.read_text("utf-8"))["robots"][0]
    assert robot["verdict"] == "verified"
    assert robot["model"]["links"][0] == "world"


def test_at_q_zero_a_mimic_joint_has_its_offset_and_a_free_body_is_at_the_origin() -> None:
    read = mjcf.read_mjcf(TWO, "two")
    assert read.tree.links[0] == "world"
    q = np.zeros((1, read.tree.nq))
    q[0, 6] = 1.0
    assert read.qpos(q)[0, read.qpos_index["f"]] == pytest.approx(0.1 - math.pi / 3)
    assert read.placements(q)[0, list(read.frames).index("base"), :3, 3] == pytest.approx([0.0, 0.0, 0.0])


# -- free bodies that MuJoCo aligns ----------------------------------------------------------------------

_ARM = '<body name="arm" pos="0 0 2">{}<geom size="0.3"/></body>'
_BOX = '<geom type="box" size=".1 .2 .3" pos="0.5 0 0" euler="0 0 40"/>'


def free_body(compiler: str = "", joint: str = "", inside: str = _BOX, more: str = "") -> str:
    return (
        f'<mujoco><compiler {compiler}/>{more}<worldbody><body name="drone">'
        f'<freejoint name="free" {joint}/>{inside}<site name="camera" pos="0.6 0 0"/></body>'
        "</worldbody></mujoco>"
    )


FUSED = _BOX + _ARM.format("")


@pytest.mark.parametrize(
    "text",
    [
        free_body(joint='align="true"'), free_body('alignfree="true"'),
        free_body('alignfree="true"', 'align="false"'),
        free_body(joint='align="true"', inside='<inertial pos="1 2 3" mass="1" diaginertia="1 2 3"/>'),
        free_body('alignfree="true" fusestatic="true"'),
        free_body('alignfree="true"', inside=_BOX + _ARM.format('<joint name="j"/>')),
        free_body('alignfree="true"', inside=FUSED), free_body('fusestatic="true"', inside=FUSED),
    ],
)  # fmt: skip
def test_a_free_body_that_mujoco_aligns_has_mujocos_placements_and_velocities(text: str) -> None:
    robot = loaded(text)
    model = mujoco.MjModel.from_xml_string(text)
    data, site, theirs = mujoco.MjData(model), mujoco.mjtObj.mjOBJ_SITE, np.zeros(6)
    data.qpos[:7] = [1.0, 2.0, 3.0, 0.5, 0.5, -0.5, 0.5]
    data.qvel[3:6] = [0.1, -0.2, 1.0]
    mujoco.mj_forward(model, data)
    mujoco.mj_objectVelocity(model, data, site, 0, theirs, 0)
    q, v = np.zeros(robot.nq), np.zeros(robot.nv)
    q[:7] = [1.0, 2.0, 3.0, 0.5, -0.5, 0.5, 0.5]
    v[3:6] = [0.1, -0.2, 1.0]
    T = robot.placement(q, "camera")
    assert T[:3, 3] == pytest.approx(data.site("camera").xpos, abs=1e-14)
    assert T[:3, :3].ravel() == pytest.approx(data.site("camera").xmat, abs=1e-14)
    assert robot.velocity(q, v, "camera") == pytest.approx(np.roll(theirs, 3), abs=1e-13)
    assert "does not compile" not in robot.certificate().source_notes
    np.testing.assert_array_equal(loaded(text, verify=False).placement(q, "camera"), T)


def test_a_body_that_cannot_be_aligned_is_reported_and_the_certificate_states_the_missing_check() -> None:
    mesh = '<asset><mesh name="m" file="nowhere.stl"/></asset>'
    text = free_body('alignfree="true"', inside='<geom type="mesh" mesh="m"/>', more=mesh)
    words = "MJCF101.*'drone': MuJoCo aligns the frame of this free body"
    with pytest.warns(urdfkin.UrdfWarning, match=words):
        robot = urdfkin.load(text)
    robot.placement(robot.neutral(), "camera")
    words = "MuJoCo compiles the file only without shapes and inertias: Error: Error opening"
    assert words in robot.certificate().source_notes


def test_a_fused_static_body_stays_a_link_and_is_refused_if_its_parent_is_aligned() -> None:
    with pytest.raises(InputError, match=r'body drone: .*write fusestatic="false" or align="false"'):
        loaded(free_body('alignfree="true" fusestatic="true"', inside=FUSED))
    robot = loaded(free_body('fusestatic="true"', inside=FUSED))
    assert robot.placement(robot.neutral(), "arm")[:3, 3] == pytest.approx([0.0, 0.0, 2.0])
    assert robot.certificate().verified


# -- mimic rules -----------------------------------------------------------------------------------------


def coupled(*equalities: str, refs: tuple[float, ...] = (0.3, -0.4, 0.5)) -> str:
    """Write three hinges, one after the other, with reference values."""
    open_ = "".join(
        f'<body name="{name}" pos="0.1 0.2 0.3">{MASS}<joint name="{name}" axis="0 {i} 1" ref="{ref}"/>'
        for i, (name, ref) in enumerate(zip("abc", refs, strict=True))
    )
    world = f'<compiler angle="radian"/><worldbody>{open_}{"</body>" * 3}</worldbody>'
    return f"<mujoco>{world}<equality>{''.join(equalities)}</equality></mujoco>"


_CHAIN = (
    '<joint name="second" joint1="c" joint2="b" polycoef="0.2 -3 0 0 0"/>',
    '<joint name="first" joint1="b" joint2="a" polycoef="0.1 2 0 0 0"/>',
)


def test_a_chain_of_equalities_becomes_mimic_rules_that_agree_with_mujoco() -> None:
    robot = loaded(coupled(*_CHAIN))
    assert robot.coordinate_names == ("a",)
    b, c = (present(joint.mimic) for joint in robot.tree.joints if joint.name in "bc")
    # b + 0.4 = 0.1 + 2 (a - 0.3), c - 0.5 = 0.2 - 3 (b + 0.4)
    assert (b.mimicked_joint, b.multiplier, c.mimicked_joint, c.multiplier) == ("a", 2.0, "a", -6.0)
    assert (b.offset, c.offset) == pytest.approx((-0.9, 0.7 - 3.0 * -0.5))
    robot.placement(robot.sample(3), "c")
    certificate = robot.certificate()
    assert certificate.verified
    assert "and 2 mimic rules agree" in certificate.source_notes


def test_an_inactive_equality_is_no_mimic_rule() -> None:
    idle = '<joint name="idle" joint1="b" joint2="a" polycoef="0 1 0 0 0" active="false"/>'
    robot = loaded(coupled(idle))
    assert robot.coordinate_names == ("a", "b", "c")
    assert "mimic rules" not in robot.certificate().source_notes


@pytest.mark.parametrize("flag", ["equality", "constraint"])
def test_a_flag_that_disables_equalities_removes_the_mimic_rules(flag: str) -> None:
    weld = '<weld name="glue" body1="a" body2="b"/>'
    option = f'<mujoco><option><flag {flag}="disable"/></option>'
    text = coupled(*_CHAIN, weld).replace("<mujoco>", option)
    robot = loaded(text)
    assert robot.coordinate_names == ("a", "b", "c")
    assert "mimic rules" not in robot.certificate().source_notes
    findings = [one for one in robot.findings if one.element == "equality"]
    assert {one.name: one.code for one in findings} == dict.fromkeys(("first", "second", "glue"), "MJCF102")


def wrong_offset(right: Callable[..., Any]) -> Callable[..., Any]:
    def rule(self: Any, i: int) -> Any:
        name, found = right(self, i)
        return name, replace(found, offset=found.offset + 1e-12)

    return rule


def wrong_multiplier(right: Callable[..., Any]) -> Callable[..., Any]:
    def resolved(rules: Any, follower: str) -> Any:
        found = right(rules, follower)
        chained = found.mimicked_joint != rules[follower].mimicked_joint
        return replace(found, multiplier=rules[follower].multiplier) if chained else found

    return resolved


@pytest.mark.parametrize(
    ("where", "name", "mistake"),
    [(mjcf._MjcfReader, "_read_rule", wrong_offset), (mjcf, "resolve_rule", wrong_multiplier)],
    ids=["an offset", "the multiplier of a mimic of a mimic"],
)
def test_the_residual_of_mujocos_equality_finds_an_error_of_a_mimic_rule(
    where: Any, name: str, mistake: Any, patch: pytest.MonkeyPatch
) -> None:
    patch.setattr(where, name, mistake(getattr(where, name)))
    with pytest.raises(OracleError, match=r"mimic joint [bc]: .* from the file: found MuJoCo \S+ differs by"):
        loaded(coupled(*_CHAIN))


@pytest.mark.parametrize(
    ("active", "said"),
    [
        ("false", "mimic joint b: .* does not have this constraint"),
        ("true", "equality 0: .* has this constraint"),
    ],
)
def test_an_additional_mimic_rule_and_a_missing_mimic_rule_are_found(
    active: str, said: str, patch: pytest.MonkeyPatch
) -> None:
    # The model is that of one file, and the rules are those of another file.
    rule = '<joint name="x" joint1="b" joint2="a" polycoef="0 1 0 0 0" active="{}"/>'
    other = mjcf.read_mjcf(coupled(rule.format("true" if active == "false" else "false")), "other")

    def mixed(source: str, name: str, *, with_shapes: bool = False) -> Mjcf:
        return replace(other, model=mjcf.read_mjcf(source, name, with_shapes=with_shapes).model)

    patch.setattr(mjcf_process, "read_mjcf", mixed)
    with pytest.raises(OracleError, match=said):
        loaded(coupled(rule.format(active)))


# -- error bounds ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("ref", [0.0, 1e3, -1e6])
@pytest.mark.parametrize("kind", ["hinge", "slide"])
def test_a_large_reference_value_is_no_disagreement(kind: str, ref: float) -> None:
    text = one_joint(f'<joint name="j" type="{kind}" axis="1 2 3" pos="0 2 0" ref="{ref!r}"/>')
    robot = loaded(text)
    q, atol = robot.sample(1)[0], 1e-13 * max(1.0, abs(ref) / 100)
    np.testing.assert_allclose(robot.placement(q, "link:b"), of_mujoco(text, q, "b"), atol=atol)


@pytest.mark.parametrize(
    "joint", ['type="slide" axis="1 0 0" ref="1000000.1"', 'axis="0 0 1" pos="-1000000.1 0 0"']
)
def test_lengths_of_a_million_metres_that_cancel_in_the_tree_are_no_disagreement(joint: str) -> None:
    text = one_joint(f'<joint name="j" {joint}/>').replace('pos="1 0 0"', 'pos="1000000.3 0 0"')
    robot = loaded(text)
    robot.placement(robot.sample(1), "s")
    assert robot.certificate().verified


@pytest.mark.parametrize("ref", [0.0, 1e3])
@pytest.mark.parametrize("number", [(0, 1), (1, 3)], ids=["turned", "moved"])
def test_an_error_of_the_reader_slightly_above_the_rounding_bound_is_found(
    number: tuple[int, int], ref: float, patch: pytest.MonkeyPatch
) -> None:
    right = Mjcf.placements

    def moved(self: Mjcf, q: FloatArray) -> FloatArray:
        T = right(self, q)
        # For a hinge with a reference value, the bound is larger by eps |ref|, here 2.2e-13.
        T[:, list(self.frames).index("s"), *number] += 3e-12 if ref else 1e-12
        return T

    text = one_joint(f'<joint name="j" axis="0 0 1" ref="{ref!r}"/>')
    loaded(text)
    patch.setattr(Mjcf, "placements", moved)
    with pytest.raises(OracleError, match="times the bound of rounding"):
        loaded(text)


# -- limits of time and memory ---------------------------------------------------------------------------


def test_the_compilation_of_a_file_with_endless_replicas_ends_with_an_error() -> None:
    inside = '<geom size=".1"/>'
    for _ in range(9):
        inside = f'<replicate count="1000" offset="1 0 0">{inside}</replicate>'
    began = time.monotonic()
    with pytest.raises(InputError, match="cannot compile this MJCF: found MuJoCo did not finish within 3 s"):
        mjcf_check.read_mjcf(f"<mujoco><worldbody>{inside}</worldbody></mujoco>", timeout=3.0)
    assert time.monotonic() - began < 20.0


@pytest.mark.parametrize(
    "more",
    [
        '<size nuser_body="2000000000"/>',
        '<asset><hfield name="h" nrow="60000" ncol="60000" size="1 1 1 1"/></asset>',
    ],
)
def test_a_file_that_asks_for_too_much_memory_is_refused(more: str) -> None:
    with pytest.raises(InputError, match="Perhaps it takes more than 2 GiB of memory"):
        loaded(free_body(more=more))


def test_the_memory_that_a_file_reserves_for_dynamics_is_not_allocated() -> None:
    robot = loaded(free_body(more='<size njmax="80000" nconmax="40000" nstack="1000000000"/>'))
    assert "without shapes" not in robot.verifier.source_notes


def test_if_a_process_dies_a_file_is_refused_or_read_without_shapes(monkeypatch: pytest.MonkeyPatch) -> None:
    right = run_python

    def first_only(*arguments: Any) -> tuple[bytes, None]:
        return right(*arguments)[0].splitlines(keepends=True)[0], None

    monkeypatch.setattr(mjcf_check, "run_python", first_only)
    robot = loaded(free_body(joint='align="true"'))
    assert "shapes and inertias: MuJoCo did not finish within 60 s" in robot.verifier.source_notes
    assert "MJCF101" in {finding.code for finding in robot.findings}
    monkeypatch.setattr(mjcf_check, "run_python", lambda *arguments: (b'{"urdf": "half', -11))
    words = "<text>: MuJoCo cannot compile this MJCF: found MuJoCo's process ended"
    with pytest.raises(InputError, match=words):
        loaded(free_body())


def test_a_name_that_is_not_utf_8_is_an_error_that_says_so(tmp_path: Path) -> None:
    path = tmp_path / "odd.xml"
    for odd in (b'<mujoco model="\xff">', b'<mujoco><worldbody><body name="\xff"/></worldbody>'):
        path.write_bytes(odd + b"</mujoco>")
        with pytest.raises(InputError, match=r"odd.xml: this MJCF contains a name that is not UTF-8"):
            loaded(path)


def test_the_digest_of_a_robot_is_the_digest_of_its_file(write: Write) -> None:
    path = write(TWO, "two.xml")
    robot = loaded(path)
    digest = sha256(path.read_bytes()).hexdigest()
    assert (robot.sha256, robot.source) == (digest, str(path))
    assert robot.certificate().sha256 == digest == loaded(TWO).sha256
    info = command("info", str(path), "--format", "json").data
    assert (info["sha256"], info["source"]) == (digest, str(path))


PLACES = """<mujoco>
  <!-- <equality><weld name="glue" body1="one" body2="two"/></equality> -->
  <default><equality solref="0.02 1"/><joint damping="1"/></default>
  <worldbody>
    <body name="b"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><joint name="a" axis="0 0 1"/></body>
    <body name="two"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      <joint type="slide" name="b &amp; c"/></body>
  </worldbody>
  <sensor><jointpos name="b &amp; c" joint="a"/></sensor>
  <equality>
    <joint joint1="b &amp; c" joint2="a"/>
    <weld body1="b"
          body2="two"/>
    <weld name="glue" body1="b" body2="two"/>
  </equality>
</mujoco>
"""


def test_a_finding_has_the_name_and_the_position_of_its_element(write: Write) -> None:
    path = write(PLACES, "places.xml")
    done = command("check", "--format", "json", str(path))
    found = {(one["element"], one["name"]): one for one in done.data["findings"]}
    lines = PLACES.splitlines()
    for key, start in {
        ("joint", "b & c"): '<joint type="slide" name="b &amp; c"',
        ("equality", "1"): "<weld",
        ("equality", "glue"): '<weld name="glue"',
    }.items():
        one = found.pop(key)
        line, column = lines[one["line"] - 1], one["column"] - 1
        assert line[column : column + one["width"]] == start, key
    assert [(one["element"], one["width"]) for one in found.values()] == [(None, 0)]  # unused parts
    assert "14 |     <weld name=" in command("check", str(path)).text
    annotations = command("check", "--format", "github", str(path)).text
    assert "line=14,col=5,endColumn=22,title=MJCF101" in annotations
    results = command("check", "--format", "sarif", str(path)).data["runs"][0]["results"]
    names = [one["locations"][0].get("logicalLocations") for one in results]
    assert [{"name": "glue", "kind": "equality"}] in names


@pytest.mark.parametrize("verify", [True, False])
def test_a_constraint_without_a_name_has_its_number_in_the_file(write: Write, verify: bool) -> None:
    weld = '<weld body1="a" body2="b"/>\n'
    idle = '<joint joint1="b" joint2="a" polycoef="0 1 0 0 0" active="false"/>\n'
    robot = loaded(write(coupled("\n", weld, idle), "welded.xml"), verify=verify)
    found = {one.name: (one.code, one.line) for one in robot.findings if one.element == "equality"}
    assert found == {"0": ("MJCF101", 2), "1": ("MJCF102", 3)}


def test_an_element_of_an_included_file_has_no_line(write: Write) -> None:
    write('<mujoco><equality><weld body1="b" body2="two"/></equality></mujoco>', "part.xml")
    path = write(PLACES.replace("  <sensor>", '  <include file="part.xml"/><sensor>'), "top.xml")
    done = command("check", "--format", "json", str(path))
    lines = {one["name"]: one["line"] for one in done.data["findings"] if one["element"] == "equality"}
    assert lines == {"0": 1, "2": 1, "glue": 14}  # the index of an equality depends on the included file


def test_check_uses_the_options_of_loading_for_an_mjcf_file(write: Write) -> None:
    path = str(write(one_joint('<joint name="root_joint"/>'), "root.xml"))
    assert command("check", path).code == 0
    done = command("check", path, "--root-joint", "floating")
    assert (done.code, "URDF403" in done.text) == (1, True)
    done = command("check", path, "--xacro-arg", "a:=1")
    assert (done.code, "--xacro-arg does nothing without a .xacro file" in done.err) == (2, True)


def test_check_reads_mjcf_from_standard_input() -> None:
    idle = '<joint name="idle" joint1="b" joint2="a" polycoef="0 1 0 0 0" active="false"/>'
    done = command("check", "-", "--format", "concise", stdin="\ufeff" + coupled(idle))
    column = coupled(idle).index(idle) + 1
    expected = f"<stdin>:1:{column}: MJCF102 note: equality 'idle': a constraint that is not active"
    assert (done.code, done.text.splitlines()[0]) == (0, expected)


UNNAMED = f'<body pos="0 0 1">{MASS}{{}}</body><site'
MESH = '<geom type="mesh" mesh="nope"/></body></worldbody><asset><mesh name="nope" file="nope.stl"/></asset>'


@pytest.mark.parametrize(
    ("old", "new", "shapes", "expected"),
    [
        ("</mujoco>", "</mujoco>", "", "agrees on the poses of the bodies"),
        ("</body></worldbody>", MESH, ", without its shapes", "agrees on the poses of the bodies"),
        ("<site", UNNAMED.format(""), "", "does not find"),
        ("<site", UNNAMED.format("<joint/>"), "", "different joints"),
    ],
)
def test_the_survey_of_mjcf_files_counts_each_result_of_the_checks(
    write: Write, old: str, new: str, shapes: str, expected: str
) -> None:
    path = write(one_joint('<joint name="a" axis="0 0 1"/>').replace(old, new), "one.xml")
    assert describe_result(path) == f"verified{shapes}; Pinocchio's MJCF reader: {expected}"


SIBLINGS = """<mujoco><worldbody><body name="base"><freejoint name="root"/><geom size=".1"/>
<body name="z" pos="0 .1 0"><joint name="z1" axis="0 1 0"/><geom size=".1"/>
  <body name="foot" pos="0 0 -.2"><joint name="b" type="slide" axis="0 0 1"/><geom size=".1"/></body></body>
<body name="a" pos="0 -.1 0"><joint name="n" axis="0 1 0"/><joint name="m" axis="1 0 0"/>
  <geom size=".1"/></body>
</body></worldbody></mujoco>"""


def test_the_convention_of_mujoco_has_the_qpos_and_qvel_of_the_file() -> None:
    robot, model = loaded(SIBLINGS), mujoco.MjModel.from_xml_string(SIBLINGS)
    conversion = robot.convention("mujoco")
    assert conversion.joint_names == tuple(model.joint(i).name for i in range(model.njnt))
    assert conversion.joint_names == ("root", "z1", "b", "n", "m")
    data, q, v = mujoco.MjData(model), robot.sample(1)[0], np.arange(1.0, 11.0)
    data.qpos[:], data.qvel[:] = conversion.to(q, v)
    mujoco.mj_forward(model, data)
    for name in ("foot", "a"):
        velocity = np.zeros(6)
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, model.body(name).id, velocity, 0)
        np.testing.assert_allclose(
            data.body(name).xpos, robot.placement(q, f"link:{name}")[:3, 3], atol=1e-14
        )
        np.testing.assert_allclose(np.roll(velocity, 3), robot.velocity(q, v, f"link:{name}"), atol=1e-12)


def test_a_velocity_of_an_unknown_centre_of_mass_is_refused() -> None:
    robot = loaded(SIBLINGS)
    conversion, q, v = robot.convention("newton"), robot.sample(1)[0], np.ones(10)
    assert conversion.to(q).shape == (11,)
    for call in (
        lambda: conversion.to(q, v),
        lambda: conversion.from_(q, v),
        lambda: conversion.jacobian(q, robot.jacobian(q, "foot")),
    ):
        with pytest.raises(InputError, match="newton: joint root: velocities of a centre of mass need"):
            call()
