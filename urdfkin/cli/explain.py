"""`urdfkin explain`: the page of a finding's code, or of an equation."""

from __future__ import annotations

import click

from urdfkin.cli.completing import complete_topic
from urdfkin.kinematics.registry import explain as explain_equation
from urdfkin.lint.explain import explain
from urdfkin.lint.pages import RULES, find_rule, page


@click.command("explain")
@click.argument("topic", metavar="CODE|EQUATION", required=False, shell_complete=complete_topic)
def command(topic: str | None) -> None:
    """Explain a code: why it matters, a bad and a good example, and what other programs do with it.

    CODE is a finding's code or its short name. EQUATION is a number of the chapter: what it says, which
    function computes it, and what checks it. Without either, all codes are listed.

    \b
    Example:
      urdfkin explain URDF502
      urdfkin explain rounded-pi
      urdfkin explain 7.130
    """  # noqa: D301 - click's mark for a paragraph to leave alone is a backspace
    if topic is None:
        for rule in RULES.values():
            click.echo(f"{rule.id}  {rule.severity.value:7}  {rule.slug:26}  {page(rule.id).title}")
    elif (equation := explain_equation(topic)) is not None:
        click.echo(equation)
    else:
        click.echo(explain(find_rule(topic)))
