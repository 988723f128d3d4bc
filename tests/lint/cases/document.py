"""XML."""

from tests.lint.cases.arm import ACCEPT, REJECT, WARN, Case, arm

_PLAIN = arm()

CASES = [
    Case("plain", _PLAIN, ACCEPT),
    Case("carriage-returns", _PLAIN.replace("\n", "\r"), ACCEPT),
    Case("cdata", arm(more="<gazebo><![CDATA[<joint/>]]></gazebo>"), ACCEPT),
    Case("stylesheet-instruction", arm(head="<?xml-stylesheet href='http://example.org/x'?>"), ACCEPT),
    Case("instruction-inside", arm(more="<?editor tab=2?>"), WARN, [("URDF118", 8)]),
    Case("instruction-in-gazebo", arm(more="<gazebo>\n<?php echo ?></gazebo>"), WARN, [("URDF118", 9)]),
    Case("instruction-after-a-comment", "<!-- c -->\n<?e?>\n" + arm(head=""), WARN, [("URDF118", 2)]),
    Case("instruction-after-the-end", arm() + "<?e?>", WARN, [("URDF118", 10)]),
    Case("double-dash-comment", arm(more="<!-- a -- b -->"), REJECT, [("URDF105", 8)]),
    Case("two-robots", _PLAIN + "<robot name='s'><link name='a'/></robot>", REJECT, [("URDF105", 10)]),
    Case("text-after-the-end", _PLAIN + "bye", REJECT, [("URDF105", 10)]),
    Case("attribute-twice", arm(robot='name="r" name="s"'), REJECT, [("URDF105", 2)]),
    Case("less-than-in-attribute", arm(robot='name="<"'), REJECT, [("URDF105", 2)]),
    Case("crossed-tags", arm(more="<a><b></a></b>"), REJECT, [("URDF105", 8)]),
    Case("undefined-entity", arm(robot='name="&foo;"'), REJECT, [("URDF106", 2)]),
    Case("numeric-reference-to-nul", arm(robot='name="&#0;"'), REJECT, [("URDF105", 2)]),
    Case("harmless-references", arm(robot='name="&#114;&amp;"'), ACCEPT),
    Case("doctype-system", '<!DOCTYPE robot SYSTEM "a.dtd">' + arm(head=""), REJECT, [("URDF106", 1)]),
    Case("doctype-public", '<!DOCTYPE robot PUBLIC "p" "a.dtd">' + arm(head=""), REJECT),
    Case("doctype-empty-subset", "<!DOCTYPE robot []>" + arm(head=""), REJECT, [("URDF106", 1)]),
    Case(
        "doctype-attribute-default",
        '<!DOCTYPE robot [<!ATTLIST origin xyz CDATA "9 9 9">]>' + arm(head=""),
        REJECT,
        [("URDF106", 1)],
    ),
    Case(
        "parameter-entity",
        '<!DOCTYPE r [<!ENTITY % p SYSTEM "file:///etc/passwd">%p;]>' + arm(head=""),
        REJECT,
        [("URDF106", 1)],
    ),
    Case("nested-600", arm(more="<a>" * 600 + "</a>" * 600), REJECT, [("URDF115", 8)]),
    Case("nested-100000", arm(more="<a>" * 100_000), REJECT, [("URDF115", 8)]),
    Case("nested-100", arm(more="<a>" * 100 + "</a>" * 100), WARN),
    Case("long-attribute", arm(robot='name="r" note="' + "x" * 1_000_000 + '"'), WARN),
]
