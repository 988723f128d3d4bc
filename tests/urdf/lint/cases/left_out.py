"""MJCF files with one part that a tree cannot represent, and the expected findings."""


class Mjcf:
    """An MJCF text with all findings, each as (code, message)."""

    def __init__(self, name: str, text: str, *findings: str) -> None:
        self.name, self.text = name, text
        self.findings = [tuple(one.split(" ", 1)) for one in findings]


_SLIDE = 'type="slide" limited="true" range="-1 1"'


def _two(*, joint: str = _SLIDE, inside: str = "", body: str = "", world: str = "", more: str = "") -> str:
    """Write two bodies in the world, each with one joint, and an additional part."""
    mass = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
    return f"""<mujoco>
  <worldbody>
    <body name="one">{mass}<joint name="a" axis="0 0 1"/>{inside}</body>
    <body name="two" {body}>{mass}<joint name="b" {joint}/></body>{world}
  </worldbody>{more}
</mujoco>"""


_RADIANS = '<compiler angle="radian"/>'


def _hinge(ends: str, **parts: str) -> str:
    return _two(joint=f'type="hinge" limited="true" range="{ends}"', **parts)


def _equality(*equalities: str) -> str:
    return _two(more=f"<equality>{''.join(equalities)}</equality>")


_USELESS = "kinematics does not use "
_SPATIAL = '<tendon><spatial name="t"><site site="s"/><site site="r"/></spatial></tendon>'

_MOTOR = '<actuator><motor joint="a"/></actuator>'
CASES = [
    Mjcf("nothing", _two()),
    Mjcf("a-line-between-two-joints", _equality('<joint joint1="b" joint2="a" polycoef="0.1 2 0 0 0"/>')),
    Mjcf(
        "a-weld", _equality('<weld name="glue" body1="one" body2="two"/>'),
        "MJCF101 equality glue: a constraint (weld of one and two) that a tree cannot represent",
    ),
    Mjcf(
        "a-connection", _equality('<connect name="pin" body1="one" body2="two" anchor="0 0 0"/>'),
        "MJCF101 equality pin: a constraint (connect of one and two) that a tree cannot represent",
    ),
    Mjcf(
        "a-curve-between-two-joints",
        _equality('<joint name="bent" joint1="b" joint2="a" polycoef="0 0 1 0 0"/>'),
        "MJCF101 equality bent: a constraint (b and a) that is not a linear relation of two joints",
    ),
    Mjcf(
        "a-joint-held-twice",
        _equality('<joint name="x" joint1="b" joint2="a"/>', '<joint name="y" joint1="b" joint2="a"/>'),
        "MJCF101 equality y: joint b has two rules, or its rules form a cycle",
    ),
    Mjcf(
        "two-joints-that-hold-each-other",
        _equality('<joint name="x" joint1="b" joint2="a"/>', '<joint name="y" joint1="a" joint2="b"/>'),
        "MJCF101 equality y: joint a has two rules, or its rules form a cycle",
    ),
    Mjcf(
        "a-constraint-that-is-off", _equality('<joint name="x" joint1="b" joint2="a" active="false"/>'),
        "MJCF102 equality x: a constraint that is not active",
    ),
    Mjcf(
        "a-tendon", _two(inside='<site name="s"/>', world='<site name="r"/>', more=_SPATIAL),
        "MJCF101 tendon: urdfkin ignores tendons",
    ),
    Mjcf(
        "a-mocap-body", _two(world='<body name="hand" mocap="true"/>'),
        "MJCF101 body hand: a mocap body is fixed at its pose in the file",
    ),
    Mjcf(
        "a-slide-without-limits", _two(joint='type="slide"'),
        "MJCF102 joint b: a slide joint without limits gets +-1000 m, because URDF requires limits",
    ),
    Mjcf(
        "radians-in-a-file-in-degrees", _hinge("-1.5 3.1416"),
        "MJCF201 compiler: the largest limit of a hinge is 3.142 degrees: the limits are probably radians",
    ),
    Mjcf("ten-turns-in-a-file-in-radians", _hinge("-63 63", more=_RADIANS)),
    Mjcf("radians-in-a-file-in-radians", _hinge("-0.1 0.1", more=_RADIANS)),
    Mjcf("a-hinge-of-90-degrees", _hinge("-90 90")),
    Mjcf(
        "a-hinge-of-five-degrees-beside-one-of-90",
        _hinge("-5 5", inside='<joint name="c" limited="true" range="-90 0"/>'),
    ),
    Mjcf(
        "a-free-body-that-stands-elsewhere", _two(joint='type="free"', body='pos="0 0 1"'),
        "MJCF102 joint b: qpos0 places this body at (0, 0, 1); in the neutral configuration the body is"
        " at the origin",
    ),
    Mjcf(
        "a-free-body-that-is-turned", _two(joint='type="free"', body='quat="0 1 0 0"'),
        "MJCF102 joint b: qpos0 places this body at (0, 0, 0) with the quaternion (w, x, y, z) ="
        " (0, 1, 0, 0); in the neutral configuration the body is at the origin, not turned",
    ),
    Mjcf(
        "shapes-lights-and-motors",
        _two(inside='<geom size="0.1"/><geom size="0.2"/><light/><camera/>', more=_MOTOR),
        f"MJCF102 {_USELESS}1 actuator, 2 geoms, 1 camera, 1 light",
    ),
]  # fmt: skip
