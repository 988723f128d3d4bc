"""The operations that the page on speed speaks of are those that the walk does, counted by doing them."""

import urdfkin
from scripts.benchmarking.operations import operations


def counted(name: str, frame: str, quantity: str) -> int:
    robot = urdfkin.load(name, mimic=False)
    return operations(robot.plan([robot.tree.frame_link(frame)]), quantity)


def test_one_joint_about_z_at_the_origin_costs_what_one_counts_by_hand() -> None:
    text = """<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="continuous">
      <parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint></robot>"""
    robot = urdfkin.load(text)
    plan = robot.plan([1])
    # Sine and cosine 51. R Rz: three rows of two numbers, each two products and a sum: 18. The column: p - o
    # 3 and z x d 9, and nothing else.
    assert operations(plan, "jacobian") == 51 + 18 + 12
    # w + v z: 6.
    assert operations(plan, "velocity") == 51 + 18 + 6
    # alpha + a z + v w x z: 6 + 9 + 6.
    assert operations(plan, "acceleration") == 51 + 18 + 6 + 6 + 15


def test_what_is_not_asked_for_is_not_counted() -> None:
    for name, frame in (
        ("panda", "panda_hand"),
        ("talos", "gripper_left_base_link"),
        ("panda", "panda_leftfinger"),
    ):
        velocity, acceleration = (counted(name, frame, quantity) for quantity in ("velocity", "acceleration"))
        assert velocity < acceleration < 2 * velocity
