"""URDF1xx: the file as bytes and as XML, before anyone asks what it means."""

from urdfkin.lint.rule import ERROR, NOTE, REFUSES, WARNING, Code

_ROBOT = '<robot name="example">\n  <link name="base"/>\n</robot>\n'

EMPTY = Code(
    "URDF101",
    "empty-file",
    ERROR,
    "the file is empty or holds only blanks",
    why="There is nothing to read. Usually a failed export, or a pipe whose first command printed nothing.",
    bad="   \n",
    good=_ROBOT,
    others="Pinocchio refuses it; yourdfpy refuses it.",
)

ENCODING = Code(
    "URDF102",
    "not-utf8",
    ERROR,
    "the bytes are not UTF-8 text",
    why="A URDF is UTF-8. urdfdom ignores what the XML declaration says about the encoding and takes the"
    " bytes as they are, so a name in another encoding is a different name in each reader. A zero byte ends"
    " the file for some readers and not for others: they would see two different robots.",
    bad='<robot name="example">\n  <link name="base"/>\n</robot>\n\x00<joint name="hidden"/>\n',
    good=_ROBOT,
    others="Pinocchio reads it up to the zero byte; yourdfpy reads it: it recovers what it can.",
)

DECLARED = Code(
    "URDF103",
    "declared-encoding",
    ERROR,
    "the XML declaration names an encoding that is not UTF-8",
    why="XML readers obey the declaration, urdfdom does not. With any character outside ASCII the two read"
    " different names.",
    bad='<?xml version="1.0" encoding="UTF-16"?>\n' + _ROBOT,
    good='<?xml version="1.0" encoding="UTF-8"?>\n' + _ROBOT,
    others="Pinocchio reads it and ignores the declaration; yourdfpy refuses it.",
)

DECLARED_ASCII = Code(
    "URDF104",
    "declared-encoding-unused",
    WARNING,
    "the XML declaration names another encoding, but the text is plain ASCII",
    why="Harmless as long as every character is ASCII. The first umlaut in a name will be read differently by"
    " urdfdom, which ignores the declaration, and by everyone else.",
    bad='<?xml version="1.0" encoding="ISO-8859-1"?>\n' + _ROBOT,
    good='<?xml version="1.0" encoding="UTF-8"?>\n' + _ROBOT,
    others="Pinocchio reads it; yourdfpy reads it.",
)

SYNTAX = Code(
    "URDF105",
    "xml-syntax",
    ERROR,
    "the file is not well-formed XML",
    why="Readers that go on after a syntax error guess, and two readers guess differently: a file cut in the"
    " middle may look like a smaller robot. urdfkin never repairs.",
    bad='<robot name="example">\n  <link name="base">\n</robot>\n',
    good=_ROBOT,
    others="Pinocchio refuses it; yourdfpy reads it: a second parser recovers what it can.",
)

ENTITY = Code(
    "URDF106",
    "entity",
    ERROR,
    "the file declares or uses entities, or refers to an external definition",
    why="Entities can read files, open network connections and grow to gigabytes while they are expanded."
    " A URDF needs none. urdfkin never expands an entity and never opens what a file refers to. urdfdom keeps"
    " the reference as literal text, so even a harmless entity gives two readers two names.",
    bad='<!DOCTYPE robot [<!ENTITY n "tool">]>\n<robot name="example">\n  <link name="&n;"/>\n</robot>\n',
    good='<robot name="example">\n  <link name="tool"/>\n</robot>\n',
    others="Pinocchio reads it and keeps '&n;' as text; yourdfpy reads it and expands the entity.",
)

DOCTYPE = Code(
    "URDF107",
    "doctype",
    WARNING,
    "a document type declaration without content",
    why="It has no meaning in a URDF and is ignored. With content it would be an error (URDF106).",
    bad="<!DOCTYPE robot>\n" + _ROBOT,
    good=_ROBOT,
    others="Pinocchio reads it; yourdfpy reads it.",
)

TOO_LARGE = Code(
    "URDF108",
    "too-large",
    ERROR,
    "the file is larger than the limit allows",
    why="The limit, 100,000,000 bytes, keeps a hostile or broken file from taking all memory and time. No"
    " real robot comes near it; it can be raised: --max-bytes, or `Limits` in the library. The example is"
    " checked with a limit of 100 bytes.",
    bad='<robot name="example">\n  <link name="base"/>\n' + 4 * f"  <!-- {'-+' * 10} -->\n" + "</robot>\n",
    good=_ROBOT,
    others="Pinocchio reads it; yourdfpy reads it.",
)

DEEP_NESTING = Code(
    "URDF109",
    "deep-nesting",
    WARNING,
    "elements are nested deeper than common readers accept",
    why="The robot can be computed, but programs built on an older libxml2 refuse more than 256 levels, and"
    " urdfdom refuses more than 498.",
    bad='<robot name="example">\n  <link name="base"/>\n' + "<a>" * 300 + "</a>" * 300 + "\n</robot>\n",
    good=_ROBOT,
    others="Pinocchio reads it: up to 498 levels; yourdfpy reads it.",
)

TOO_DEEP_FOR_ORACLE = Code(
    "URDF110",
    "too-deep-for-pinocchio",
    WARNING,
    "elements are nested deeper than urdfdom reads",
    why="Only seen when --max-depth is raised. The robot can be computed, but Pinocchio cannot read the file,"
    " so nothing can be verified.",
    bad='<robot name="example">\n  <link name="base"/>\n' + "<a>" * 600 + "</a>" * 600 + "\n</robot>\n",
    good=_ROBOT,
    others="Pinocchio refuses it; yourdfpy reads it.",
    oracle=REFUSES,
)

XML_VERSION = Code(
    "URDF111",
    "xml-version",
    WARNING,
    "the XML declaration names a version other than 1.0",
    why="A URDF is XML 1.0. urdfdom does not look; strict XML readers may refuse.",
    bad='<?xml version="1.1"?>\n' + _ROBOT,
    good='<?xml version="1.0"?>\n' + _ROBOT,
    others="Pinocchio reads it; yourdfpy reads it.",
)

INCLUDE = Code(
    "URDF112",
    "include",
    ERROR,
    "the file includes another file",
    why="urdfkin reads the bytes it is given and opens nothing else. A part that is not included would be"
    " missing from the robot in silence.",
    bad='<robot name="example" xmlns:xi="http://www.w3.org/2001/XInclude">\n  <link name="base"/>\n'
    '  <xi:include href="arm.urdf"/>\n</robot>\n',
    good=_ROBOT,
    others="Pinocchio reads it: the part is missing without a word; yourdfpy reads it likewise.",
)

BYTE_ORDER_MARK = Code(
    "URDF113",
    "byte-order-mark",
    NOTE,
    "a byte order mark stands before the text",
    why="Allowed by XML and skipped. Some scripts that look for '<' at the very beginning stumble over it.",
    bad="\ufeff" + _ROBOT,
    good=_ROBOT,
    others="Pinocchio reads it; yourdfpy reads it.",
)

TOO_MANY_ELEMENTS = Code(
    "URDF114",
    "too-many-elements",
    ERROR,
    "there are more elements than the limit allows",
    why="The limit, 1,000,000 elements, keeps a hostile or broken file from taking all memory: an element of"
    " a few bytes takes some hundred while it is checked. No real robot comes near it; it can be raised:"
    " --max-elements, or `Limits` in the library. The example is checked with a limit of 10 elements.",
    bad='<robot name="example">\n' + "".join(f'  <link name="l{i}"/>\n' for i in range(11)) + "</robot>\n",
    good=_ROBOT,
    others="Pinocchio refuses it: its links are not connected; yourdfpy reads it.",
)

TOO_DEEP = Code(
    "URDF115",
    "too-deep",
    ERROR,
    "elements are nested deeper than the limit allows",
    why="The limit, 498 levels, is that of urdfdom's parser. A URDF needs seven; it can be raised:"
    " --max-depth, or `Limits` in the library, and then nothing can be verified (URDF110).",
    bad='<robot name="example">\n  <link name="base"/>\n' + "<a>" * 500 + "</a>" * 500 + "\n</robot>\n",
    good=_ROBOT,
    others="Pinocchio refuses it: 498 levels are the most its parser takes; yourdfpy reads it.",
)

TOO_MANY_ATTRIBUTES = Code(
    "URDF116",
    "too-many-attributes",
    ERROR,
    "an element has more attributes than the limit allows",
    why="The limit, 200, is far from the seven that an element of URDF has at most. Extensions that need more"
    " can raise it: --max-attributes, or `Limits` in the library.",
    bad='<robot name="example">\n  <link name="base"/>\n  <gazebo\n'
    + "".join(f'    a{i}=""\n' for i in range(201))
    + "  />\n</robot>\n",
    good=_ROBOT,
    others="Pinocchio reads it; yourdfpy reads it.",
)

NAME_TOO_LONG = Code(
    "URDF117",
    "name-too-long",
    ERROR,
    "a name is longer than the limit allows",
    why="The limit, 10,000 characters, holds for names of links, joints, elements and attributes, which are"
    " compared with others to find the one that was meant. It can be raised: --max-name, or `Limits` in the"
    " library. From 200 characters on, a name is odd (URDF405).",
    bad=f'<robot name="example">\n  <link name="{"very_" * 2001}long"/>\n</robot>\n',
    good='<robot name="example">\n  <link name="long"/>\n</robot>\n',
    others="Pinocchio reads it; yourdfpy reads it.",
)

INSTRUCTION = Code(
    "URDF118",
    "processing-instruction",
    WARNING,
    "a processing instruction after the beginning of the file",
    why="XML allows <?...?> anywhere. urdfdom's parser takes each for a declaration, which may only stand"
    " before every element, comment and document type, and refuses the whole file. The robot is computed, but"
    " Pinocchio cannot read it, so nothing can be verified.",
    bad='<robot name="example">\n  <link name="base"/>\n  <?editor tab=2?>\n</robot>\n',
    good="<?editor tab=2?>\n" + _ROBOT,
    others="Pinocchio refuses it; yourdfpy reads it.",
    oracle=REFUSES,
)

MARKUP_TOO_LONG = Code(
    "URDF119",
    "markup-too-long",
    ERROR,
    "a tag, comment or instruction is longer than the limit allows",
    why="The limit, 10,000,000 bytes, is that of libxml2, which most readers are built on. What is longer"
    " is read again and again until its end is found. It can be raised: --max-markup, or `Limits` in the"
    " library. The example is checked with a limit of 100 bytes.",
    bad=f'<robot name="example">\n  <link name="base"/>\n  <!-- {"-+" * 100} -->\n</robot>\n',
    good=_ROBOT,
    others="Pinocchio reads it; yourdfpy reads it.",
)
