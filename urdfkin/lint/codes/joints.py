"""URDF5xx: what joints say about their motion: type, axis, limits, mimic."""

from urdfkin.lint.rule import ERROR, NOTE, REFUSES, WARNING, Code

_LIMIT = '  <limit lower="-1" upper="1" effort="10" velocity="1"/>\n'


def _joint(kind: str, inside: str, name: str = "j", limit: str = _LIMIT) -> str:
    return (
        f'<joint name="{name}" type="{kind}">\n  <parent link="base"/>\n  <child link="tip"/>\n'
        f"{inside}{limit}</joint>\n"
    )


def _two(inside: str, kind: str = "revolute", leader: str = "revolute") -> str:
    first = '<link name="base"/>\n<link name="arm"/>\n<link name="tip"/>\n'
    lead = (
        f'<joint name="lead" type="{leader}">\n  <parent link="base"/>\n'
        f'  <child link="arm"/>\n{_LIMIT}</joint>\n'
    )
    follow = (
        f'<joint name="follow" type="{kind}">\n  <parent link="arm"/>\n  <child link="tip"/>\n{_LIMIT}'
        f"{inside}</joint>\n"
    )
    return first + lead + follow


_GOOD_MIMIC = _two('  <mimic joint="lead" multiplier="2"/>\n')
_GOOD_AXIS = _joint("revolute", '  <axis xyz="0 0 1"/>\n')

UNKNOWN_TYPE = Code(
    "URDF501",
    "unknown-joint-type",
    ERROR,
    "a joint type that URDF does not define",
    why="The types are revolute, continuous, prismatic, fixed, planar and floating, in lower case. Ball and"
    " screw joints must be built from these.",
    bad=_joint("hinge", ""),
    good=_joint("revolute", ""),
    others="Pinocchio refuses it; yourdfpy reads it: the type is not checked.",
)

NO_DIRECTION = Code(
    "URDF502",
    "axis-without-direction",
    ERROR,
    "a joint's axis is zero, or so tiny or huge that its length cannot be computed",
    why="A zero vector has no direction. When the squared length under- or overflows, readers that normalise"
    " divide by zero or infinity, and the joint's matrix is no rotation.",
    bad=_joint("revolute", '  <axis xyz="0 0 0"/>\n'),
    good=_GOOD_AXIS,
    others="Pinocchio reads it: its matrices are then no rotations; yourdfpy reads it: the joint does not"
    " move.",
)

AXIS_LENGTH = Code(
    "URDF503",
    "axis-not-unit",
    WARNING,
    "a joint's axis is not of unit length",
    why="The specification asks for a unit vector. urdfkin and Pinocchio normalise it. Readers that do not,"
    " yourdfpy among them, move a prismatic joint further than its coordinate says. A difference that is no"
    " more than rounding is a note.",
    bad=_joint("prismatic", '  <axis xyz="0 0 2"/>\n'),
    good=_joint("prismatic", '  <axis xyz="0 0 1"/>\n'),
    others="Pinocchio reads it and normalises; yourdfpy reads it as it is: the joint moves twice as far.",
)

EMPTY_AXIS = Code(
    "URDF504",
    "axis-without-xyz",
    ERROR,
    "an <axis> without xyz",
    why="Two readers see two robots: the specification's default is 1 0 0, and urdfdom takes a zero vector,"
    " so that Pinocchio's matrices are no rotations. Without any <axis>, both take 1 0 0. For a planar joint,"
    " whose axis changes nothing, the finding is a warning.",
    bad=_joint("revolute", "  <axis/>\n"),
    good=_joint("revolute", '  <axis xyz="1 0 0"/>\n'),
    others="Pinocchio reads it: as a zero axis; yourdfpy reads it as 1 0 0.",
)

PLANAR_AXIS = Code(
    "URDF505",
    "planar-axis",
    WARNING,
    "a planar joint's axis is not z",
    why="The specification says that the axis is the plane's normal (1 0 0 when it is not given). Pinocchio"
    " always moves in the XY plane of the joint's frame, and urdfkin follows it, so that its numbers can be"
    " checked and exchanged. Turn the joint's origin so that z is the normal.",
    bad=_joint("planar", '  <axis xyz="1 0 0"/>\n', limit=""),
    good=_joint("planar", '  <axis xyz="0 0 1"/>\n', limit=""),
    others="Pinocchio reads it and moves in the XY plane; yourdfpy reads it and does not move planar joints.",
)

MISSING_LIMIT = Code(
    "URDF506",
    "missing-limit",
    ERROR,
    "a revolute or prismatic joint has no <limit>",
    why="The specification requires it. A joint that turns without limit is `continuous`.",
    bad=_joint("revolute", '  <axis xyz="0 0 1"/>\n', limit=""),
    good=_GOOD_AXIS,
    others="Pinocchio refuses it; yourdfpy reads it without limits.",
)

INVERTED_LIMIT = Code(
    "URDF507",
    "inverted-limit",
    ERROR,
    "a joint's lower limit is above its upper limit",
    why="No position is allowed at all: the two are probably swapped. Nothing can be sampled within them.",
    bad=_joint("revolute", "", limit='  <limit lower="1" upper="-1" effort="10" velocity="1"/>\n'),
    good=_GOOD_AXIS,
    others="Pinocchio reads it: every sample within limits then fails; yourdfpy reads it.",
)

EMPTY_RANGE = Code(
    "URDF508",
    "empty-range",
    WARNING,
    "a joint's lower and upper limits are equal",
    why="The joint cannot move. When neither limit is written both are zero; perhaps the limits were"
    " forgotten, or a `fixed` joint is meant.",
    bad=_joint("revolute", "", limit='  <limit effort="10" velocity="1"/>\n'),
    good=_GOOD_AXIS,
    others="Pinocchio reads it; yourdfpy reads it.",
)

NEGATIVE_LIMIT = Code(
    "URDF509",
    "negative-limit",
    WARNING,
    "a limit of effort or velocity is negative",
    why="Both are magnitudes. Kinematics does not need them, but Pinocchio refuses to build the model, so"
    " nothing can be verified.",
    bad=_joint("revolute", "", limit='  <limit lower="-1" upper="1" effort="10" velocity="-1"/>\n'),
    good=_GOOD_AXIS,
    others="Pinocchio refuses it; yourdfpy reads it.",
    oracle=REFUSES,
)

IGNORED = Code(
    "URDF510",
    "ignored-value",
    WARNING,
    "a value is given that the joint's type ignores",
    why="A continuous joint has no position limits, a fixed joint nothing to mimic. The value is skipped;"
    " perhaps the type is not the one that is meant.",
    bad=_joint("continuous", ""),
    good=_joint("revolute", ""),
    others="Pinocchio reads it and ignores the value; yourdfpy reads it.",
)

NEARLY_COORDINATE_AXIS = Code(
    "URDF514",
    "nearly-coordinate-axis",
    NOTE,
    "a joint's axis is so near a coordinate axis that Pinocchio takes that one",
    why="Pinocchio has joints of their own for the axes x, y and z, and takes one for a revolute, continuous"
    " or prismatic joint when the vector, as it is written, differs from that axis by 1e-12 or less (Eigen's"
    " isApprox). urdfkin takes the axis in the file. A tilt t turns a vector by 2 t at most: so much more the"
    " two may differ by, and results of the frames behind the joint are verified within a bound that is wider"
    " by that, at most 2e-12 of what they are summed from for each factor. A tilt of 2.2e-16 or less is"
    " rounding and no finding. Directions against an axis, such as 0 0 -1, have no such joint, and vectors of"
    " another length than one do not get it: those Pinocchio takes as they are.",
    bad=_joint("revolute", '  <axis xyz="1e-13 0 1"/>\n'),
    good=_GOOD_AXIS,
    others="Pinocchio reads it as 0 0 1; yourdfpy reads it.",
)

QUATERNION_IGNORED = Code(
    "URDF511",
    "quat-xyzw-ignored",
    WARNING,
    "quat_xyzw in a file whose version does not have it: the rotation is ignored",
    why='The attribute exists from version 1.1 on. In a file without version="1.1" urdfdom ignores it, and'
    " urdfkin does too: the rotation is what rpy says, or none.",
    bad=_joint("revolute", '  <origin xyz="0 0 1" quat_xyzw="0 0 1 0"/>\n'),
    good=_joint("revolute", '  <origin xyz="0 0 1" rpy="0 0 3.141592653589793"/>\n'),
    others="Pinocchio reads it and ignores the quaternion; yourdfpy reads it likewise.",
)

QUATERNION = Code(
    "URDF512",
    "quat-xyzw",
    WARNING,
    "an origin is given as a quaternion, which most readers ignore",
    why="URDF 1.1 allows it; urdfkin and urdfdom 6 obey it and normalise the quaternion. Older readers, and"
    " yourdfpy, take the rotation for none.",
    bad='<robot name="r" version="1.1">\n<link name="base"/>\n<link name="tip"/>\n'
    + _joint("revolute", '  <origin xyz="0 0 1" quat_xyzw="0 0 1 0"/>\n')
    + "</robot>\n",
    good=_joint("revolute", '  <origin xyz="0 0 1" rpy="0 0 3.141592653589793"/>\n'),
    others="Pinocchio reads it and obeys; yourdfpy reads it and ignores the quaternion.",
)

BAD_QUATERNION = Code(
    "URDF513",
    "bad-quaternion",
    ERROR,
    "a quaternion without a direction, or beside rpy",
    why="A zero quaternion is no rotation, and two rotations for one origin contradict each other.",
    bad='<robot name="r" version="1.1">\n<link name="base"/>\n<link name="tip"/>\n'
    + _joint("revolute", '  <origin rpy="0 0 0" quat_xyzw="0 0 1 0"/>\n')
    + "</robot>\n",
    good=_joint("revolute", '  <origin xyz="0 0 1" rpy="0 0 3.141592653589793"/>\n'),
    others="Pinocchio refuses it: a zero quaternion it takes for none; yourdfpy reads it.",
)

MIMIC_UNKNOWN = Code(
    "URDF520",
    "mimic-unknown",
    ERROR,
    "a joint mimics a joint that does not exist",
    why="There is nothing to follow. With mimic off (`mimic=False`, `--no-mimic`) the joint moves freely and"
    " this is a note.",
    bad=_two('  <mimic joint="laed"/>\n'),
    good=_GOOD_MIMIC,
    others="Pinocchio reads it without mimic and refuses it with; yourdfpy reads it.",
)

MIMIC_LOOP = Code(
    "URDF521",
    "mimic-loop",
    ERROR,
    "joints mimic themselves or each other in a circle",
    why="No joint of the circle has a value of its own.",
    bad=_two('  <mimic joint="follow"/>\n'),
    good=_GOOD_MIMIC,
    others="Pinocchio reads it without mimic; yourdfpy reads it.",
)

MIMIC_LEADER = Code(
    "URDF522",
    "mimic-leader",
    ERROR,
    "a joint mimics, or is mimicked, without a single coordinate",
    why="The rule is value = multiplier * other + offset: both joints need exactly one number. A fixed joint"
    " has none, planar and floating ones have several.",
    bad=_two('  <mimic joint="lead"/>\n', leader="fixed"),
    good=_GOOD_MIMIC,
    others="Pinocchio reads it without mimic; yourdfpy reads it.",
)

MIMIC_CONSTANT = Code(
    "URDF523",
    "mimic-constant",
    WARNING,
    "a mimic joint's multiplier is zero: it never moves",
    why="The joint stays at its offset whatever its leader does. A fixed joint says that more plainly.",
    bad=_two('  <mimic joint="lead" multiplier="0" offset="0.3"/>\n'),
    good=_GOOD_MIMIC,
    others="Pinocchio reads it; yourdfpy reads it.",
)

MIMIC_CONTINUOUS = Code(
    "URDF524",
    "mimic-continuous",
    WARNING,
    "a continuous joint mimics another",
    why="Legal, and urdfkin couples it as the specification says. Pinocchio ignores mimic on continuous"
    " joints, so a model it builds by itself has one more degree of freedom.",
    bad=_two('  <mimic joint="lead"/>\n', kind="continuous").replace(_LIMIT + "  <mimic", "  <mimic"),
    good=_GOOD_MIMIC,
    others="Pinocchio reads it and ignores the mimic; yourdfpy reads it and obeys.",
)

MIMIC_CHAIN = Code(
    "URDF525",
    "mimic-chain",
    NOTE,
    "a joint mimics a joint that mimics another",
    why="urdfkin follows the chain to the joint that moves: multipliers multiply, offsets add up. Many"
    " readers resolve one step only.",
    bad='<link name="base"/>\n<link name="a"/>\n<link name="b"/>\n<link name="c"/>\n'
    '<joint name="j1" type="revolute">\n  <parent link="base"/>\n  <child link="a"/>\n'
    + _LIMIT
    + "</joint>\n"
    '<joint name="j2" type="revolute">\n  <parent link="a"/>\n  <child link="b"/>\n'
    '  <mimic joint="j1"/>\n' + _LIMIT + "</joint>\n"
    '<joint name="j3" type="revolute">\n  <parent link="b"/>\n  <child link="c"/>\n'
    '  <mimic joint="j2"/>\n' + _LIMIT + "</joint>\n",
    good=_GOOD_MIMIC,
    others="Pinocchio reads it without mimic; yourdfpy reads it and follows one step.",
)

MIMIC_SCALE = Code(
    "URDF526",
    "mimic-scale",
    WARNING,
    "a mimic joint's multiplier or offset is out of all proportion",
    why="The follower's rate is the leader's times the multiplier, and accelerations hold its square: beyond"
    " 1e150 that is more than a double can hold, and long before it nothing else in the robot counts.",
    bad=_two('  <mimic joint="lead" multiplier="1e300"/>\n'),
    good=_GOOD_MIMIC,
    others="Pinocchio reads it; yourdfpy reads it.",
)
