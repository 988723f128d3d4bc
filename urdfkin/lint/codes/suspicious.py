"""URDF6xx: legal, and probably not what was meant."""

from urdfkin.lint.rule import ERROR, NOTE, WARNING, Code


def _joint(inside: str, kind: str = "fixed") -> str:
    return (
        f'<joint name="j" type="{kind}">\n  <parent link="base"/>\n  <child link="tip"/>\n{inside}</joint>\n'
    )


def _limited(lower: str, upper: str, kind: str = "revolute") -> str:
    return _joint(f'  <limit lower="{lower}" upper="{upper}" effort="10" velocity="1"/>\n', kind)


def _siblings(second: str) -> str:
    limit = '  <limit lower="-1" upper="1" effort="10" velocity="1"/>\n'
    joints = "".join(
        f'<joint name="{name}" type="revolute">\n  <parent link="base"/>\n  <child link="{name}_tip"/>\n'
        f'  <origin xyz="{xyz}"/>\n{limit}</joint>\n'
        for name, xyz in (("left", "0 0 1"), ("right", second))
    )
    return '<link name="base"/>\n<link name="left_tip"/>\n<link name="right_tip"/>\n' + joints


ROUNDED_PI = Code(
    "URDF601",
    "rounded-pi",
    NOTE,
    "an angle looks like a rounded multiple of pi",
    why="1.5708 is not pi/2: it is off by 3.7e-6 rad, and everything beyond the joint is off by that angle"
    " times its distance. The value is used as written. Two axes that were meant to be parallel are then not,"
    " which makes Denavit-Hartenberg parameters blow up. When the tip is off by more than a millimetre this"
    " is a warning.",
    bad=_joint('  <origin xyz="0 0 1" rpy="1.5708 0 0"/>\n'),
    good=_joint('  <origin xyz="0 0 1" rpy="1.5707963267948966 0 0"/>\n'),
    others="Pinocchio reads it as written; yourdfpy reads it as written.",
)

DEGREES = Code(
    "URDF602",
    "degrees",
    WARNING,
    "an angle looks like degrees",
    why="URDF angles are radians. A limit of 90 is more than fourteen turns.",
    bad=_limited("-90", "90"),
    good=_limited("-1.5707963267948966", "1.5707963267948966"),
    others="Pinocchio reads it as radians; yourdfpy reads it as radians.",
)

MILLIMETRES = Code(
    "URDF603",
    "huge-length",
    WARNING,
    "a length is so large that it is probably not in metres, or drowns everything else",
    why="URDF lengths are metres. A joint hundreds of metres from its parent is usually given in millimetres."
    " Beside a length of 1e17 a millimetre has no digit left: sums of the two are rounded to the larger.",
    bad=_joint('  <origin xyz="350 0 120"/>\n'),
    good=_joint('  <origin xyz="0.350 0 0.120"/>\n'),
    others="Pinocchio reads it as metres; yourdfpy reads it as metres.",
)

TINY_ROBOT = Code(
    "URDF604",
    "tiny-robot",
    WARNING,
    "the whole robot is smaller than a tenth of a millimetre",
    why="URDF lengths are metres. A scale was probably applied twice.",
    bad=_joint('  <origin xyz="0.00001 0 0"/>\n'),
    good=_joint('  <origin xyz="0.01 0 0"/>\n'),
    others="Pinocchio reads it as metres; yourdfpy reads it as metres.",
)

SAME_PLACE = Code(
    "URDF605",
    "same-place",
    NOTE,
    "two joints of one link sit at the same place and turn about the same axis",
    why="Legal, and sometimes meant (a pair of wheels on one shaft); more often one of the two was copied and"
    " not moved.",
    bad=_siblings("0 0 1"),
    good=_siblings("0 1 1"),
    others="Pinocchio reads it; yourdfpy reads it.",
)

OVERFLOW = Code(
    "URDF606",
    "overflow",
    ERROR,
    "lengths along a chain add up to more than a double can hold",
    why="The placement of the chain's end would be infinite.",
    bad=_joint('  <origin xyz="1.7e308 1.7e308 0"/>\n'),
    good=_joint('  <origin xyz="1 1 1"/>\n'),
    others="Pinocchio reads it and computes infinities; yourdfpy reads it.",
)
