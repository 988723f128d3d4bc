"""Each program on the page about other libraries shows its defect, until a version fixes it."""

import re
from typing import Any

import numpy as np
import pytest

from tests.pages import DOCS, blocks

pytest.importorskip("mujoco")
PAGE = DOCS / "upstream.md"


def programs() -> dict[str, int]:
    """Return the headings of the programs that end with `found` and `expected`, with their index."""
    parts = re.split(r"^##+ ", PAGE.read_text("utf-8"), flags=re.M)[1:]
    titles, at = {}, -1
    for part in parts:
        for code in re.findall(r"```py(?:thon)?\n(.*?)```", part, flags=re.S):
            at += 1
            if "expected" in code and "def poses" not in code:
                titles[part.partition("\n")[0]] = at
    return titles


PROGRAMS = programs()
_names: dict[str, Any] = {}
_run: list[int] = []


def outcome(at: int) -> tuple[np.ndarray, np.ndarray]:
    """Run the programs of the page up to one; return what the library found and what was expected."""
    codes = [code for kind, code in blocks("upstream.md") if kind in ("python", "py")]
    for k in range(len(_run), at + 1):
        exec(codes[k], _names)
        _run.append(k)
        if k in PROGRAMS.values():
            _names[f"outcome {k}"] = _names["found"], _names["expected"]
    found: tuple[np.ndarray, np.ndarray] = _names[f"outcome {at}"]
    return found


@pytest.mark.xfail(
    raises=AssertionError, strict=True, reason="a defect of the library; once it is gone, its entry goes"
)
@pytest.mark.parametrize("title", PROGRAMS)
def test_the_library_no_longer_has_the_defect(title: str) -> None:
    if title.startswith("Robotics Toolbox"):
        pytest.importorskip("roboticstoolbox")
    found, expected = outcome(PROGRAMS[title])
    np.testing.assert_allclose(found, expected, atol=1e-4)


def test_every_entry_has_a_program() -> None:
    assert len(PROGRAMS) == 11
