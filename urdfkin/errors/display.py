"""Display of objects as text, HTML, Markdown and LaTeX.

Names from files may contain any characters, so each format escapes names.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from html import escape

from urdfkin.errors.escape import (
    escape_unprintable,
    latex_text,
    log_line,
    markdown_cell,
    markdown_code,
    markdown_text,
)

#: Characters that draw the branches of a tree before a name.
TREE_LINES = "├│└ "
ASCII_TREE_LINES = str.maketrans("├│└", "+|`")
#: A number is displayed as 0 if it is at most this fraction of the table's largest number.
_NOISE_FRACTION = 1e-15
#: The units of a table's numbers can differ. Therefore, the largest number counts at most this much.
_MAX_LARGEST = 1e9


@dataclass(frozen=True, slots=True)
class Table:
    """A table of text and numbers. Numbers are displayed with six digits.

    Attributes:
        left: Number of left-aligned columns at the left of the table, or the indices of the left-aligned
            columns. The cells of these columns keep leading blanks.
        names: Indices of columns that Markdown displays as code.
    """

    heads: Sequence[str]
    rows: Sequence[Sequence[str | float]]
    left: int | Collection[int] = 1
    names: Collection[int] = ()

    def is_left(self, i: int) -> bool:
        return i < self.left if isinstance(self.left, int) else i in self.left

    def cells(self) -> list[list[str]]:
        largest = max((abs(x) for row in self.rows for x in row if not isinstance(x, str)), default=0.0)
        noise = noise_limit(largest)
        return [[x if isinstance(x, str) else format_number(x, noise) for x in row] for row in self.rows]

    def _split_tree_lines(self) -> list[list[tuple[str, str]]]:
        """Split each heading and cell into its leading characters such as `├ ` and the following text."""
        return [
            [(cell[: len(cell) - len(words)], words) for cell in row for words in (cell.lstrip(TREE_LINES),)]
            for row in (self.heads, *self.cells())
        ]

    def text(self) -> str:
        body = [[log_line(cell) for cell in row] for row in (self.heads, *self.cells())]
        widths = [max(map(len, column)) for column in zip(*body, strict=True)]
        lines = [
            "  ".join(
                cell.ljust(width) if self.is_left(i) else cell.rjust(width)
                for i, (cell, width) in enumerate(zip(row, widths, strict=True))
            ).rstrip()
            for row in body
        ]
        return "\n".join([lines[0], "-" * (sum(widths) + 2 * (len(widths) - 1)), *lines[1:]])

    def markdown(self) -> str:
        marks = [":---" if self.is_left(i) else "---:" for i in range(len(self.heads))]
        heads, *rows = self._split_tree_lines()

        def cell(i: int, tree_lines: str, words: str) -> str:
            shown = markdown_code(words) if i in self.names else markdown_cell(words)
            return tree_lines.replace(" ", "&nbsp;") + shown

        body = [[cell(i, *parts) for i, parts in enumerate(row)] for row in rows]
        titles = [markdown_cell("".join(head)) for head in heads]
        return "\n".join(f"| {' | '.join(row)} |" for row in (titles, marks, *body))

    def html(self) -> str:
        def row(cells: Sequence[str], tag: str) -> str:
            sides = ("left;white-space:pre" if self.is_left(i) else "right" for i in range(len(cells)))
            cells = [
                f'<{tag} style="text-align:{side};padding:0 .5em">{_html(c)}</{tag}>'
                for c, side in zip(cells, sides, strict=True)
            ]
            return f"<tr>{''.join(cells)}</tr>"

        body = "\n".join(row(cells, "td") for cells in self.cells())
        return f"<table>\n<thead>{row(self.heads, 'th')}</thead>\n<tbody>\n{body}\n</tbody>\n</table>"

    def latex(self) -> str:
        sides = "".join("l" if self.is_left(i) else "r" for i in range(len(self.heads)))
        rows = [
            " & ".join(
                tree_lines.translate(ASCII_TREE_LINES).replace(" ", "~") + latex_text(words)
                for tree_lines, words in row
            )
            + r" \\"
            for row in self._split_tree_lines()
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
class Matrix:
    rows: Sequence[Sequence[str]]

    def lines(self) -> list[str]:
        widths = [max(map(len, column)) for column in zip(*self.rows, strict=True)]
        return ["  ".join(map(str.rjust, row, widths)) for row in self.rows]

    def text(self) -> str:
        return "\n".join(f"  {line}" for line in self.lines())

    def markdown(self) -> str:
        return "\n".join(["```", *self.lines(), "```"])

    def html(self) -> str:
        rows = (
            "".join(f'<td style="text-align:right;padding:0 .5em">{escape(cell)}</td>' for cell in row)
            for row in self.rows
        )
        body = "\n".join(f"<tr>{row}</tr>" for row in rows)
        return f"<table>\n<tbody>\n{body}\n</tbody>\n</table>"

    def latex(self) -> str:
        rows = r" \\ ".join(" & ".join(row) for row in self.rows)
        return rf"$\begin{{bmatrix}}{rows}\end{{bmatrix}}$"


class Strong(str):
    """A sentence with emphasis. `style` is a style for terminals, such as "bold red"."""

    __slots__ = ("style",)
    style: str

    def __new__(cls, words: str, style: str = "bold") -> Strong:
        sentence = super().__new__(cls, words)
        sentence.style = style
        return sentence


class CodeLine(str):
    """A line that Markdown displays as code, for example a formula."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class TextDocument:
    """A title with sentences, tables and matrices.

    `text` prints a blank line for an empty string in `parts`. The other formats leave out empty strings.
    """

    title: str
    parts: Sequence[str | Table | Matrix] = ()

    def render(self, form: str) -> str:
        text: str = self.text() if form in ("terminal", "table") else getattr(self, form)()
        return text + "\n"

    def text(self) -> str:
        return self._render_parts("text", "\n", log_line, log_line)

    def markdown(self) -> str:
        def sentence(words: str) -> str:
            return markdown_code(words) if isinstance(words, CodeLine) else markdown_text(words)

        return self._render_parts("markdown", "\n\n", sentence, lambda title: f"**{markdown_text(title)}**")

    def html(self) -> str:
        body = self._render_parts(
            "html", "\n", lambda x: f"<p>{_html(x)}</p>", lambda x: f"<p><b>{_html(x)}</b></p>"
        )
        return f"<div>\n{body}\n</div>"

    def latex(self) -> str:
        return self._render_parts(
            "latex", "\n\n", latex_text, lambda title: rf"\textbf{{{latex_text(title)}}}"
        )

    def _render_parts(
        self, form: str, separator: str, sentence: Callable[[str], str], title: Callable[[str], str]
    ) -> str:
        def render_part(part: str | Table | Matrix) -> str:
            if isinstance(part, str):
                return title(part) if isinstance(part, Strong) else sentence(part)
            return str(getattr(part, form)())

        parts = [render_part(part) for part in self.parts if part or form == "text"]
        return separator.join([title(self.title), *parts] if self.title else parts)


class Displayable:
    """Base class of objects that `print` and notebooks display from one `TextDocument`."""

    __slots__ = ()

    def _text_document(self) -> TextDocument:
        raise NotImplementedError

    def __str__(self) -> str:
        return self._text_document().text()

    def _repr_html_(self) -> str:
        return self._text_document().html()

    def _repr_markdown_(self) -> str:
        return self._text_document().markdown()

    def _repr_latex_(self) -> str:
        return self._text_document().latex()


def _html(words: str) -> str:
    return escape(escape_unprintable(words))


def format_count(n: int, noun: str) -> str:
    """Return a number with its noun: "1 robot", "1,000 robots"."""
    return f"{n:,} {noun}" if n == 1 else f"{n:,} {noun}s"


def noise_limit(largest: float) -> float:
    """Return the limit up to which a table displays a number as 0. `largest` is the table's largest number.

    >>> round(noise_limit(2.0), 18), round(noise_limit(1e300), 9)
    (2e-15, 1e-06)
    """
    return _NOISE_FRACTION * min(largest, _MAX_LARGEST)


def format_number(value: float, noise: float = _NOISE_FRACTION, digits: int = 6) -> str:
    """Format a number with `digits` significant digits. Absolute values up to `noise` become "0".

    >>> format_number(0.1 + 0.2), format_number(1e-16), format_number(1e-16, noise=0.0)
    ('0.3', '0', '1e-16')
    """
    return "0" if abs(value) <= noise else f"{value:.{digits}g}"
