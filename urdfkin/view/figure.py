"""The border to matplotlib (the extra `urdfkin[plots]`): figures without a display, as files or inline SVG.

Inline SVG takes its colours from the page's style, so that one drawing serves light, dark and print.
"""

from __future__ import annotations

import importlib
import importlib.util
import io
import re
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from urdfkin.errors import InputError
from urdfkin.errors.escape import printable
from urdfkin.system.processes import not_reading

if TYPE_CHECKING:
    import matplotlib.axes
    import matplotlib.figure

    Axes = matplotlib.axes.Axes
    Figure = matplotlib.figure.Figure

#: Colours in a drawing that stand for the page's own: what to draw with -> what the page gets.
PAGE_COLOURS = {
    "#010101": "var(--plot-text)",
    "#020202": "var(--plot-grid)",
    "#030303": "var(--plot-a)",
    "#040404": "var(--plot-b)",
    "#050505": "var(--plot-c)",
}
TEXT, GRID, FIRST, SECOND, THIRD = PAGE_COLOURS
FORMATS = ("svg", "png", "pdf")

_STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "urdfkin",
    "font.family": "DejaVu Sans",
    # A name is text: neither mathematics between dollars nor TeX, whatever the user's own settings are.
    "text.parse_math": False,
    "text.usetex": False,
    "axes.spines.top": False,
    "axes.spines.right": False,
}


def new_figure(width: float, height: float) -> Figure:
    """An empty figure, inches; it belongs to no window and no global state.

    Raises:
        InputError: matplotlib is not installed.
    """
    _matplotlib()
    from matplotlib.figure import Figure  # noqa: PLC0415  keeps other commands fast

    return Figure(figsize=(width, height), layout="constrained")


def style(**more: Any) -> Any:
    """The context to draw in: text stays text, and the same drawing gives the same file."""
    return _matplotlib().rc_context(_STYLE | {key.replace("_", "."): value for key, value in more.items()})


def label(name: str) -> str:
    """A name as a drawing can show it: what the font has no glyph for and XML no place is an escape."""
    return printable(name)


def installed() -> bool:
    """Whether matplotlib is there."""
    return importlib.util.find_spec("matplotlib") is not None


@cache
def _matplotlib() -> Any:
    """The library, without the settings of a file `matplotlibrc` in the current folder."""
    if not installed():
        raise InputError("drawing needs matplotlib", remedy="pip install 'urdfkin[plots]'")
    with not_reading("matplotlibrc"):
        return importlib.import_module("matplotlib")


def save(figure: Figure, path: Path) -> bytes:
    """The figure as the bytes of a file whose format its name's ending says; the same input, the same bytes.

    Raises:
        InputError: an ending other than svg, png, pdf.
    """
    ending = path.suffix.removeprefix(".").lower()
    if ending not in FORMATS:
        raise InputError("unknown kind of picture", where=str(path), remedy=f"end it in {', '.join(FORMATS)}")
    stream = io.BytesIO()
    metadata = {"svg": {"Date": None}, "pdf": {"CreationDate": None}, "png": {}}[ending]
    with style():
        figure.savefig(stream, format=ending, metadata=metadata, dpi=160)
    return stream.getvalue()


def inline_svg(figure: Figure, prefix: str, title: str, description: str) -> str:
    """The figure as an element of a page.

    Args:
        figure: Drawn with `PAGE_COLOURS`.
        prefix: Set before the ids that stay, so that no two figures of a page share one.
        title: What it shows, for who cannot see it; plain text.
        description: What it says; plain text.
    """
    stream = io.StringIO()
    nothing = dict.fromkeys(("Date", "Creator", "Format", "Type"))
    with style():
        figure.savefig(stream, format="svg", metadata=nothing, transparent=True)
    text = stream.getvalue()
    # A style element would reach beyond the drawing: the page sets line joins itself.
    text = re.sub(r"<(metadata|style)\b.*?</\1>", "", text[text.index("<svg") :], flags=re.DOTALL)
    text = _with_ids(text, prefix)
    for colour, page in PAGE_COLOURS.items():
        text = text.replace(colour, page)
    text = re.sub(r"font: (\d[\d.]*)px 'DejaVu Sans'[^;\"]*", r"font-size: \1px", text)
    text = re.sub(r"<!--.*?-->|\n\s*", lambda found: "\n" if found[0][0] == "\n" else "", text)
    head, _, body = text.partition(">")
    size = re.search(r'viewBox="[^"]*"', head)
    described = f"<title>{_escaped(title)}</title><desc>{_escaped(description)}</desc>"
    return f'<svg class="plot" {size[0] if size else ""} role="img">{described}{body}'


def _with_ids(text: str, prefix: str) -> str:
    """Only ids that something refers to, each with the prefix."""
    used = set(re.findall(r"url\(#([^)]+)\)", text)) | set(re.findall(r'href="#([^"]+)"', text))
    text = re.sub(
        r' id="([^"]*)"', lambda found: f' id="{prefix}{found[1]}"' if found[1] in used else "", text
    )
    text = re.sub(r"url\(#", f"url(#{prefix}", text)
    return re.sub(r'xlink:href="#', f'href="#{prefix}', text)


def _escaped(text: str) -> str:
    return printable(text).replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
