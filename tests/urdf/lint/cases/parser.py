"""Bytes, XML, numbers, links and joints."""

from tests.urdf.lint.cases.arm import ACCEPT, REJECT, WARN, Case, arm, axis, bounds, follows, limit, xyz

_PLAIN = arm()
_UTF16 = _PLAIN.replace("<?xml", '<?xml encoding="UTF-16"').encode("utf-16")
_NEW = 'name="r" version="1.2"'
#: A DTD with a default value of an attribute, and a DTD with an entity that reads a file.
_DEFAULT = '<!DOCTYPE robot [<!ATTLIST origin xyz CDATA "9 9 9">]>'
_ENTITY = '<!DOCTYPE r [<!ENTITY % p SYSTEM "file:///etc/passwd">%p;]>'

_BAD = {
    "infinity": "inf 0 0", "negative-infinity": "-Infinity 0 0", "overflow": "1e400 0 0",
    "comma-decimal": "0,5 0 0", "commas": "0,0,1", "underscore": "1_0 0 0", "plus-plus": "++1 0 0",
    "no-mantissa": "e5 0 0", "no-exponent": "1e 0 0", "only-a-point": ". 0 0", "octal": "0o7 0 0",
    "fraction": "1/2 0 0", "expression": "pi/2 0 0", "wide-digits": "\uff11 0 0",
    "unicode-minus": "\u22121 0 0", "no-break-space": "0\u00a00 1", "unit": "100mm 0 0",
    "hex-float": "0x1p-3 0 0",
}  # fmt: skip


def origin(attributes: str, version: str = "1.0") -> str:
    return arm(robot=f'name="r" version="{version}"', origin=f"<origin {attributes}/>")


CASES = [
    # Bytes.
    Case("only-a-mark", b"\xef\xbb\xbf", REJECT),
    Case("empty", b"", REJECT, "URDF101:1"),
    Case("utf16-with-mark", _UTF16, REJECT, "URDF102:1"),
    Case("utf16-without-mark", _PLAIN.encode("utf-16-le"), REJECT, "URDF102:1"),
    Case("utf32", _PLAIN.encode("utf-32"), REJECT, "URDF102:1"),
    Case("latin1-undeclared", arm(base='<link name="base" f="\xf6"/>').encode("latin-1"), REJECT),
    Case("overlong-utf8", b"<robot name='\xc0\xaf'><link name='a'/></robot>", REJECT, "URDF102:1"),
    Case("zero-byte-at-the-end", _PLAIN.encode() + b"\0", REJECT, "URDF102:10"),
    Case("zero-byte-after-returns", _PLAIN.replace("\n", "\r").encode() + b"\0", REJECT, "URDF102:10"),
    Case("declared-us-ascii", arm(head='<?xml version="1.0" encoding="US-ASCII"?>'), ACCEPT),
    Case("declared-utf8-small", arm(head="<?xml version='1.0' encoding='utf8'?>"), ACCEPT),
    Case("declared-cp1252-ascii", arm(head='<?xml version="1.0" encoding="cp1252"?>'), WARN),
    Case("declared-utf16-lie", arm(head='<?xml version="1.0" encoding="UTF-16"?>'), REJECT),
    Case("declared-nonsense", arm(head='<?xml version="1.0" encoding="foo-8"?>'), REJECT, "URDF103:1"),
    Case("xml-1.1", arm(head='<?xml version="1.1"?>'), WARN, "URDF111:1"),
    # XML.
    Case("plain", _PLAIN, ACCEPT),
    Case("carriage-returns", _PLAIN.replace("\n", "\r"), ACCEPT),
    Case("cdata", arm(more="<gazebo><![CDATA[<joint/>]]></gazebo>"), ACCEPT),
    Case("stylesheet-instruction", arm(head="<?xml-stylesheet href='http://example.org/x'?>"), ACCEPT),
    Case("instruction-inside", arm(more="<?editor tab=2?>"), WARN, "URDF118:8"),
    Case("instruction-in-gazebo", arm(more="<gazebo>\n<?php echo ?></gazebo>"), WARN, "URDF118:9"),
    Case("instruction-after-a-comment", "<!-- c -->\n<?e?>\n" + arm(head=""), WARN, "URDF118:2"),
    Case("instruction-after-the-end", arm() + "<?e?>", WARN, "URDF118:10"),
    Case("double-dash-comment", arm(more="<!-- a -- b -->"), REJECT, "URDF105:8"),
    Case("two-robots", _PLAIN + "<robot name='s'><link name='a'/></robot>", REJECT, "URDF105:10"),
    Case("text-after-the-end", _PLAIN + "bye", REJECT, "URDF105:10"),
    Case("attribute-twice", arm(robot='name="r" name="s"'), REJECT, "URDF105:2"),
    Case("less-than-in-attribute", arm(robot='name="<"'), REJECT, "URDF105:2"),
    Case("crossed-tags", arm(more="<a><b></a></b>"), REJECT, "URDF105:8"),
    Case("undefined-entity", arm(robot='name="&foo;"'), REJECT, "URDF106:2"),
    Case("numeric-reference-to-nul", arm(robot='name="&#0;"'), REJECT, "URDF105:2"),
    Case("harmless-references", arm(robot='name="&#114;&amp;"'), ACCEPT),
    Case("doctype-system", '<!DOCTYPE robot SYSTEM "a.dtd">' + arm(head=""), REJECT, "URDF106:1"),
    Case("doctype-public", '<!DOCTYPE robot PUBLIC "p" "a.dtd">' + arm(head=""), REJECT),
    Case("doctype-empty-subset", "<!DOCTYPE robot []>" + arm(head=""), REJECT, "URDF106:1"),
    Case("doctype-attribute-default", _DEFAULT + arm(head=""), REJECT, "URDF106:1"),
    Case("parameter-entity", _ENTITY + arm(head=""), REJECT, "URDF106:1"),
    Case("nested-600", arm(more="<a>" * 600 + "</a>" * 600), REJECT, "URDF115:8"),
    Case("nested-100000", arm(more="<a>" * 100_000), REJECT, "URDF115:8"),
    Case("nested-100", arm(more="<a>" * 100 + "</a>" * 100), WARN),
    Case("long-attribute", arm(robot='name="r" note="' + "x" * 1_000_000 + '"'), WARN),
    # Numbers and vectors.
    *(Case(f"xyz-{name}", xyz(value), REJECT, "URDF301:6") for name, value in _BAD.items()),
    Case("xyz-one", xyz("1"), REJECT, "URDF302:6"),
    Case("xyz-four", xyz("1 2 3 4"), REJECT, "URDF302:6"),
    Case("xyz-odd-but-right", xyz("+1. .5e0 -0"), ACCEPT),
    Case("xyz-many-digits", xyz("0." + "1" * 400 + " 0 0"), ACCEPT),
    Case("xyz-underflow", xyz("1e-400 0 0"), WARN, "URDF304:6"),
    Case("xyz-line-end", xyz("1\n0 0"), WARN, "URDF303:6"),
    Case("xyz-tab-by-reference", xyz("1&#9;0 0"), WARN, "URDF303:6"),
    Case("xyz-spaces-around", xyz("  1 0 0  "), ACCEPT),
    Case("limit-trailing-blank", bounds('lower="-1 " upper="1"'), WARN, "URDF303:6"),
    Case("limit-leading-blank", bounds('lower=" -1" upper="1"'), ACCEPT),
    Case("limit-empty", bounds('lower="" upper="1"'), REJECT, "URDF301:6"),
    Case("limit-two-numbers", bounds('lower="-1 1" upper="1"'), REJECT),
    Case("effort-infinite", limit('lower="-1" upper="1" effort="inf" velocity="1"'), REJECT),
    Case("attribute-on-a-later-line", origin('\n rpy="0 0 0"\n xyz="a b c"'), REJECT, "URDF301:8"),
    Case("damping-no-number", arm(inside='<dynamics damping="x"/>'), REJECT, "URDF301:6"),
    Case("calibration-no-number", arm(inside='<calibration rising="x"/>'), REJECT, "URDF301:6"),
    Case("calibration-empty", arm(inside="<calibration/>"), ACCEPT),
    Case("dynamics-one-is-enough", arm(inside='<dynamics friction="0.1"/>'), ACCEPT),
    Case("axis-nan", axis("0 0 nan"), REJECT, "URDF301:6"),
    Case("quaternion-three", origin('quat_xyzw="0 0 1"', "1.1"), REJECT, "URDF302:6"),
    Case("mimic-nan", follows('joint="j1" multiplier="nan"'), REJECT, "URDF301:7"),
    # Links and joints.
    Case("version-1.2-needs-no-effort", arm(robot=_NEW, limit='<limit lower="-1" upper="1"/>'), WARN),
    Case("no-child", arm(ends='<parent link="base"/>'), REJECT, "URDF210:6"),
    Case("child-without-link", arm(ends='<parent link="base"/><child/>'), REJECT, "URDF211:6"),
    Case("no-type", arm(attributes=""), REJECT, "URDF211:6"),
    Case("safety-without-k", arm(inside="<safety_controller/>"), REJECT, "URDF211:6"),
    Case("type-capital", arm(attributes='type="Revolute"'), REJECT, "URDF501:6"),
    Case("type-blank", arm(attributes='type=" revolute"'), REJECT, "URDF501:6"),
    Case("type-screw", arm(attributes='type="screw"'), REJECT, "URDF501:6"),
    Case("axis-bad-on-fixed", axis("x", "fixed"), WARN, "URDF510:6"),
    Case("axis-empty-element", arm(axis="<axis/>"), REJECT, "URDF504:6"),
    Case("axis-other-attribute", arm(axis='<axis a="1">0 0 1</axis>'), REJECT, "URDF504:6"),
    Case("axis-empty-planar", arm(axis="<axis/>", attributes='type="planar"'), WARN, "URDF504:6"),
    Case("prismatic-without-limit", arm(attributes='type="prismatic"', limit=""), REJECT, "URDF506:6"),
    Case("limit-no-effort", limit('lower="-1" upper="1" velocity="1"'), REJECT, "URDF211:6"),
    Case("limit-partial-on-fixed", arm(attributes='type="fixed"', limit='<limit lower="0"/>'), REJECT),
    Case("version-1.2-needs-both-bounds", arm(robot=_NEW, limit='<limit lower="-1"/>'), REJECT, "URDF211:6"),
    Case("quaternion-zero", origin('quat_xyzw="0 0 0 0"', "1.1"), REJECT, "URDF513:6"),
    Case("quaternion-beside-rpy", origin('rpy="0 0 0" quat_xyzw="0 0 0 1"', "1.1"), REJECT, "URDF513:6"),
    Case("mimic-empty-joint", arm(follow='<mimic joint=""/>'), REJECT, "URDF211:7"),
]
