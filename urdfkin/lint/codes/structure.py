"""URDF4xx: names, and how joints connect links into one tree."""

from urdfkin.lint.rule import DIFFERS, ERROR, WARNING, Code


def _fixed(name: str, parent: str, child: str) -> str:
    ends = f'  <parent link="{parent}"/>\n  <child link="{child}"/>\n'
    return f'<joint name="{name}" type="fixed">\n{ends}</joint>\n'


MISSING_NAME = Code(
    "URDF401",
    "missing-name",
    ERROR,
    "a robot, link or joint has no name, or an empty one",
    why="Links and joints are found by their names. urdfdom refuses a missing one, and an empty one cannot be"
    " referred to.",
    bad='<link name=""/>\n',
    good='<link name="base"/>\n',
    others="Pinocchio reads it: an empty name, which no joint may refer to; yourdfpy reads it likewise.",
)

DUPLICATE_NAME = Code(
    "URDF402",
    "duplicate-name",
    ERROR,
    "two links, or two joints, share a name",
    why="A name must say which one is meant. A link and a joint may share a name; two links may not.",
    bad='<link name="base"/>\n<link name="base"/>\n',
    good='<link name="base"/>\n',
    others="Pinocchio refuses it; yourdfpy reads it: the last one replaces the first.",
)

RESERVED_NAME = Code(
    "URDF403",
    "reserved-name",
    WARNING,
    "a name that Pinocchio gives to its own frames",
    why="Pinocchio calls the world 'universe' and a free base's joint 'root_joint'. When the robot is loaded"
    " with a root joint, the names clash, and this becomes an error.",
    bad=_fixed("root_joint", "base", "tip"),
    good=_fixed("mount", "base", "tip"),
    others="Pinocchio reads it; yourdfpy reads it.",
)

UNIVERSE = Code(
    "URDF404",
    "name-universe",
    WARNING,
    "a joint is called 'universe', as Pinocchio calls the world",
    why="Pinocchio finds a joint by its name, and the world comes first: asked for this one it answers with"
    " the world, and a fixed joint of this name vanishes. Results of the robot cannot be verified.",
    bad=_fixed("universe", "base", "tip"),
    good=_fixed("mount", "base", "tip"),
    others="Pinocchio reads it: the frame is lost; yourdfpy reads it.",
    oracle=DIFFERS,
)

ODD_NAME = Code(
    "URDF405",
    "odd-name",
    WARNING,
    "a name that other programs will stumble over",
    why="Legal, but: control characters and direction marks make a terminal show another name than the one in"
    " the file; slashes look like paths or ROS namespaces; a leading = + - @ is a formula to a spreadsheet;"
    " blanks at the ends are invisible. urdfkin escapes names wherever it prints them and never uses them as"
    " paths.",
    bad='<link name="../../etc/passwd"/>\n',
    good='<link name="base"/>\n',
    others="Pinocchio reads it; yourdfpy reads it.",
)

NAME_BLANKS = Code(
    "URDF406",
    "line-break-in-name",
    WARNING,
    "a tab or line end stands inside a name",
    why="XML turns it into a space, urdfdom keeps it: the two see different names, so frames of Pinocchio"
    " cannot be matched with those of the file.",
    bad='<link name="left\n arm"/>\n',
    good='<link name="left_arm"/>\n',
    others="Pinocchio reads it with the line end in the name; yourdfpy reads it with a space.",
    oracle=DIFFERS,
)

LOOKALIKE = Code(
    "URDF407",
    "lookalike-names",
    WARNING,
    "two names look the same and are not",
    why="One letter can be written as one character or as a letter and an accent. The two names look alike"
    " and are different for every reader.",
    bad='<link name="b\u00e4se"/>\n<link name="ba\u0308se"/>\n' + _fixed("j", "b\u00e4se", "ba\u0308se"),
    good='<link name="b\u00e4se"/>\n<link name="arm"/>\n' + _fixed("j", "b\u00e4se", "arm"),
    others="Pinocchio reads it; yourdfpy reads it.",
)

UNKNOWN_LINK = Code(
    "URDF408",
    "unknown-link",
    ERROR,
    "a joint refers to a link that does not exist",
    why="Every link must be written out, even an empty one.",
    bad=_fixed("j", "bsae", "tip"),
    good=_fixed("j", "base", "tip"),
    others="Pinocchio refuses it; yourdfpy reads it: it attaches the link to nothing.",
)

SELF_PARENT = Code(
    "URDF409",
    "self-parent",
    ERROR,
    "a joint connects a link with itself",
    why="The link would be its own parent: a loop of one.",
    bad=_fixed("j", "base", "tip") + _fixed("k", "tip", "tip"),
    good=_fixed("j", "base", "tip"),
    others="Pinocchio refuses it: with other names it follows the loop and dies; yourdfpy reads it.",
)

SEVERAL_PARENTS = Code(
    "URDF410",
    "several-parents",
    ERROR,
    "a link is the child of more than one joint",
    why="A URDF is a tree. A closed chain cannot be written in it; which joint counts would depend on the"
    " reader.",
    bad='<link name="base"/>\n<link name="arm"/>\n<link name="tip"/>\n'
    + _fixed("i", "base", "arm")
    + _fixed("j", "arm", "tip")
    + _fixed("k", "base", "tip"),
    good='<link name="base"/>\n<link name="arm"/>\n<link name="tip"/>\n'
    + _fixed("i", "base", "arm")
    + _fixed("j", "arm", "tip"),
    others="Pinocchio reads it: urdfdom lets the last joint by name win; yourdfpy reads it likewise.",
)

SEVERAL_ROOTS = Code(
    "URDF411",
    "several-roots",
    ERROR,
    "more than one link has no parent",
    why="One link is the root, every other one is the child of a joint. A stray link is usually the sign of a"
    " joint that is missing or misspelt.",
    bad='<link name="base"/>\n<link name="stray"/>\n',
    good='<link name="base"/>\n',
    others="Pinocchio refuses it; yourdfpy reads it: it takes one of the two.",
)

CYCLE = Code(
    "URDF412",
    "cycle",
    ERROR,
    "the joints close a loop",
    why="A URDF is a tree: from the root every link is reached in one way. A loop has no placement at all,"
    " and it can kill a reader that follows it.",
    bad=_fixed("j", "base", "tip") + _fixed("k", "tip", "base"),
    good=_fixed("j", "base", "tip"),
    others="Pinocchio refuses it: a loop below a root, though, kills the process; yourdfpy reads it.",
)
