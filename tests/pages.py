"""The blocks of a documentation page, which are run in order, and their outputs."""

import contextlib
import io
import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from tests.cli.running import urdfkin

DOCS = Path(__file__).parents[1] / "docs"
_BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.DOTALL | re.MULTILINE)


class Ran(NamedTuple):
    """A block that was run, the output on the page, and the printed output."""

    code: str
    shown: str
    printed: str

    def agrees(self) -> bool:
        """Whether the outputs have equal words by `tidy`; `...` on the page matches any text."""
        words = [re.escape(word) for word in tidy(self.shown)]
        pattern = " ".join(words).replace(re.escape("..."), ".*")
        return re.fullmatch(pattern, " ".join(tidy(self.printed)), re.DOTALL) is not None


def tidy(text: str) -> list[str]:
    """Return the words without square brackets, and without the signs of zeros, which depend on rounding."""
    return re.sub(r"-0\.(?![0-9])", " 0.", re.sub(r"[\[\]]", " ", text)).split()


def pages() -> list[str]:
    """Return every page, by its path in docs."""
    return sorted(str(path.relative_to(DOCS)) for path in DOCS.rglob("*.md"))


def blocks(page: str) -> list[tuple[str, str]]:
    """Return language and text of each block."""
    return _BLOCK.findall((DOCS / page).read_text(encoding="utf-8"))


def run(page: str) -> Iterator[Ran]:
    """Run the blocks in order: Python in one namespace, and lines `$ urdfkin` in this process."""
    namespace: dict[str, Any] = {}
    below = [*blocks(page)[1:], ("", "")]
    for (kind, text), (next_kind, next_text) in zip(blocks(page), below, strict=True):
        if kind == "python":
            printed = io.StringIO()
            with contextlib.redirect_stdout(printed):
                exec(compile(text, page, "exec"), namespace)
            yield Ran(text, next_text if next_kind == "text" else "", printed.getvalue())
        elif kind == "console":
            for example in re.split(r"^\$ ", text, flags=re.MULTILINE)[1:]:
                command, _, shown = example.partition("\n")
                done = urdfkin(*shlex.split(command)[1:])
                yield Ran(command, shown, done.text + done.err)
