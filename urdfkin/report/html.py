"""The report as one HTML file: it opens offline, asks no network for anything, and escapes every name."""

from __future__ import annotations

from datetime import datetime
from functools import cache
from typing import TYPE_CHECKING, Any

from urdfkin.report import pages
from urdfkin.report.distributions import distributions
from urdfkin.report.document import Document, Robot, asset, outcome_of
from urdfkin.report.scene import scene
from urdfkin.report.words import (
    VERDICTS,
    check_name,
    columns,
    counted,
    in_order,
    judged_on,
    percent,
    pinocchio,
    share_of,
    summary,
    units,
    verdict_counts,
    witness_cells,
    witness_heads,
    witness_title,
    worst,
)
from urdfkin.validation.portrait import chain_disagreement
from urdfkin.view.figure import installed

if TYPE_CHECKING:
    from jinja2 import Environment
    from markupsafe import Markup

#: With no more robots than this they stand open.
_OPEN = 1
#: So many of those that failed stand open, which come first.
_FAILURES_OPEN = 20


@cache
def environment() -> Environment:
    """What fills templates in: every name is escaped, a missing one is an error."""
    from jinja2 import Environment, PackageLoader, StrictUndefined  # noqa: PLC0415  keeps --help fast

    environment = Environment(
        loader=PackageLoader("urdfkin.report"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    environment.policies["json.dumps_kwargs"] = {"separators": (",", ":"), "allow_nan": False}
    environment.filters["counted"] = counted
    return environment


def as_is(text: str) -> Markup:
    """A text of our own, which a template takes as it is."""
    from markupsafe import Markup  # noqa: PLC0415

    return Markup(text)


def as_html(document: Document) -> str:
    """The page. Names may be anything, `<script>` included: the template escapes them all."""
    robots = sorted(document["robots"], key=lambda robot: VERDICTS.index(robot["verdict"]))  # the worst first
    quantities = columns(robots)
    return (
        environment()
        .get_template("report.html.j2")
        .render(
            document=document,
            outcome=outcome_of(document),
            summary=summary(document),
            when=_when(document["started"]),
            pinocchio=pinocchio(document),
            totals=_totals(document),
            verdicts=verdict_counts(document),
            quantities=list(quantities),
            overview=[pages.overview(robot, list(quantities.values())) for robot in robots],
            robots=[_robot(robot, i, document) for i, robot in enumerate(robots)],
            opened=len(robots) <= _OPEN,
            heat_steps=pages.HEAT_STEPS,
            style=as_is(asset("report.css")),
            script=as_is(asset("report.js")),
            view_script=as_is(asset("view3d.js")),
            three=as_is(asset("three.min.js")),
            three_licence=asset("three.LICENSE.txt"),
        )
    )


def _totals(document: Document) -> dict[str, Any]:
    robots = document["robots"]
    checks = [check for robot in robots for check in robot["checks"]]
    return {
        "robots": len(robots),
        "joints": sum(len(robot["joints"]) for robot in robots),
        "frames": sum(len(robot["frames"]) for robot in robots),
        "results": sum(robot["results"] for robot in robots),
        "failed": sum(robot["failed"] for robot in robots),
        "worst": units(worst(check["worst"] for check in checks), compared=bool(checks)),
        "share": percent(worst(map(share_of, robots))) if checks else "",
    }


def _robot(robot: Robot, index: int, document: Document) -> dict[str, Any]:
    model = robot["model"]
    heads, heat = pages.heat_map(robot, model) if model and robot["checks"] else ([], [])
    return {
        "index": index,
        "opened": robot["verdict"] != "verified" and index < _FAILURES_OPEN,
        "moving": sum(joint["kind"] != "fixed" for joint in model["joints"]) if model else 0,
        "data": robot,
        "summary": pages.overview(robot, []),
        "scene": scene(model, robot["chains"]) if model else None,
        "joints": pages.joint_rows(model) if model else [],
        "chains": [
            {
                "data": chain,
                "beta": pages.has_beta(chain),
                "tables": {kind: pages.chain_rows(chain, kind) for kind in ("standard", "modified")},
                "agrees": chain_disagreement(chain) is None,
                "metres": f"{chain['metres'] or 0.0:.2g}",
                "worst": units(chain["worst"]),
                "share": percent(chain["share_of_bound"]),
            }
            for chain in robot["chains"]
        ],
        "checks": pages.check_rows(robot),
        "witness": (title := witness_title([robot])),
        "witness_heads": witness_heads(title) if title else [],
        "witnessed": [
            [check_name(check), *witness_cells([check], title)]
            for check in in_order(robot)
            if title and "witness" in check
        ],
        "judged": pages.judged_rows(robot["judge"]) if robot["judge"] else [],
        "judged_on": judged_on(robot["judge"]) if robot["judge"] else "",
        "heat_heads": heads,
        "heat": heat,
        "plot": as_is(_plot(robot, index, document)),
    }


def _plot(robot: Robot, index: int, document: Document) -> str:
    """Empty where matplotlib is not installed: the tables say the same."""
    if not installed():
        return ""
    return distributions(robot, document["histogram_edges"], f"p{index}-")


def _when(started: str) -> str:
    """The moment in words; as it stands if it is no ISO date."""
    try:
        moment = datetime.fromisoformat(started)
    except ValueError:
        return started
    return f"{moment.day} {moment:%B %Y, %H:%M} UTC"
