"""Bytes and XML."""

from tests.lint.cases.arm import ACCEPT, REJECT, WARN, Case, arm


def text_cases() -> list[Case]:
    plain = arm()
    utf16 = plain.replace("<?xml", '<?xml encoding="UTF-16"').encode("utf-16")
    return [
        Case("plain", plain, ACCEPT),
        Case("empty", b"", REJECT, [("URDF101", 1)]),
        Case("only-a-mark", b"\xef\xbb\xbf", REJECT),
        Case("utf16-with-mark", utf16, REJECT, [("URDF102", 1)]),
        Case("utf16-without-mark", plain.encode("utf-16-le"), REJECT, [("URDF102", 1)]),
        Case("utf32", plain.encode("utf-32"), REJECT, [("URDF102", 1)]),
        Case("latin1-undeclared", arm(base='<link name="base" f="\xf6"/>').encode("latin-1"), REJECT),
        Case("overlong-utf8", b"<robot name='\xc0\xaf'><link name='a'/></robot>", REJECT, [("URDF102", 1)]),
        Case("zero-byte-at-the-end", plain.encode() + b"\0", REJECT, [("URDF102", 10)]),
        Case("declared-us-ascii", arm(head='<?xml version="1.0" encoding="US-ASCII"?>'), ACCEPT),
        Case("declared-utf8-small", arm(head="<?xml version='1.0' encoding='utf8'?>"), ACCEPT),
        Case("declared-cp1252-ascii", arm(head='<?xml version="1.0" encoding="cp1252"?>'), WARN),
        Case("declared-utf16-lie", arm(head='<?xml version="1.0" encoding="UTF-16"?>'), REJECT),
        Case(
            "declared-nonsense", arm(head='<?xml version="1.0" encoding="foo-8"?>'), REJECT, [("URDF103", 1)]
        ),
        Case("xml-1.1", arm(head='<?xml version="1.1"?>'), WARN, [("URDF111", 1)]),
        Case("carriage-returns", plain.replace("\n", "\r"), ACCEPT),
        Case("cdata", arm(more="<gazebo><![CDATA[<joint/>]]></gazebo>"), ACCEPT),
        Case("stylesheet-instruction", arm(head="<?xml-stylesheet href='http://example.org/x'?>"), ACCEPT),
        Case("instruction-inside", arm(more="<?editor tab=2?>"), WARN, [("URDF118", 8)]),
        Case("instruction-in-gazebo", arm(more="<gazebo>\n<?php echo ?></gazebo>"), WARN, [("URDF118", 9)]),
        Case("instruction-after-a-comment", "<!-- c -->\n<?e?>\n" + arm(head=""), WARN, [("URDF118", 2)]),
        Case("instruction-after-the-end", arm() + "<?e?>", WARN, [("URDF118", 10)]),
        Case("double-dash-comment", arm(more="<!-- a -- b -->"), REJECT, [("URDF105", 8)]),
        Case("two-robots", plain + "<robot name='s'><link name='a'/></robot>", REJECT, [("URDF105", 10)]),
        Case("text-after-the-end", plain + "bye", REJECT, [("URDF105", 10)]),
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
