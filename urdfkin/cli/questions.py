"""The sections of docs/questions.md, as `urdfkin explain` prints them."""

from __future__ import annotations

import re

from urdfkin.system.files import read_text
from urdfkin.system.resources import questions_page

_LINK = re.compile(r"\[([^\]]+)\]\([^)\s]+\)")


def answers() -> dict[str, str]:
    """Each question's section, by the anchor of its heading, without the targets of links."""
    sections = re.split(r"^## ", read_text(questions_page()), flags=re.MULTILINE)[1:]
    return {anchor(text.partition("\n")[0]): _LINK.sub(r"\1", text).rstrip() for text in sections}


def answer_to(topic: str) -> str | None:
    """The section of an anchor, or of words that one anchor alone has."""
    known, words = answers(), set(topic.lower().replace("-", " ").split())
    found = [name for name in known if words and words <= set(name.split("-"))]
    return known.get("-".join(topic.lower().split())) or (known[found[0]] if len(found) == 1 else None)


def anchor(heading: str) -> str:
    """What a heading is called in an address."""
    return re.sub(r"[^a-z0-9 -]", "", heading.lower()).replace(" ", "-")
