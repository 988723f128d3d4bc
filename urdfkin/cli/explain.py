"""`urdfkin explain`: the page of a finding's code, of an equation, or of a question."""

from __future__ import annotations

import click

from urdfkin.cli.completing import complete_topic
from urdfkin.cli.questions import answer_to, answers, as_text
from urdfkin.errors import UnknownNameError
from urdfkin.kinematics.registry import explain as explain_equation
from urdfkin.lint.explain import explain
from urdfkin.lint.pages import OF_MJCF, RULES, find_rule, page
from urdfkin.lint.rule import Rule


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
