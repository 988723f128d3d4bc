"""Find a rule by its code, and return the documentation of each rule as data and as text.

The rules are defined in the parser and in the modules of `lint.rules`. Each module has a TOML file beside the
module. For example, `joints.toml` belongs to `joints.py`. For each rule of the module, the file has one TOML
table, such as [URDF502]. The table contains the texts of the rule's page. An entry at the top of the file,
such as `correction`, is the default for all pages.

The table `parts` defines texts that replace `{name}` in examples. Each entry is a string, or a pair
[text, times] for a repeated text. In a repeated text, `{i}` is the index of the repetition. Line breaks in
prose have no meaning.
"""

from __future__ import annotations

import string
import textwrap
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

from urdfkin.errors import QuestionsSection, UnknownNameError
from urdfkin.errors.escape import escape_unprintable
from urdfkin.urdf import parser
from urdfkin.urdf.findings import Rule
from urdfkin.urdf.lint.rules import bodies, dialect, joints, left_out

if TYPE_CHECKING:
    from importlib.resources.abc import Traversable

_RULE_MODULES = (parser, dialect, joints, bodies)

#: The rules about URDF files, indexed by module name.
TOPICS: dict[str, tuple[Rule, ...]] = {
    module.__name__.rpartition(".")[2]: tuple(x for x in vars(module).values() if isinstance(x, Rule))
    for module in _RULE_MODULES
}

URDF_RULES = {rule.id: rule for rule in sorted(sum(TOPICS.values(), ()), key=lambda rule: rule.id)}
MJCF_AND_USD_RULES = {x.id: x for x in vars(left_out).values() if isinstance(x, Rule)}

#: Code of each rule about URDF files. The keys of URDF601 are "urdf601", "601" and "rounded-pi".
CODE_BY_NAME = {
    word: rule.id for rule in URDF_RULES.values() for word in (rule.id.lower(), rule.id[4:], rule.slug)
}

_TOPIC_OF_CODE = {rule.id: topic for topic, own in TOPICS.items() for rule in own}
_TOPIC_OF_CODE |= dict.fromkeys(MJCF_AND_USD_RULES, "left_out")


@dataclass(frozen=True, slots=True)
class Page:
    """The documentation of a rule.

    Attributes:
        example: A minimal example with the problem: a whole document, or the content of `<robot>`. If the
            example begins with a joint or a comment, the links `base` and `tip` must be added.
        other_readers: The behaviour of other readers of the format for the example. For URDF, these readers
            are Pinocchio (urdfdom) and yourdfpy.
    """

    title: str
    why: str
    example: str
    correction: str
    other_readers: str
    question: QuestionsSection | None = None


def page(code: str) -> Page:
    return topic_pages(_TOPIC_OF_CODE[code])[code]


def page_file_by_topic() -> dict[str, Traversable]:
    from importlib import resources

    packages = {
        module.__name__.rpartition(".")[2]: module.__package__ for module in (*_RULE_MODULES, left_out)
    }
    return {topic: resources.files(str(package)) / f"{topic}.toml" for topic, package in packages.items()}


@cache
def topic_pages(topic: str) -> dict[str, Page]:
    import tomllib

    data = tomllib.loads(page_file_by_topic()[topic].read_text(encoding="utf-8"))
    defaults = {key: value for key, value in data.items() if isinstance(value, str)}
    return {
        code: _make_page({**data, **defaults, **data[code]})
        for code in data
        if code.startswith(("URDF", "MJCF", "USD"))
    }


def _make_page(entry: dict[str, Any]) -> Page:
    prose = {key: " ".join(entry[key].split()) for key in ("title", "why", "other_readers")}
    parts = entry.get("parts", {})
    texts = {key: _expand_parts(entry[key], parts) for key in ("example", "correction")}
    return Page(
        **prose, **texts, question=QuestionsSection(entry["question"]) if "question" in entry else None
    )


def _expand_parts(text: str, parts: dict[str, Any]) -> str:
    for name, part in parts.items():
        piece, times = part if isinstance(part, list) else (part, 1)
        text = text.replace(f"{{{name}}}", "".join(piece.replace("{i}", str(i)) for i in range(times)))
    return text


def find_rule(word: str) -> Rule:
    known, name = URDF_RULES | MJCF_AND_USD_RULES, word.strip().lower()
    codes = CODE_BY_NAME | {
        name: rule.id for rule in MJCF_AND_USD_RULES.values() for name in (rule.id.lower(), rule.slug)
    }
    if name not in codes:
        raise UnknownNameError("code", word, [*known, *(rule.slug for rule in known.values())])
    return known[codes[name]]


def find_rules(word: str) -> tuple[Rule, ...]:
    """Return the rules that a word selects: a code, a short name, the first digits of codes, or ALL.

    Raise UnknownNameError if the word selects no rule.

    >>> [rule.id for rule in find_rules("rounded-pi")], len(find_rules("URDF30"))
    (['URDF601'], 5)
    """
    prefix = word.strip().upper()
    prefix = f"URDF{prefix}" if prefix.isdigit() else prefix
    every = URDF_RULES | MJCF_AND_USD_RULES
    family = tuple(rule for rule in every.values() if rule.id.startswith(prefix))
    if prefix == "ALL":
        return tuple(every.values())
    return family if family and prefix.lstrip(string.ascii_uppercase) else (find_rule(word),)


_MAX_EXAMPLE_WIDTH = 100
PROSE_WIDTH = 88


def explain(rule: Rule) -> str:
    content = page(rule.id)
    paragraphs = [
        f"{rule.id} {rule.slug} ({rule.severity.value})",
        textwrap.fill(content.title[0].upper() + content.title[1:] + ".", PROSE_WIDTH),
        textwrap.fill(content.why, PROSE_WIDTH),
        "Found in:\n\n" + _example(content.example),
        "Better:\n\n" + _example(content.correction),
        textwrap.fill(content.other_readers, PROSE_WIDTH),
    ]
    if rule.pinocchio_reading is not None:
        paragraphs.append(
            "Pinocchio cannot check the results of a robot that has this finding.\n"
            "urdfkin reports these results as not verified."
        )
    if content.question is not None:
        paragraphs.append(f"{content.question}.")
    return "\n\n".join(paragraphs)


def _example(text: str) -> str:
    lines = [escape_unprintable(line) for line in text.strip("\n").split("\n")]
    cut = [
        line if len(line) <= _MAX_EXAMPLE_WIDTH else line[: _MAX_EXAMPLE_WIDTH - 4] + " ..." for line in lines
    ]
    return "\n".join(f"    {line}" for line in cut).rstrip()
