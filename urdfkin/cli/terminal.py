"""The console that tables and coloured lines are printed on: words are words, whatever is in them."""

from __future__ import annotations

import re
from typing import Any, TextIO, cast

from rich.console import Console

from urdfkin.cli.streams import SafeStream
from urdfkin.errors.escape import printable

_TRAILING = re.compile(r" +$", re.MULTILINE)


class Terminal(Console):
    """Rich's console, on which each text that is printed is one line without markup."""

    def __init__(self, stream: TextIO, **options: Any) -> None:
        door = SafeStream(stream, styled=True)
        super().__init__(file=cast("TextIO", door), highlight=False, emoji=False, markup=False, **options)
        door.styled = self.is_terminal

    def print(self, *objects: Any, **options: Any) -> None:
        """As rich does; tables bring their own cells. Text is never wrapped: what is copied stays whole."""
        texts = [printable(o) if isinstance(o, str) else o for o in objects]
        lines_alone = all(isinstance(o, str) for o in objects)
        if self.is_terminal or lines_alone:
            super().print(*texts, **{"soft_wrap": lines_alone} | options)
            return
        # A table is padded to its width: blanks that a file and a pasted text are better without.
        with self.capture() as held:
            super().print(*texts, **options)
        self.file.write(_TRAILING.sub("", held.get()))
