"""`urdfkin explain`: print the page about a finding, an equation, or a question of docs/questions.md."""

from __future__ import annotations

import re
import textwrap

import click

from urdfkin.cli.shell import complete_topic
from urdfkin.errors import InputError, UnknownNameError
from urdfkin.kinematics.registry import LAST_EQUATION, equations, sections
from urdfkin.kinematics.registry import explain as explain_equation
from urdfkin.system.files import read_text
from urdfkin.system.resources import questions_page
from urdfkin.urdf.findings import Rule, shorten
from urdfkin.urdf.lint.pages import MJCF_AND_USD_RULES, PROSE_WIDTH, URDF_RULES, explain, find_rule, page

_LINK = re.compile(r"\[([^\]]+)\]\([^)\s]+\)")
_CODE_BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def answers() -> dict[str, str]:
    """Return each section of docs/questions.md, with the anchor of its heading as the key.

    Links become plain text.
    """
    return {
        make_anchor(text.partition("\n")[0]): _LINK.sub(r"\1", text).rstrip()
        for text in _question_sections()[1:]
    }


def find_answer(topic: str) -> str | None:
    """Return the section of docs/questions.md that `topic` names, or None.

    `topic` is the anchor of the section, or consists of words that only the anchor of this section has.
    """
    known, words = answers(), set(topic.lower().replace("-", " ").split())
    found = [name for name in known if words and words <= set(name.split("-"))]
    return known.get("-".join(topic.lower().split())) or (known[found[0]] if len(found) == 1 else None)


def format_answer(answer: str) -> str:
    """Format a section for a terminal.

    The setup code of Python examples is at the end.
    """
    pieces = _CODE_BLOCK.split(answer)
    prose, kinds, codes = pieces[::3], pieces[1::3], pieces[2::3]
    parts = []
    for text, code in zip(prose, [*codes, ""], strict=True):
        parts += [
            textwrap.fill(one, PROSE_WIDTH, break_on_hyphens=False) for one in text.strip("\n").split("\n\n")
        ]
        parts.append(_indent(code))
    if "python" in kinds:
        parts += [
            "It runs after:",
            _indent("".join(code for _, code in _CODE_BLOCK.findall(_question_sections()[0]))),
        ]
    return "\n\n".join(filter(None, parts))


def make_anchor(heading: str) -> str:
    return re.sub(r"[^a-z0-9 -]", "", heading.lower()).replace(" ", "-")


def _question_sections() -> list[str]:
    """Split docs/questions.md at its headings.

    The first part contains the setup code of all examples.
    """
    return re.split(r"^## ", read_text(questions_page()), flags=re.MULTILINE)


def _indent(code: str) -> str:
    return textwrap.indent(code.rstrip(), "    ")


@click.command("explain")
@click.argument("topic", metavar="CODE|EQUATION|QUESTION|WORD", required=False, shell_complete=complete_topic)
def explain_command(topic: str | None) -> None:
    """Explain the code of a finding, an equation, or a common question.

    CODE is a finding's code or its short name. The page of a finding has the reason, a bad and a good
    example, and the behaviour of other programs.

    EQUATION is the number of an equation in the textbook, such as 7.130. The page has the equation, the
    function that implements it, and the check of this function.

    QUESTION is the name of a question, or a word of the name.

    WORD is any other word, such as jacobian. The command lists the codes and equations with this word in
    their description.

    Without an argument, the command lists all codes, sections with equations, and questions.

    \b
    Example:
      urdfkin explain URDF502
      urdfkin explain rounded-pi
      urdfkin explain 7.130
      urdfkin explain reference-frames
      urdfkin explain jacobian
    """  # noqa: D301  click needs the character "\b"
    rules = (*URDF_RULES.values(), *MJCF_AND_USD_RULES.values())
    if topic is None:
        for rule in rules:
            click.echo(f"{rule.id}  {rule.severity.value:7}  {rule.slug:26}  {page(rule.id).title}")
        for section in sections():
            numbers = [equation.number for equation in section.equations]
            click.echo(f"equations {numbers[0]} to {numbers[-1]}: {section.title}")
        click.echo(f"questions: {', '.join(answers())}")
    elif (equation := explain_equation(topic)) is not None:
        click.echo(equation)
    elif (match := _find_rule(topic)) is not None:
        click.echo(explain(match))
    elif (answer := find_answer(topic)) is not None:
        click.echo(format_answer(answer))
    elif lines := _list_matches(topic):
        click.echo("\n".join(lines))
    elif re.fullmatch(r"[\d.]+", topic):
        raise InputError(
            "the textbook's chapter has no such equation",
            found=shorten(topic),
            remedy=f"give a number from 7.1 to 7.{LAST_EQUATION}",
        )
    else:
        names = [*(name for rule in rules for name in (rule.id, rule.slug)), *answers()]
        words = set(topic.lower().split())
        if related := [name for name in names if words & set(name.split("-"))]:
            raise InputError(
                "no code, equation or question has this name",
                found=shorten(topic),
                remedy=f"did you mean {', '.join(related[:3])}?",
            )
        error = UnknownNameError("code, equation or question", topic, names)
        error.remedy = f"{error.remedy} `urdfkin explain` lists all names"
        raise error


def _list_matches(topic: str) -> list[str]:
    """Return a line for each code and equation with all words of `topic` in its description."""
    words = topic.lower().split()
    if not any(map(str.isalpha, topic)):
        return []
    rules = [(rule.id, page(rule.id).title) for rule in (*URDF_RULES.values(), *MJCF_AND_USD_RULES.values())]
    entries = [*rules, *((number, equation.meaning) for number, equation in equations().items())]
    return [f"{name:7}  {text}" for name, text in entries if all(word in text.lower() for word in words)]


def _find_rule(topic: str) -> Rule | None:
    try:
        return find_rule(topic)
    except UnknownNameError:
        return None
