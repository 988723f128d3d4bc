"""Each code's page is true: its bad example has the finding, its good one has not."""

import re

import pytest

from tests.lint.others import ask
from urdfkin.checking import check
from urdfkin.errors import UnknownNameError
from urdfkin.lint import DEFAULT_LIMITS, Limits
from urdfkin.lint.codes import REGISTRY
from urdfkin.lint.explain import find_code, page
from urdfkin.lint.rule import Code

EVERY_CODE = pytest.mark.parametrize("code", REGISTRY.values(), ids=lambda code: code.id)


def limits_for(code: Code) -> Limits:
    """Three codes are only seen in small examples with a limit lowered, one with a limit raised."""
    return _LIMITS.get(code.slug, DEFAULT_LIMITS)


_LIMITS = {
    "too-deep-for-pinocchio": Limits(depth=5_000),
    "too-large": Limits(bytes=100),
    "too-many-elements": Limits(elements=10),
    "markup-too-long": Limits(markup=100),
}


@EVERY_CODE
def test_the_bad_example_has_the_finding(code: Code) -> None:
    findings = check(code.document(code.bad).encode(), limits=limits_for(code))
    assert code.id in [finding.code for finding in findings], findings


@EVERY_CODE
def test_the_bad_example_of_an_error_is_refused_and_of_others_is_not(code: Code) -> None:
    findings = check(code.document(code.bad).encode(), limits=limits_for(code))
    assert any(f.severity.value == "error" for f in findings) == (
        code.severity.value == "error" or code.slug == "stray-text"
    ), findings


@EVERY_CODE
def test_the_good_example_has_no_error_and_not_this_finding(code: Code) -> None:
    findings = check(code.document(code.good).encode(), limits=limits_for(code))
    assert not [f for f in findings if f.severity.value == "error" or f.code == code.id], findings


@EVERY_CODE
def test_the_oracles_mark_stands_on_the_finding(code: Code) -> None:
    findings = check(code.document(code.bad).encode(), limits=limits_for(code))
    assert {f.oracle for f in findings if f.code == code.id} == {code.oracle}


@EVERY_CODE
def test_ids_and_titles_keep_their_form(code: Code) -> None:
    assert re.fullmatch(r"URDF[1-9][0-9]{2}", code.id)
    assert re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", code.slug)
    assert not code.title.endswith(".")
    assert code.why.endswith(".")
    assert re.match(r"Pinocchio (reads|refuses) it\b.*; yourdfpy (reads|refuses) it\b.*\.$", code.others)


@EVERY_CODE
def test_the_page_fits_a_terminal(code: Code) -> None:
    text = page(code)
    assert code.id in text.splitlines()[0]
    assert max(map(len, text.splitlines())) <= 104
    assert all(character.isprintable() or character == "\n" for character in text)


def test_short_names_are_unique() -> None:
    assert len({code.slug for code in REGISTRY.values()}) == len(REGISTRY)


def test_a_code_is_found_by_id_number_and_short_name() -> None:
    assert find_code("urdf502") is find_code("502") is find_code("Axis-Without-Direction")
    with pytest.raises(UnknownNameError, match="did you mean"):
        find_code("URDF5O2")


@pytest.fixture(scope="module")
def verdicts() -> dict[str, dict[str, str]]:
    codes = list(REGISTRY.values())
    return dict(zip(REGISTRY, ask([code.document(code.bad) for code in codes]), strict=True))


@pytest.mark.slow
@EVERY_CODE
def test_the_others_do_with_the_bad_example_what_the_page_says(
    code: Code, verdicts: dict[str, dict[str, str]]
) -> None:
    pinocchio, yourdfpy = re.findall(r"(?:Pinocchio|; yourdfpy) (reads|refuses) it", code.others)
    assert verdicts[code.id] == {"pinocchio": pinocchio, "yourdfpy": yourdfpy}
