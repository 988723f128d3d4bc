"""Every rule by its code, and its page, read from the TOML file beside the rule's module when asked for.

A topic is a module of `lint.rules` and the file of its name. At the top of the file stand `cure`, `others`
and `question` for pages without their own, and `parts`: what `{name}` means in an example, a text or [text,
times] (in the text `{i}` counts). Line ends in prose mean nothing.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

from urdfkin.errors import Question, UnknownNameError
from urdfkin.lint import rules
from urdfkin.lint.rule import Rule
from urdfkin.lint.rules import (
    axes,
    comments,
    dialect,
    document,
    encoding,
    inertials,
    joints,
    left_out,
    materials,
    meshes,
    mimic,
    names,
    numbers,
    prefixes,
    ranges,
    shapes,
    structure,
    suspicious,
    vocabulary,
)

#: Topic -> its rules.
TOPICS: dict[str, tuple[Rule, ...]] = {
    module.__name__.rpartition(".")[2]: tuple(x for x in vars(module).values() if isinstance(x, Rule))
    for module in (
        *(encoding, document, comments, dialect, prefixes, vocabulary, numbers, names, structure),
        *(joints, axes, ranges, mimic, suspicious, inertials, shapes, meshes, materials),
    )
}

#: Code -> rule, in the order of the codes.
RULES = {rule.id: rule for rule in sorted(sum(TOPICS.values(), ()), key=lambda rule: rule.id)}
#: The same for what `load` says of MJCF, which is no text that `check` reads.
OF_MJCF = {rule.id: rule for rule in (left_out.LEFT_OUT_MOTION, left_out.LEFT_OUT)}

#: What a code may be called, in lower case: itself, its number, its short name.
CODES = {word: rule.id for rule in RULES.values() for word in (rule.id.lower(), rule.id[4:], rule.slug)}

_TOPIC = {rule.id: topic for topic, own in TOPICS.items() for rule in own} | dict.fromkeys(
    OF_MJCF, "left_out"
)


@dataclass(frozen=True, slots=True)
class Page:
    """What there is to say about a rule.

    Attributes:
        title: The claim in one line, for tables.
        why: Why it matters to someone who wants numbers.
        example: A smallest one that has it. A whole document, or the inside of `<robot>`; when it begins
            with a joint or a comment, the links `base` and `tip` are there already.
        cure: The same example, put right.
        others: What Pinocchio (urdfdom) and yourdfpy do with the example.
        question: What people ask about it, if they do.
    """

    title: str
    why: str
    example: str
    cure: str
    others: str
    question: Question | None = None


def page(code: str) -> Page:
    """The page of a code."""
    return topic_pages(_TOPIC[code])[code]


@cache
def topic_pages(topic: str) -> dict[str, Page]:
    """The pages of a topic's file."""
    data = tomllib.loads((resources.files(rules) / f"{topic}.toml").read_text(encoding="utf-8"))
    defaults = {key: value for key, value in data.items() if isinstance(value, str)}
    return {
        code: _page({**data, **defaults, **data[code]}) for code in data if code.startswith(("URDF", "MJCF"))
    }


def _page(entry: dict[str, Any]) -> Page:
    prose = {key: " ".join(entry[key].split()) for key in ("title", "why", "others")}
    parts = entry.get("parts", {})
    texts = {key: _written_out(entry[key], parts) for key in ("example", "cure")}
    return Page(**prose, **texts, question=Question(entry["question"]) if "question" in entry else None)


def _written_out(text: str, parts: dict[str, Any]) -> str:
    for name, part in parts.items():
        piece, times = part if isinstance(part, list) else (part, 1)
        text = text.replace(f"{{{name}}}", "".join(piece.replace("{i}", str(i)) for i in range(times)))
    return text


def find_rule(word: str) -> Rule:
    """A rule by its code or its short name, in any case.

    Raises:
        UnknownNameError: there is none; the nearest are offered.
    """
    known, wanted = RULES | OF_MJCF, word.strip().lower()
    codes = CODES | {name: rule.id for rule in OF_MJCF.values() for name in (rule.id.lower(), rule.slug)}
    if wanted not in codes:
        raise UnknownNameError("code", word, [*known, *(rule.slug for rule in known.values())])
    return known[codes[wanted]]


def find_rules(word: str) -> tuple[Rule, ...]:
    """The rules that a word stands for: one by its code or short name, a family by a code's beginning, ALL.

    Raises:
        UnknownNameError: it stands for none; the nearest are offered.

    >>> [rule.id for rule in find_rules("rounded-pi")], len(find_rules("URDF30"))
    (['URDF601'], 5)
    """
    wanted = word.strip().upper()
    wanted = f"URDF{wanted}" if wanted.isdigit() else wanted
    family = tuple(rule for rule in RULES.values() if rule.id.startswith(wanted))
    if wanted == "ALL":
        return tuple(RULES.values())
    return family if family and wanted[4:] else (find_rule(word),)
