"""The check of any bytes ends with findings, and never with a traceback."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from tests.urdf.lint.cases import CASES
from urdfkin.urdf.lint import check_text

DOCUMENTS = [case.data for case in CASES if len(case.data) < 5_000]

#: Words and characters with a meaning in XML or in a URDF.
TOKENS = [
    *(b"<joint ", b"</joint>", b"<link name='", b"/>", b">", b"'", b'"', b"&", b"&#9;", b"<!--", b"-->"),
    *(b"<![CDATA[", b"]]>", b"<!DOCTYPE robot [", b"nan", b"1e400", b"${x}", b"\xff", b"\0", b"\xef\xbb\xbf"),
    *(b"mimic", b"xyz", b"xmlns='a'", b"version='1.1'", b"quat_xyzw='0 0 0 1'", b"type='planar'", b"base"),
    *(b"l1", b"\t", b"\r\n"),
]


@given(st.binary(max_size=400), st.lists(st.sampled_from(TOKENS), max_size=40))
def test_the_check_of_random_bytes_and_random_tokens_raises_no_exception(
    data: bytes, tokens: list[bytes]
) -> None:
    check_text(data)
    check_text(b"<robot name='r'>" + b" ".join(tokens))


@given(st.sampled_from(DOCUMENTS), st.data())
def test_a_document_with_a_replaced_piece_always_has_the_same_findings_in_order(
    document: bytes, data: st.DataObject
) -> None:
    start = data.draw(st.integers(0, len(document)))
    length = data.draw(st.integers(0, 40))
    mutant = document[:start] + data.draw(st.sampled_from([*TOKENS, b""])) + document[start + length :]
    findings = check_text(mutant)
    assert list(findings) == sorted(findings, key=lambda finding: (finding.line, finding.column))
    assert findings == check_text(mutant)
