"""Root element, version, xacro, elements, attributes, prefixes, names and comments."""

from tests.urdf.lint.cases.arm import ACCEPT, LIMIT, MESH, REJECT, SPHERE, WARN, Case, arm, axis, fixed

_INCLUDE = '<xi:include xmlns:xi="http://www.w3.org/2001/XInclude" href="/etc/passwd"/>'
_XACRO = 'name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"'
_IGNORE_COMMENT = "<!-- urdfkin: ignore[{}] as drawn -->"
_LONG = '<axis xyz="0 0 2"/>'
_CP1252 = '<?xml version="1.0" encoding="cp1252"?>\n'


def _with_link(name: str) -> str:
    """Write the arm with an additional link of this name."""
    return arm(more=f'<link name="{name}"/>' + fixed("k", "tool", name))


def _with_comment(comment: str, text: str = arm(axis=_LONG)) -> str:
    """Write the arm with a comment on its own line before joint j1, whose axis is too long."""
    return text.replace('  <joint name="j1"', f'  {comment}\n  <joint name="j1"')


_SILENCED_ERROR = _with_comment(_IGNORE_COMMENT.format("URDF502"), axis("0 0 0"))

CASES = [
    # Other formats, xacro, versions.
    Case("sdf", '<sdf version="1.6"><model name="m"/></sdf>', REJECT, "URDF201:1"),
    Case("mjcf", "<mujoco><worldbody/></mujoco>", REJECT, "URDF201:1"),
    Case("capital-robot", arm().replace("robot", "Robot"), REJECT, "URDF201:2"),
    Case("xinclude", arm(more=_INCLUDE), REJECT, "URDF112:8"),
    Case("xacro-other-prefix", arm(robot=_XACRO.replace("s:xacro", "s:x"), more="<x:macro/>"), REJECT),
    Case("xacro-property", arm(robot=_XACRO, more='<xacro:property name="a" value="1"/>'), REJECT),
    Case("xacro-expression", arm(robot=_XACRO, origin='<origin xyz="0 0 ${h}"/>'), REJECT, "URDF202:6"),
    Case("xacro-expression-in-name", arm(base='<link name="${p}base"/>'), REJECT, "URDF202:3"),
    Case("xacro-expression-in-mesh", arm(base=MESH.format("$(arg side)/a.stl")), WARN, "URDF202:3"),
    Case("xacro-expression-in-material", arm(more='<material name="${c}"/>'), WARN, "URDF202:8"),
    Case("xacro-expression-in-robot", arm(robot='name="$(arg name)"'), WARN, "URDF202:2"),
    Case("xacro-expression-in-mimicked-joint", arm(follow='<mimic joint="${p}j1"/>'), REJECT, "URDF202:7"),
    Case("xacro-expressions-both", arm(base=MESH.format("${m}"), axis='<axis xyz="${a}"/>'), REJECT),
    Case("xacro-macro-in-link", arm(base='<link name="base"><xacro:mass m="1"/></link>'), WARN),
    Case("xacro-macro-in-joint", arm(inside="<xacro:origin/>"), REJECT, "URDF202:6"),
    Case("xacro-never-closed", arm(more='<material name="${"/>'), ACCEPT),
    Case("dollar-in-gazebo", arm(more='<gazebo><plugin name="$(arg x)"/></gazebo>'), ACCEPT),
    Case("version-1.1", arm(robot='name="r" version="1.1"'), WARN, "URDF204:2"),
    Case("version-1.2", arm(robot='name="r" version="1.2"'), WARN, "URDF204:2"),
    Case("version-2.0", arm(robot='name="r" version="2.0"'), REJECT, "URDF203:2"),
    Case("version-0.9", arm(robot='name="r" version="0.9"'), REJECT, "URDF203:2"),
    Case("version-1", arm(robot='name="r" version="1"'), REJECT, "URDF203:2"),
    Case("version-empty", arm(robot='name="r" version=""'), REJECT, "URDF203:2"),
    Case("version-three", arm(robot='name="r" version="1.0.0"'), REJECT, "URDF203:2"),
    Case("default-namespace", arm(robot='name="r" xmlns="http://example.org"'), WARN, "URDF213:2"),
    # Elements and attributes.
    Case("capital-link", arm(more='<Link name="x"/>'), REJECT, "URDF206:8"),
    Case("misspelt-joint", arm(more='<jiont name="x" type="fixed"/>'), REJECT, "URDF206:8"),
    Case("joint-in-link", arm(base=f'<link name="base">{fixed("n", "a", "b")}</link>'), REJECT),
    Case("robot-in-robot", arm(more='<robot name="s"><link name="z"/></robot>'), REJECT, "URDF206:8"),
    Case("joint-in-transmission", arm(more='<transmission><joint name="j1"/></transmission>'), ACCEPT),
    Case("links-in-gazebo", arm(more='<gazebo><model><link name="g"/></model></gazebo>'), ACCEPT),
    Case("loop-joint-extension", arm(more='<loop_joint name="c" type="ball"/>'), WARN, "URDF207:8"),
    Case("known-extension", arm(base='<link name="base"><contact/></link>'), ACCEPT, "URDF207:3"),
    Case("unknown-attribute", arm(attributes='type="fixed" colour="red"'), WARN, "URDF208:6"),
    Case("misspelt-origin", arm(origin='<orign xyz="1 0 0"/>'), WARN, "URDF207:6"),
    Case("capital-origin", arm(origin='<Origin xyz="1 0 0"/>'), WARN, "URDF207:6"),
    Case("misspelt-rpy", arm(origin='<origin rp="1 0 0"/>'), WARN, "URDF208:6"),
    Case("transposed-xyz", arm(origin='<origin xzy="1 0 0"/>'), WARN, "URDF208:6"),
    Case("sdf-pose", arm(origin="<pose>0 0 1 0 0 0</pose>"), WARN, "URDF207:6"),
    Case("origin-as-text", arm(origin="<origin>0 0 1</origin>"), REJECT, "URDF212:6"),
    Case("axis-as-text", arm(axis="<axis>0 0 1</axis>"), REJECT, "URDF212:6"),
    Case("axis-sdf-style", arm(axis="<axis><xyz>0 0 1</xyz></axis>"), REJECT, "URDF212:6"),
    Case("text-in-robot", arm(more="hello"), WARN, "URDF212:2"),
    Case("two-limits", arm(inside=LIMIT), WARN, "URDF209:6"),
    Case("two-parents-in-a-joint", arm(inside='<parent link="tool"/>'), WARN, "URDF209:6"),
    Case("two-visuals", arm(base=f'<link name="base">{SPHERE * 2}</link>'), ACCEPT),
    Case("mimic-twice", arm(follow='<mimic joint="j1"/><mimic joint="j1"/>'), WARN, "URDF209:7"),
    # Prefixes.
    Case("prefixed-extension", arm(robot='name="r" xmlns:d="http://d"', more="<d:joint/>"), ACCEPT),
    # Names.
    Case("no-robot-name", arm(robot=""), REJECT, "URDF401:2"),
    Case("empty-robot-name", arm(robot='name=""'), WARN, "URDF405:2"),
    Case("duplicate-link", arm(more='<link name="l1"/>'), REJECT, "URDF402:8"),
    Case("duplicate-joint", arm(more='<link name="x"/>' + fixed("j1", "base", "x")), REJECT, "URDF402:8"),
    Case("joint-without-name", arm(more='<link name="x"/>' + fixed("", "base", "x")), REJECT, "URDF401:8"),
    Case("link-universe", arm(more='<link name="universe"/>' + fixed("u", "tool", "universe")), WARN),
    Case("joint-universe", arm(more='<link name="x"/>' + fixed("universe", "tool", "x")), WARN, "URDF404:8"),
    Case("name-with-blank-end", _with_link("x "), WARN, "URDF405:8"),
    Case("name-escape-sequence", _with_link("&#x9b;31m"), WARN),
    Case("name-line-end", _with_link("a\nb"), WARN, "URDF406:8"),
    Case("name-shell", _with_link("$(rm x)"), WARN),
    Case("name-html", _with_link("&lt;b&gt;"), WARN),
    Case("name-very-long", _with_link("n" * 5000), WARN),
    # Comments that silence findings.
    Case("silenced-before-the-joint", _with_comment(_IGNORE_COMMENT.format("URDF503")), ACCEPT),
    Case("silenced-by-its-name", _with_comment(_IGNORE_COMMENT.format("axis-not-unit")), ACCEPT),
    Case(
        "silenced-with-others", _with_comment(_IGNORE_COMMENT.format("URDF601, URDF503")), ACCEPT, "URDF121:6"
    ),
    Case(
        "silenced-behind-it", arm(axis=_LONG).replace("t>", "t> " + _IGNORE_COMMENT.format("503"), 1), ACCEPT
    ),
    Case("silenced-for-the-file", arm(head=_CP1252 + _IGNORE_COMMENT.format("104 503"), axis=_LONG), ACCEPT),
    Case(
        "silenced-elsewhere",
        arm(axis=_LONG, more=_IGNORE_COMMENT.format("URDF503")),
        WARN,
        "URDF503:6 URDF121:8",
    ),
    Case(
        "silenced-another-code", _with_comment(_IGNORE_COMMENT.format("URDF601")), WARN, "URDF503:7 URDF121:6"
    ),
    Case("silenced-without-a-reason", _with_comment("<!--urdfkin: ignore[503]-->"), WARN, "URDF120:6"),
    Case("silenced-no-code", _with_comment(_IGNORE_COMMENT.format("")), WARN, "URDF120:6 URDF503:7"),
    Case(
        "silenced-unknown-code", _with_comment(_IGNORE_COMMENT.format("URDF5O3")), WARN, "URDF120:6 URDF503:7"
    ),
    Case("silence-not-understood", _with_comment("<!-- urdfkin: noqa -->"), WARN, "URDF120:6"),
    Case("an-error-cannot-be-silenced", _SILENCED_ERROR, REJECT, "URDF502:7 URDF121:6"),
    Case("a-comment-for-others", _with_comment("<!-- noqa: URDF503 urdfkin: ignore -->"), WARN, "URDF503:7"),
]
