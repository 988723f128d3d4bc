"""`urdfkin explain`: the page of a code."""

from __future__ import annotations

import click

from urdfkin.diagnostics.codes import REGISTRY
from urdfkin.diagnostics.explain import find_code, page


@click.command("explain")
@click.argument("topic", metavar="CODE", required=False)
def command(topic: str | None) -> None:
    """Explain a code: why it matters, a bad and a good example, and what other programs do with it.

    CODE is a finding's code or its short name. Without one, all codes are listed.

    \b
    Example:
      urdfkin explain URDF502
      urdfkin explain rounded-pi
    """  # noqa: D301 - click's mark for a paragraph to leave alone is a backspace
    if topic is None:
        for code in REGISTRY.values():
            click.echo(f"{code.id}  {code.severity.value:7}  {code.slug:26}  {code.title}")
    else:
        click.echo(page(find_code(topic)))
