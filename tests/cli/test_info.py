"""`urdfkin info` draws the tree of links; `urdfkin chain` prints the axes and origins of a path."""

import numpy as np
import pytest

import urdfkin as library
from tests.cli.running import good, refused, urdfkin
from urdfkin.model.chain import FrameChain
from urdfkin.model.summary import tree_guides
from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree, Mimic, build_tree
from urdfkin.urdf.writer import to_urdf


@pytest.fixture(autouse=True)
def _on_a_wide_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "200")


def joint(name: str, kind: JointKind = JointKind.CONTINUOUS, **more: object) -> Joint:
    given: dict[str, object] = {"axis": np.array([0.0, 0.0, 1.0])} | more
    return Joint(name, kind, 0, np.eye(4), **given)  # type: ignore[arg-type]


def forked() -> KinematicTree:
    rows = [(joint("b"), "root", "B"), (joint("a"), "root", "A"), (joint("c"), "A", "C")]
    rows += [(joint("d"), "C", "D"), (joint("e"), "C", "E"), (joint("f"), "E", "F")]
    return build_tree("forked", "root", rows)


def parents_of_the_drawing(lines: list[str]) -> list[int]:
    """Return the parent of each line, from the lines of the drawn tree alone."""
    stack: list[tuple[int, int]] = []
    found = []
    for k, line in enumerate(lines):
        depth = len(line) - len(line.lstrip("│├└ "))
        branch = line[:depth].rstrip().endswith(("├", "└"))
        while stack and (stack[-1][1] > depth or (branch and stack[-1][1] >= depth)):
            stack.pop()
        found.append(stack[-1][0] if stack else -1)
        stack.append((k, depth))
    return found


@pytest.mark.parametrize("name", ["forked", "panda", "talos"])
def test_the_tree_drawing_shows_the_parent_of_each_link(name: str) -> None:
    tree = forked() if name == "forked" else library.load(name, verify=False).tree
    drawn = [guide + "x" for guide in tree_guides(tree)]
    assert parents_of_the_drawing(drawn) == [-1, *(one.parent for one in tree.joints)]


def test_info_reports_the_first_joint_with_a_different_order_in_the_file() -> None:
    rows = [(joint(f"j{k}"), f"l{k}", f"l{k + 1}") for k in range(300)]
    assert set(tree_guides(build_tree("long", "l0", rows))) == {""}
    urdf = to_urdf(forked())
    assert urdfkin("info", urdf).text.splitlines()[-1].endswith("the file has the same order")
    swapped = urdf.replace('joint name="a"', 'joint name="z"')  # changes only urdfkin's order
    assert "differs: z is number 1 in the file and b here; " in urdfkin("info", swapped).text.splitlines()[-1]
    # The file does not contain the root joint.
    assert urdfkin("info", urdf, "--root-joint", "planar").text.splitlines()[-1].endswith("the same order")


def test_info_names_the_mimicked_joint_and_the_letter_of_a_main_axis() -> None:
    rows = [
        (joint("lead", axis=np.array([0.0, -1.0, 0.0])), "root", "A"),
        (joint("same", mimic=Mimic("lead", 1.0, 0.0)), "A", "B"),
        (joint("scaled", mimic=Mimic("lead", -0.5, 0.25), axis=np.array([0.6, 0.0, 0.8])), "B", "C"),
        (joint("held", JointKind.FIXED), "C", "D"),
    ]
    lines = urdfkin("info", to_urdf(build_tree("r", "root", rows))).text.splitlines()
    cells = {line.split()[0]: line.split()[1:] for line in lines}
    assert cells["A"] == ["lead", "continuous", "-y", "q[0]", "v[0]"]
    assert cells["B"] == ["same", "continuous", "z", "q[0]", "v[0]", "lead"]
    assert cells["C"] == [
        *("scaled", "continuous", "0.6", "0", "0.8", "q[0]", "v[0]"),
        *("-0.5", "*", "lead", "+0.25"),
    ]
    assert cells["D"] == ["held", "fixed"]


def test_info_prints_index_ranges_of_joints_with_several_numbers_and_all_tips() -> None:
    text = urdfkin("info", to_urdf(forked()), "--root-joint", "floating").text
    (line,) = [line for line in text.splitlines() if "root_joint" in line]
    assert line.split()[1:5] == ["root_joint", "floating", "q[0:7]", "v[0:6]"]
    assert "; tips: D, F, B" in urdfkin("info", to_urdf(forked())).text


@pytest.mark.parametrize("name", ["panda", "a1"])
def test_printing_a_robot_gives_the_output_of_info(name: str) -> None:
    shown = [line.split() for line in str(library.load(name, verify=False)).splitlines()]
    told = [line.split() for line in urdfkin("info", name).text.splitlines()]
    assert [line for line in told if "─" not in line[0]] == [line for line in shown if "--" not in line[0]]


def test_the_tree_drawing_is_preserved_in_every_format() -> None:
    robot = library.load(to_urdf(forked()), verify=False)
    assert "\n│ ├ D " in str(robot)
    assert "\n│   F " in str(robot)
    assert '<td style="text-align:left;white-space:pre;padding:0 .5em">│   F</td>' in robot._repr_html_()
    assert "\n| │&nbsp;&nbsp;&nbsp;F | f |" in robot._repr_markdown_()
    assert "\n|~~~F & f &" in robot._repr_latex_()
    assert not set("├│└") & set(robot._repr_latex_())


# -- urdfkin chain -----------------------------------------------------------------------------------

PATHS = [
    ("panda", "panda_link0", "panda_hand_tcp"), ("panda", "panda_leftfinger", "panda_link2"),
    ("talos", "left_sole_link", "gripper_right_base_link"), ("polar", "", ""),
]  # fmt: skip


@pytest.mark.parametrize(("name", "base", "tip"), PATHS)
def test_axes_and_origins_of_a_chain_agree_with_the_robots_frames(name: str, base: str, tip: str) -> None:
    robot = library.load(name)
    ends = ["--base", base, "--tip", tip] if base else []
    data = good("chain", name, *ends, "--q", "random", "--seed", "3", "--format", "json").data
    q = np.array(data["q"])
    here = np.linalg.inv(robot.placement(q, data["base"]))
    values = dict(zip(robot.coordinate_names, q, strict=True))
    for joint in data["joints"]:
        model = robot.tree.joints[robot.tree.joint_index(joint["name"])]
        T = here @ robot.placement(q, f"joint:{joint['name']}")
        axis = T[:3, :3] @ model.axis
        slid = joint["kind"] == "prismatic" and not joint["backwards"]
        origin = T[:3, 3] - (axis * values[joint["name"]] if slid else 0.0)
        np.testing.assert_allclose(joint["axis"], -axis if joint["backwards"] else axis, atol=1e-14)
        np.testing.assert_allclose(joint["origin"], origin, atol=1e-14)
    T_base_tip = here @ robot.placement(q, data["tip"])
    np.testing.assert_allclose(data["placement"], T_base_tip, atol=1e-14)
    ways = np.array([joint["interorigin"] for joint in data["joints"]])
    np.testing.assert_allclose(data["joints"][0]["origin"] + ways.sum(axis=0), T_base_tip[:3, 3], atol=1e-14)
    assert data["verified"] is True


def test_the_table_and_the_csv_have_the_same_joints_in_the_order_of_the_path() -> None:
    names = list(library.load("panda").chain("panda_link2", "panda_leftfinger").joint_names)
    words = ["chain", "panda", "--base", "panda_leftfinger", "--tip", "panda_link2"]
    lines = urdfkin(*words).text.splitlines()
    rows = urdfkin(*words, "--format", "csv").rows
    assert [row[1] for row in rows[1:]] == [line.split()[0] for line in lines[3:-2]] == names
    assert all("backwards" in line for line in lines[3:-2])
    assert lines[-1].startswith("Pinocchio 4")


@pytest.mark.parametrize("mistake", ["an origin", "an axis", "the tip"])
def test_a_wrong_axis_or_origin_of_a_chain_is_a_disagreement(
    mistake: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    right = FrameChain.frames

    def wrong(path: FrameChain, q: FloatArray) -> FloatArray:
        poses = right(path, q)
        if mistake == "an axis":
            poses[..., 2, :3, 2] *= -1.0
        else:
            poses[..., -1 if mistake == "the tip" else 1, 0, 3] += 1e-12
        return poses

    monkeypatch.setattr(FrameChain, "frames", wrong)
    done = urdfkin("chain ur5 --q random")
    assert (done.code, done.out) == (1, b"")
    assert "the chain's axes disagree" in done.err


def test_a_chain_of_a_batch_or_of_a_floating_joint_is_refused() -> None:
    assert "the chain needs exactly one configuration" in refused("chain ur5 --q random:2")
    assert "a floating joint has no single axis" in refused("chain a1 --root-joint floating --base universe")


def test_a_command_prints_the_warnings_of_a_file_that_concern_its_kinematics() -> None:
    body = '<inertial><mass value="1"/><inertia ixx="9" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    axle = '<joint name="j" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 0 2"/></joint>'
    text = f'<robot name="r"><link name="a">{body}</link><link name="b"/>{axle}</robot>'
    err = urdfkin("info -", stdin=text).err
    assert "URDF503 warning" in err
    assert "URDF702" not in err
    assert "URDF702 warning" in urdfkin("check -", stdin=text).text
