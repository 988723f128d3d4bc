"""Make figures with matplotlib, as files or inline SVG.

The module needs the extra `urdfkin[plots]`, but no display. Inline SVG uses the colours of the page's style,
so that one drawing fits light pages, dark pages and print.
"""

from __future__ import annotations

import importlib
import importlib.util
import io
import re
from functools import cache
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from urdfkin.errors import InputError
from urdfkin.errors.escape import escape_unprintable
from urdfkin.system.lazy_import import install_command
from urdfkin.system.processes import leave_folder_with_settings

if TYPE_CHECKING:
    import matplotlib.axes
    import matplotlib.figure

    Axes = matplotlib.axes.Axes
    Figure = matplotlib.figure.Figure

#: CSS variables that replace placeholder colours.
PAGE_COLOURS = {
    "#010101": "var(--plot-text)",
    "#020202": "var(--plot-grid)",
    "#030303": "var(--plot-a)",
    "#040404": "var(--plot-b)",
    "#050505": "var(--plot-c)",
}
TEXT, GRID, FIRST, SECOND, THIRD = PAGE_COLOURS
FORMATS = ("svg", "png", "pdf")

#: Okabe and Ito's colours: readers with red-green or blue-yellow colour blindness can distinguish them.
BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, BLACK = COLOURS = (
    "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000",
)  # fmt: skip
#: Colour of the crosses for disagreements above the bound and for coordinates outside the limits.
BAD = "#B00020"

_STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "urdfkin",
    "font.family": "DejaVu Sans",
    # Names are plain text, never TeX.
    "text.parse_math": False,
    "text.usetex": False,
    "axes.spines.top": False,
    "axes.spines.right": False,
}


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure (size in inches) that needs no display."""
    _matplotlib()
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def style(**more: Any) -> Any:
    """Return a context with urdfkin's settings of matplotlib.

    An SVG contains text as characters instead of outlines. Equal figures have equal ids in SVG files.
    """
    return _matplotlib().rc_context(_STYLE | {key.replace("_", "."): value for key, value in more.items()})


def label(name: str) -> str:
    """Escape unprintable characters in a name, because XML forbids some of them."""
    return escape_unprintable(name)


def has_matplotlib() -> bool:
    return importlib.util.find_spec("matplotlib") is not None


@cache
def _matplotlib() -> Any:
    """Import matplotlib without the settings of a file `matplotlibrc` in the current folder."""
    if not has_matplotlib():
        raise InputError("drawing needs matplotlib", remedy=install_command("plots"))
    with leave_folder_with_settings("matplotlibrc"):
        return importlib.import_module("matplotlib")


def figure_bytes(figure: Figure, path: Path) -> bytes:
    """Return the figure as bytes in the format of `path`'s suffix. Equal figures give equal bytes."""
    format_ = path.suffix.removeprefix(".").lower()
    if format_ not in FORMATS:
        raise InputError(
            "unknown picture format", where=str(path), remedy=f"use the suffix {', '.join(FORMATS)}"
        )
    stream = io.BytesIO()
    metadata = {"svg": {"Date": None}, "pdf": {"CreationDate": None}, "png": {}}[format_]
    with style():
        figure.savefig(stream, format=format_, metadata=metadata, dpi=160)
    return stream.getvalue()


def inline_svg(figure: Figure, prefix: str, title: str, description: str) -> str:
    """Return a figure as an SVG element.

    `prefix` makes ids unique on the page. `PAGE_COLOURS` replaces the placeholder colours.
    """
    stream = io.StringIO()
    no_metadata = dict.fromkeys(("Date", "Creator", "Format", "Type"))
    with style():
        figure.savefig(stream, format="svg", metadata=no_metadata, transparent=True)
    text = stream.getvalue()
    # A style element would affect the whole page, so it is removed.
    text = re.sub(r"<(metadata|style)\b.*?</\1>", "", text[text.index("<svg") :], flags=re.DOTALL)
    text = _with_ids(text, prefix)
    for placeholder, colour in PAGE_COLOURS.items():
        text = text.replace(placeholder, colour)
    text = re.sub(r"font: (\d[\d.]*)px 'DejaVu Sans'[^;\"]*", r"font-size: \1px", text)
    text = re.sub(r"<!--.*?-->|\n\s*", lambda found: "\n" if found[0][0] == "\n" else "", text)
    head, _, body = text.partition(">")
    size = re.search(r'viewBox="[^"]*"', head)
    title, description = (escape(escape_unprintable(words), quote=False) for words in (title, description))
    labels = f"<title>{title}</title><desc>{description}</desc>"
    return f'<svg class="plot" {size[0] if size else ""} role="img">{labels}{body}'


def _with_ids(text: str, prefix: str) -> str:
    used = set(re.findall(r"url\(#([^)]+)\)", text)) | set(re.findall(r'href="#([^"]+)"', text))
    text = re.sub(
        r' id="([^"]*)"', lambda found: f' id="{prefix}{found[1]}"' if found[1] in used else "", text
    )
    text = re.sub(r"url\(#", f"url(#{prefix}", text)
    return re.sub(r'xlink:href="#', f'href="#{prefix}', text)
