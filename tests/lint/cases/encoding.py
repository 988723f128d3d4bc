"""Bytes."""

from tests.lint.cases.arm import ACCEPT, REJECT, WARN, Case, arm

_PLAIN = arm()
_UTF16 = _PLAIN.replace("<?xml", '<?xml encoding="UTF-16"').encode("utf-16")

CASES = [
    Case("only-a-mark", b"\xef\xbb\xbf", REJECT),
    Case("empty", b"", REJECT, [("URDF101", 1)]),
    Case("utf16-with-mark", _UTF16, REJECT, [("URDF102", 1)]),
    Case("utf16-without-mark", _PLAIN.encode("utf-16-le"), REJECT, [("URDF102", 1)]),
    Case("utf32", _PLAIN.encode("utf-32"), REJECT, [("URDF102", 1)]),
    Case("latin1-undeclared", arm(base='<link name="base" f="\xf6"/>').encode("latin-1"), REJECT),
    Case("overlong-utf8", b"<robot name='\xc0\xaf'><link name='a'/></robot>", REJECT, [("URDF102", 1)]),
    Case("zero-byte-at-the-end", _PLAIN.encode() + b"\0", REJECT, [("URDF102", 10)]),
    Case("declared-us-ascii", arm(head='<?xml version="1.0" encoding="US-ASCII"?>'), ACCEPT),
    Case("declared-utf8-small", arm(head="<?xml version='1.0' encoding='utf8'?>"), ACCEPT),
    Case("declared-cp1252-ascii", arm(head='<?xml version="1.0" encoding="cp1252"?>'), WARN),
    Case("declared-utf16-lie", arm(head='<?xml version="1.0" encoding="UTF-16"?>'), REJECT),
    Case("declared-nonsense", arm(head='<?xml version="1.0" encoding="foo-8"?>'), REJECT, [("URDF103", 1)]),
    Case("xml-1.1", arm(head='<?xml version="1.1"?>'), WARN, [("URDF111", 1)]),
]
