"""URDF2xx: whether it is a URDF at all, and which elements and attributes it is made of."""

from urdfkin.lint.rule import ERROR, WARNING, Code

NOT_URDF = Code(
    "URDF201",
    "not-a-urdf",
    ERROR,
    "the root element is not <robot>",
    why="The file is another format (SDF, MJCF, a launch file, a web page) or carries a namespace prefix that"
    " URDF does not know. urdfkin does not translate.",
    bad='<sdf version="1.7">\n  <model name="m"/>\n</sdf>\n',
    good='<robot name="m">\n  <link name="base"/>\n</robot>\n',
    others="Pinocchio refuses it; yourdfpy refuses it.",
)

XACRO = Code(
    "URDF202",
    "unexpanded-xacro",
    ERROR,
    "the file holds xacro macros or expressions that were not expanded",
    why="Readers skip elements they do not know, so what a macro would have produced is missing from the"
    " robot in silence. Expand the file first (`xacro robot.urdf.xacro > robot.urdf`), or install the extra"
    " `urdfkin[xacro]` and pass the .xacro file itself. Where kinematics does not look (the file name of a"
    " mesh, the name of the robot, what stands inside a <link>), the finding is a warning.",
    bad='<robot name="r" xmlns:xacro="http://ros.org/wiki/xacro">\n  <link name="base"/>\n'
    '  <xacro:leg prefix="left"/>\n</robot>\n',
    good='<robot name="r" xmlns:xacro="http://ros.org/wiki/xacro">\n  <link name="base"/>\n</robot>\n',
    others="Pinocchio reads it: the macro's joints are missing; yourdfpy reads it likewise.",
)

VERSION = Code(
    "URDF203",
    "urdf-version",
    ERROR,
    "the URDF version is not one that exists",
    why="The version says which rules the file follows. There are 1.0, 1.1 (quat_xyzw, capsules) and 1.2"
    " (further limits); anything else cannot be read with confidence.",
    bad='<robot name="r" version="2.0">\n  <link name="base"/>\n</robot>\n',
    good='<robot name="r" version="1.0">\n  <link name="base"/>\n</robot>\n',
    others="Pinocchio refuses it; yourdfpy reads it: it does not look at the version.",
)

NEWER_VERSION = Code(
    "URDF204",
    "newer-urdf-version",
    WARNING,
    "the URDF version is newer than what most readers know",
    why="urdfdom before 6 refuses every version but 1.0, and so do the programs built on it. urdfkin follows"
    " urdfdom 6, which Pinocchio 4 uses.",
    bad='<robot name="r" version="1.1">\n  <link name="base"/>\n</robot>\n',
    good='<robot name="r">\n  <link name="base"/>\n</robot>\n',
    others="Pinocchio reads it; yourdfpy reads it: it does not look at the version.",
)

NO_LINKS = Code(
    "URDF205",
    "no-links",
    ERROR,
    "the robot has no link",
    why="A robot is at least one link. A <robot> with groups and no links is an SRDF, which goes with a URDF"
    " and does not replace it.",
    bad='<robot name="r">\n  <group name="arm"/>\n</robot>\n',
    good='<robot name="r">\n  <link name="base"/>\n</robot>\n',
    others="Pinocchio refuses it; yourdfpy reads it: a robot of nothing.",
)

MISPLACED = Code(
    "URDF206",
    "misplaced-element",
    ERROR,
    "a link or joint stands where no reader looks for it",
    why="Links and joints are children of <robot>, written in lower case. Anywhere else they are skipped in"
    " silence, and a part of the robot is missing.",
    bad='<robot name="r">\n  <link name="base"/>\n  <group>\n    <link name="arm"/>\n  </group>\n</robot>\n',
    good='<robot name="r">\n  <link name="base"/>\n</robot>\n',
    others="Pinocchio reads it: the element is missing; yourdfpy reads it likewise.",
)

UNKNOWN_ELEMENT = Code(
    "URDF207",
    "unknown-element",
    WARNING,
    "an element that URDF does not define",
    why="Readers skip it, so a misspelt element loses what it says. Extensions that simulators and vendors"
    " are known to add are a note.",
    bad='<joint name="j" type="fixed">\n  <parent link="base"/>\n  <child link="tip"/>\n'
    '  <orgin xyz="0 0 1"/>\n</joint>\n',
    good='<joint name="j" type="fixed">\n  <parent link="base"/>\n  <child link="tip"/>\n'
    '  <origin xyz="0 0 1"/>\n</joint>\n',
    others="Pinocchio reads it: the element is skipped; yourdfpy reads it likewise.",
)

UNKNOWN_ATTRIBUTE = Code(
    "URDF208",
    "unknown-attribute",
    WARNING,
    "an attribute that URDF does not define",
    why="Readers skip it, so the value that was meant is lost when the name is misspelt. Extensions that"
    " simulators and vendors are known to add are a note.",
    bad='<joint name="j" type="fixed">\n  <parent link="base"/>\n  <child link="tip"/>\n'
    '  <origin xyz="0 0 1" rpyy="0 0 1"/>\n</joint>\n',
    good='<joint name="j" type="fixed">\n  <parent link="base"/>\n  <child link="tip"/>\n'
    '  <origin xyz="0 0 1" rpy="0 0 1"/>\n</joint>\n',
    others="Pinocchio reads it: the attribute is skipped; yourdfpy reads it likewise.",
)

DUPLICATE_ELEMENT = Code(
    "URDF209",
    "duplicate-element",
    WARNING,
    "an element is given twice where one is meant",
    why="Every reader takes the first and skips the rest; the author probably meant the last.",
    bad='<joint name="j" type="fixed">\n  <parent link="base"/>\n  <child link="tip"/>\n'
    '  <origin xyz="0 0 1"/>\n  <origin xyz="0 0 2"/>\n</joint>\n',
    good='<joint name="j" type="fixed">\n  <parent link="base"/>\n  <child link="tip"/>\n'
    '  <origin xyz="0 0 1"/>\n</joint>\n',
    others="Pinocchio reads it: the first counts; yourdfpy reads it likewise.",
)

MISSING_ELEMENT = Code(
    "URDF210",
    "missing-element",
    ERROR,
    "a joint lacks its <parent> or <child>",
    why="A joint connects a parent link with a child link; without one of them it connects nothing.",
    bad='<joint name="j" type="fixed">\n  <child link="tip"/>\n</joint>\n',
    good='<joint name="j" type="fixed">\n  <parent link="base"/>\n  <child link="tip"/>\n</joint>\n',
    others="Pinocchio refuses it; yourdfpy refuses it.",
)

MISSING_ATTRIBUTE = Code(
    "URDF211",
    "missing-attribute",
    ERROR,
    "a required attribute is missing",
    why="There is no default for it: a joint's type, a limit's effort and velocity, the joint that is"
    " mimicked. urdfdom refuses the file.",
    bad='<joint name="j" type="fixed">\n  <parent>base</parent>\n  <child link="tip"/>\n</joint>\n',
    good='<joint name="j" type="fixed">\n  <parent link="base"/>\n  <child link="tip"/>\n</joint>\n',
    others="Pinocchio refuses it; yourdfpy reads it: the joint's parent is None.",
)

STRAY_TEXT = Code(
    "URDF212",
    "stray-text",
    WARNING,
    "text between tags, where URDF keeps every value in attributes",
    why="Text between tags is skipped: the value in it is lost. SDF writes values that way, URDF does not."
    " When an origin or an axis has text and no attribute, the value that was meant is certain to be lost,"
    " and the finding is an error.",
    bad='<joint name="j" type="fixed">\n  <parent link="base"/>\n  <child link="tip"/>\n'
    "  <origin>0 0 1</origin>\n</joint>\n",
    good='<joint name="j" type="fixed">\n  <parent link="base"/>\n  <child link="tip"/>\n'
    '  <origin xyz="0 0 1"/>\n</joint>\n',
    others="Pinocchio reads it: the text is skipped; yourdfpy reads it likewise.",
)

NAMESPACE = Code(
    "URDF213",
    "default-namespace",
    WARNING,
    "the elements are put into an XML namespace",
    why="URDF has no namespace. urdfdom does not look at it, but readers that know namespaces find no links.",
    bad='<robot name="r" xmlns="http://example.org/urdf">\n  <link name="base"/>\n</robot>\n',
    good='<robot name="r">\n  <link name="base"/>\n</robot>\n',
    others="Pinocchio reads it; yourdfpy reads it: a robot without links.",
)

UNDECLARED_PREFIX = Code(
    "URDF214",
    "undeclared-prefix",
    WARNING,
    "a prefix that no xmlns declares",
    why="urdfdom takes <drake:x> for a name like any other. Readers that know namespaces, which most XML"
    " libraries are, refuse the whole file or repair it by guessing.",
    bad='<robot name="r">\n  <link name="base"/>\n  <drake:joint name="j"/>\n</robot>\n',
    good='<robot name="r" xmlns:drake="http://drake.mit.edu">\n  <link name="base"/>\n'
    '  <drake:joint name="j"/>\n</robot>\n',
    others="Pinocchio reads it; yourdfpy reads it: a second parser recovers what it can.",
)
