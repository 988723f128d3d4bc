"""Size is no danger: long chains, long loops, deep nesting and big files take linear time and no stack."""

import time

import pytest

from urdfkin.diagnostics import Finding, Limits, check_text

pytestmark = pytest.mark.slow

MANY = 50_000


def chain(length: int, back: str = "", mimic: bool = False) -> bytes:
    links = "".join(f'<link name="l{i}"/>\n' for i in range(length + 1))
    follow = '<mimic joint="j{}"/>' if mimic else "{}"
    joints = "".join(
        f'<joint name="j{i}" type="continuous"><parent link="l{i}"/><child link="l{i + 1}"/>'
        f"{follow.format(i - 1 if mimic else '') if i else ''}</joint>\n"
        for i in range(length)
    )
    return f'<robot name="r">\n{links}{joints}{back}</robot>'.encode()


def timed(data: bytes, seconds: float = 20.0) -> tuple[Finding, ...]:
    start = time.perf_counter()
    findings = check_text(data)
    assert time.perf_counter() - start < seconds
    return findings


@pytest.mark.slow
def test_a_chain_of_50000_links_has_no_finding() -> None:
    assert timed(chain(MANY)) == ()


def test_a_loop_of_50000_links_is_one_error_on_its_line() -> None:
    back = '<joint name="back" type="fixed"><parent link="l50000"/><child link="l0"/></joint>'
    (finding,) = timed(chain(MANY, back))
    assert (finding.code, finding.line) == ("URDF412", 2 * MANY + 3)


@pytest.mark.slow
def test_a_chain_of_50000_mimics_is_resolved_in_linear_time() -> None:
    codes = {finding.code for finding in timed(chain(MANY, mimic=True))}
    assert codes == {"URDF524", "URDF525"}


def test_50000_unknown_links_do_not_search_for_suggestions_forever() -> None:
    joints = "".join(
        f'<joint name="j{i}" type="fixed"><parent link="x{i}"/><child link="l{i}"/></joint>'
        for i in range(5_000)
    )
    links = "".join(f'<link name="l{i}"/>' for i in range(5_000))
    assert len(timed(f'<robot name="r">{links}{joints}</robot>'.encode())) == 5_000


@pytest.mark.parametrize(
    ("limits", "word"),
    [(Limits(bytes=10), "bytes"), (Limits(depth=1), "levels"), (Limits(elements=1), "elements")],
)
def test_each_limit_refuses_and_says_how_to_raise_it(limits: Limits, word: str) -> None:
    (finding,) = check_text(b'<robot name="r"><link name="a"/></robot>', limits=limits)
    assert finding.code == "URDF108"
    assert finding.remedy is not None
    assert "--max-" in finding.remedy
    assert word in f"{finding.message} {finding.found}"


def test_lines_beyond_65535_are_right() -> None:
    data = b'<robot name="r">' + b"\n" * 100_000 + b'<link name="a"/><link name="a"/></robot>'
    (finding,) = check_text(data)
    assert finding.line == 100_001
