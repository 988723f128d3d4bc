"""Define the console for tables and coloured lines."""

from __future__ import annotations

import re
from typing import Any, TextIO, cast

from rich.console import Console

from urdfkin.cli.streams import SafeStream
from urdfkin.errors.escape import escape_unprintable

_TRAILING_BLANKS = re.compile(r" +$", re.MULTILINE)


class Terminal(Console):
    """A console in which markup and control characters of names have no effect."""

    def __init__(self, stream: TextIO, **options: Any) -> None:
        safe = SafeStream(stream, styled=True)
        super().__init__(file=cast("TextIO", safe), highlight=False, emoji=False, markup=False, **options)
        safe.styled = self.is_terminal

    def print(self, *objects: Any, **options: Any) -> None:
        """Print tables and texts; texts are not wrapped, so that users can copy them."""
        texts = [escape_unprintable(o) if isinstance(o, str) else o for o in objects]
        only_text = all(isinstance(o, str) for o in objects)
        if self.is_terminal or only_text:
            super().print(*texts, **{"soft_wrap": only_text} | options)
            return
        # The package `rich` pads the lines of a table with blanks, which are removed here.
        with self.capture() as capture:
            super().print(*texts, **options)
        self.file.write(_TRAILING_BLANKS.sub("", capture.get()))
