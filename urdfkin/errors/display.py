"""How an object shows itself: a title, sentences and tables, said once, as text, HTML, Markdown and LaTeX.

An object says what there is to say in `_sheet`; `Displayable` makes `print` of it and what notebooks ask
for. Names may hold anything: each form makes them harmless in its own way.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from html import escape

from urdfkin.errors.escape import latex_text, log_line, markdown_text, printable

#: What a tree is drawn with before its parts, and in ASCII.
LINES = "├│└ "
ASCII = str.maketrans("├│└", "+|`")
#: What is less than this share of a table's largest number is rounding, and shown as 0. For the eye alone:
#: what is written for machines has every digit, and no verdict asks.
NOISE = 1e-15


@dataclass(frozen=True, slots=True)
class Table:
    """Rows of words and numbers.

    Attributes:
        heads: What the columns are called.
        rows: A cell for each; numbers are shown at six digits.
        left: How many of the first columns hold words, or which; blanks before these are kept.
    """

    heads: Sequence[str]
    rows: Sequence[Sequence[str | float]]
    left: int | Collection[int] = 1

    def _left(self, i: int) -> bool:
        return i < self.left if isinstance(self.left, int) else i in self.left

    def _cells(self) -> list[list[str]]:
        largest = max((abs(x) for row in self.rows for x in row if not isinstance(x, str)), default=0.0)
        return [
            [x if isinstance(x, str) else six_digits(x, NOISE * largest) for x in row] for row in self.rows
        ]

    def _drawn(self) -> list[list[tuple[str, str]]]:
        """Each cell, the heads' too, as the lines of a tree before it and its words."""
        return [
            [(cell[: len(cell) - len(words)], words) for cell in row for words in (cell.lstrip(LINES),)]
            for row in (self.heads, *self._cells())
        ]

    def text(self) -> str:
        """Columns side by side."""
        body = [[log_line(cell) for cell in row] for row in (self.heads, *self._cells())]
        widths = [max(map(len, column)) for column in zip(*body, strict=True)]
        lines = [
            "  ".join(
                cell.ljust(width) if self._left(i) else cell.rjust(width)
                for i, (cell, width) in enumerate(zip(row, widths, strict=True))
            ).rstrip()
            for row in body
        ]
        return "\n".join([lines[0], "-" * (sum(widths) + 2 * (len(widths) - 1)), *lines[1:]])

    def markdown(self) -> str:
        """A table of Markdown."""
        marks = [":---" if self._left(i) else "---:" for i in range(len(self.heads))]
        rows = [
            [lines.replace(" ", "&nbsp;") + markdown_text(words) for lines, words in row]
            for row in self._drawn()
        ]
        return "\n".join(f"| {' | '.join(row)} |" for row in (rows[0], marks, *rows[1:]))

    def html(self) -> str:
        """A table of HTML, which is styled by where it stands."""

        def row(cells: Sequence[str], tag: str) -> str:
            sides = ("left;white-space:pre" if self._left(i) else "right" for i in range(len(cells)))
            cells = [
                f'<{tag} style="text-align:{side};padding:0 .5em">{_html(c)}</{tag}>'
                for c, side in zip(cells, sides, strict=True)
            ]
            return f"<tr>{''.join(cells)}</tr>"

        body = "\n".join(row(cells, "td") for cells in self._cells())
        return f"<table>\n<thead>{row(self.heads, 'th')}</thead>\n<tbody>\n{body}\n</tbody>\n</table>"

    def latex(self) -> str:
        """A tabular with booktabs."""
        sides = "".join("l" if self._left(i) else "r" for i in range(len(self.heads)))
        rows = [
            " & ".join(lines.translate(ASCII).replace(" ", "~") + latex_text(words) for lines, words in row)
            + r" \\"
            for row in self._drawn()
        ]
        lines = [
            rf"\begin{{tabular}}{{{sides}}}",
            r"\toprule",
            rows[0],
            r"\midrule",
            *rows[1:],
            r"\bottomrule",
        ]
        return "\n".join([*lines, r"\end{tabular}"])


@dataclass(frozen=True, slots=True)
class TextDocument:
    """What an object says.

    Attributes:
        title: What it is.
        parts: Sentences and tables, in order.
    """

    title: str
    parts: Sequence[str | Table] = ()

    def text(self) -> str:
        """Lines for a terminal."""
        return self._joined("\n", log_line, log_line, Table.text)

    def markdown(self) -> str:
        """Markdown."""
        return self._joined(
            "\n\n", markdown_text, lambda title: f"**{markdown_text(title)}**", Table.markdown
        )

    def html(self) -> str:
        """HTML, to stand in a page."""
        body = self._joined(
            "\n", lambda x: f"<p>{_html(x)}</p>", lambda x: f"<p><b>{_html(x)}</b></p>", Table.html
        )
        return f"<div>\n{body}\n</div>"

    def latex(self) -> str:
        """LaTeX, which needs the package booktabs."""
        return self._joined("\n\n", latex_text, lambda title: rf"\textbf{{{latex_text(title)}}}", Table.latex)

    def _joined(
        self,
        between: str,
        sentence: Callable[[str], str],
        title: Callable[[str], str],
        table: Callable[[Table], str],
    ) -> str:
        parts = [table(part) if isinstance(part, Table) else sentence(part) for part in self.parts]
        return between.join([title(self.title), *parts])


class Displayable:
    """What shows itself: in a terminal by `print`, in a notebook by being the last line of a cell."""

    __slots__ = ()

    def _sheet(self) -> TextDocument:
        raise NotImplementedError

    def __str__(self) -> str:
        return self._sheet().text()

    def _repr_html_(self) -> str:
        return self._sheet().html()

    def _repr_markdown_(self) -> str:
        return self._sheet().markdown()

    def _repr_latex_(self) -> str:
        return self._sheet().latex()


def _html(words: str) -> str:
    return escape(printable(words))


def six_digits(value: float, noise: float = NOISE, digits: int = 6) -> str:
    """A number for people, at six digits or so many; what is no more than noise as 0.

    >>> six_digits(0.1 + 0.2), six_digits(1e-16), six_digits(1e-16, noise=0.0)
    ('0.3', '0', '1e-16')
    """
    return "0" if abs(value) <= noise else f"{value:.{digits}g}"
