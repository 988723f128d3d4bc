"""The sections of docs/questions.md, as `urdfkin explain` prints them.

`urdfkin explain`: the page of a finding's code, of an equation, or of a question.
"""

from __future__ import annotations

import re
import textwrap

import click

from urdfkin.cli.completion_items import complete_topic
from urdfkin.errors import UnknownNameError
from urdfkin.kinematics.registry import explain as explain_equation
from urdfkin.lint.explain import WIDTH, explain
from urdfkin.lint.pages import OF_MJCF, RULES, find_rule, page
from urdfkin.lint.rule import Rule
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


@click.command("explain")
@click.argument("topic", metavar="CODE|EQUATION|QUESTION", required=False, shell_complete=complete_topic)
def command(topic: str | None) -> None:
    """Explain a code: why it matters, a bad and a good example, and what other programs do with it.

    CODE is a finding's code or its short name. EQUATION is a number of the chapter: what it says, which
    function computes it, and what checks it. QUESTION is one that people ask, or a word of it. Without any,
    all codes and questions are listed.

    \b
    Example:
      urdfkin explain URDF502
      urdfkin explain rounded-pi
      urdfkin explain 7.130
      urdfkin explain reference-frames
    """  # noqa: D301 - click's mark for a paragraph to leave alone is a backspace
    if topic is None:
        for rule in (*RULES.values(), *OF_MJCF.values()):
            click.echo(f"{rule.id}  {rule.severity.value:7}  {rule.slug:26}  {page(rule.id).title}")
        click.echo(f"questions: {', '.join(answers())}")
    elif (equation := explain_equation(topic)) is not None:
        click.echo(equation)
    elif (asked := _rule(topic)) is not None:
        click.echo(explain(asked))
    elif (answer := answer_to(topic)) is not None:
        click.echo(as_text(answer))
    else:
        rules = (*RULES.values(), *OF_MJCF.values())
        known = [name for one in rules for name in (one.id, one.slug)]
        raise UnknownNameError("code, equation or question", topic, [*known, *answers()])


def _rule(topic: str) -> Rule | None:
    try:
        return find_rule(topic)
    except UnknownNameError:
        return None
