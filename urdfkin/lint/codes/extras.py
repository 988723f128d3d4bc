"""URDF7xx: inertials, geometry and materials, none of which kinematics needs."""

from urdfkin.lint.rule import ERROR, WARNING, Code


def _inertial(inside: str) -> str:
    return f'<link name="base">\n  <inertial>\n{inside}  </inertial>\n</link>\n'


def _visual(inside: str) -> str:
    return f'<link name="base">\n  <visual>\n{inside}  </visual>\n</link>\n'


_INERTIA = '    <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>\n'
_GOOD_INERTIAL = _inertial('    <mass value="1"/>\n' + _INERTIA)
_GOOD_VISUAL = _visual('    <geometry><sphere radius="1"/></geometry>\n')
_READS = "Pinocchio reads it; yourdfpy reads it."

INERTIAL_INCOMPLETE = Code(
    "URDF701",
    "inertial-incomplete",
    WARNING,
    "an inertial without mass, or without all six moments",
    why="Kinematics does not need it, dynamics does: readers then take zero, or drop the inertial.",
    bad=_inertial(_INERTIA),
    good=_GOOD_INERTIAL,
    others="Pinocchio reads it and drops the inertial; yourdfpy reads it.",
)

INERTIAL_IMPOSSIBLE = Code(
    "URDF702",
    "inertial-impossible",
    WARNING,
    "an inertial that no body can have",
    why="A mass is not negative, moments of inertia are not negative, and none of the three principal ones is"
    " larger than the sum of the other two. Dynamics computed with it can explode; kinematics is untouched.",
    bad=_inertial('    <mass value="-1"/>\n' + _INERTIA),
    good=_GOOD_INERTIAL,
    others=_READS,
)

INERTIAL_SCALE = Code(
    "URDF703",
    "inertial-scale",
    WARNING,
    "a mass or a lever that is out of all proportion",
    why="Dynamics with such a body overflows or loses every digit; kinematics is untouched.",
    bad=_inertial('    <mass value="1e308"/>\n' + _INERTIA),
    good=_GOOD_INERTIAL,
    others=_READS,
)

UNREADABLE = Code(
    "URDF704",
    "unreadable-extra",
    WARNING,
    "a number of an inertial, a shape or a colour cannot be read",
    why="Kinematics does not need it. urdfdom logs an error and goes on without the element; other readers"
    " give up.",
    bad=_visual('    <geometry><box size="1 x 1"/></geometry>\n'),
    good=_GOOD_VISUAL,
    others="Pinocchio reads it and drops the shape; yourdfpy refuses it.",
)

GEOMETRY = Code(
    "URDF705",
    "geometry-incomplete",
    WARNING,
    "a visual or collision without a usable shape",
    why="Kinematics does not need it. urdfdom logs an error and goes on without the element.",
    bad=_visual(""),
    good=_GOOD_VISUAL,
    others="Pinocchio reads it and drops the shape; yourdfpy refuses it.",
)

MESH_MISSING = Code(
    "URDF706",
    "mesh-missing",
    WARNING,
    "a mesh that cannot be found",
    why="Kinematics does not need meshes and urdfkin never opens one. Packages (`package://name/...`) are"
    " looked for in ROS_PACKAGE_PATH, in the share folders of AMENT_PREFIX_PATH, and among the folders above"
    " the file.",
    bad=_visual('    <geometry><mesh filename="package://no_such_package/arm.stl"/></geometry>\n'),
    good=_GOOD_VISUAL,
    others=_READS,
)

MESH_REMOTE = Code(
    "URDF707",
    "mesh-remote",
    WARNING,
    "a mesh with a network address",
    why="urdfkin opens no connection. Other readers may fetch it, so reading the file tells someone that you"
    " did.",
    bad=_visual('    <geometry><mesh filename="http://example.org/arm.stl"/></geometry>\n'),
    good=_GOOD_VISUAL,
    others=_READS,
)

MATERIAL_UNKNOWN = Code(
    "URDF708",
    "material-unknown",
    WARNING,
    "a material is used that is defined nowhere",
    why="The shape has no colour. Readers warn or take a default.",
    bad=_visual('    <geometry><sphere radius="1"/></geometry>\n    <material name="blue"/>\n'),
    good='<material name="blue"><color rgba="0 0 1 1"/></material>\n'
    + _visual('    <geometry><sphere radius="1"/></geometry>\n    <material name="blue"/>\n'),
    others=_READS,
)

MATERIAL_TWICE = Code(
    "URDF709",
    "material-twice",
    ERROR,
    "two materials of the robot share a name",
    why="urdfdom refuses the whole file, and so do Pinocchio and everything else built on it.",
    bad='<material name="a"><color rgba="1 0 0 1"/></material>\n'
    '<material name="a"><color rgba="0 0 1 1"/></material>\n<link name="base"/>\n',
    good='<material name="a"><color rgba="1 0 0 1"/></material>\n<link name="base"/>\n',
    others="Pinocchio refuses it; yourdfpy reads it.",
)
