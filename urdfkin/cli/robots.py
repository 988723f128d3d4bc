"""`urdfkin robots`: list the robots that have a short name."""

from __future__ import annotations

import json
import sys

import click

from urdfkin.cli.arguments import forms
from urdfkin.urdf.catalogue import Entry, catalogue

EXAMPLE = "urdfkin robots --family arm"
_FAMILIES = sorted({entry.family for entry in catalogue().values()})


@click.command(epilog=f"Example: {EXAMPLE}")
@click.option("--family", metavar="NAME", help=f"Show only one family: {', '.join(_FAMILIES)}.")
@forms("table", "json")
def command(family: str | None, format_: str) -> None:
    """List the robots that have a short name.

    They are the URDF files of example-robot-data and urdfkin's own. The base and tip of a robot's first limb
    are the defaults of --base, --tip and --frame.
    """
    entries = [entry for entry in catalogue().values() if family in (None, entry.family)]
    if not entries:
        raise click.UsageError(f"no robots of family {family!r}; the families are: {', '.join(_FAMILIES)}")
    if format_ == "json":
        json.dump([_as_dict(entry) for entry in entries], sys.stdout, indent=2)
        click.echo()
        return
    from urdfkin.cli.output import console  # noqa: PLC0415  json needs no tables
    from urdfkin.report.listing import print_named  # noqa: PLC0415

    rows = ((entry.name, entry.family, entry.base or "", entry.tip or "") for entry in entries)
    out = console()
    print_named(out, ["name", "family", "base", "tip"], rows, left=range(4))
    out.print(f"{len(entries)} robots")
    for entry in entries:
        if entry.reason:
            out.print(f"{entry.name}: mimic rules are off: {entry.reason}")


def _as_dict(entry: Entry) -> dict[str, object]:
    return {
        "name": entry.name,
        "family": entry.family,
        "path": str(entry.path),
        "limbs": {limb: list(ends) for limb, ends in entry.limbs.items()},
        "mimic": entry.mimic,
        "reason": entry.reason,
        "own": entry.own,
    }
