"""The sections of docs/questions.md, as `urdfkin explain` prints them."""

from __future__ import annotations

import re
import textwrap

from urdfkin.lint.explain import WIDTH
from urdfkin.system.files import read_text
from urdfkin.system.resources import questions_page

_LINK = re.compile(r"\[([^\]]+)\]\([^)\s]+\)")
_BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def answers() -> dict[str, str]:
    """Each question's section, by the anchor of its heading, without the targets of links."""
    return {anchor(text.partition("\n")[0]): _LINK.sub(r"\1", text).rstrip() for text in _sections()[1:]}


def answer_to(topic: str) -> str | None:
    """The section of an anchor, or of words that one anchor alone has."""
    known, words = answers(), set(topic.lower().replace("-", " ").split())
    found = [name for name in known if words and words <= set(name.split("-"))]
    return known.get("-".join(topic.lower().split())) or (known[found[0]] if len(found) == 1 else None)


def as_text(answer: str) -> str:
    """A section for a terminal: filled paragraphs, code set in, and last what the code takes for granted."""
    words = _BLOCK.split(answer)
    prose, kinds, codes = words[::3], words[1::3], words[2::3]
    parts = []
    for text, code in zip(prose, [*codes, ""], strict=True):
        parts += [textwrap.fill(one, WIDTH, break_on_hyphens=False) for one in text.strip("\n").split("\n\n")]
        parts.append(_set_in(code))
    if "python" in kinds:
        parts += ["It runs after:", _set_in("".join(code for _, code in _BLOCK.findall(_sections()[0])))]
    return "\n\n".join(filter(None, parts))


def anchor(heading: str) -> str:
    """What a heading is called in an address."""
    return re.sub(r"[^a-z0-9 -]", "", heading.lower()).replace(" ", "-")


def _sections() -> list[str]:
    """The page, cut at its headings; before the first stands what every example begins with."""
    return re.split(r"^## ", read_text(questions_page()), flags=re.MULTILINE)


def _set_in(code: str) -> str:
    return textwrap.indent(code.rstrip(), "    ")
