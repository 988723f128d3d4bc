"""Compute the tables of `urdfkin dh` after its options have been read."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from urdfkin.cli.output import Answer, check_of_path
from urdfkin.cli.streams import say
from urdfkin.dh import DHTable, Units, export, read_table, to_convention
from urdfkin.dh.compare import (
    BetterInterpretation,
    CellDifference,
    Mistake,
    TableComparison,
    compare,
    convention_that_fits,
    diagnose,
)
from urdfkin.dh.compare import document as comparison_document
from urdfkin.dh.convert import to_urdf
from urdfkin.dh.export.data import to_mapping
from urdfkin.dh.parse_table import published, read_mapping, read_table_or_screws, reference_path, table_of
from urdfkin.dh.printed import printed, printed_tree
from urdfkin.dh.rows import last_digits
from urdfkin.dh.snapping import snap_hint
from urdfkin.dh.tree_parameters import as_csv, as_mapping, tree_parameters
from urdfkin.dh.tree_parameters import document as tree_document
from urdfkin.dh.units import Angles, Lengths
from urdfkin.errors import InputError
from urdfkin.errors.display import Strong, TextDocument
from urdfkin.model.configuration import draw
from urdfkin.robot import Robot
from urdfkin.system.files import at_home
from urdfkin.verify.tables import TableCheck
from urdfkin.verify.verifier import TABLE_SAMPLES

#: Formats for several tables
_FORMATS_OF_SEVERAL = ("terminal", "markdown", "latex", "json")
#: In these formats, the check's result is printed below the table; otherwise it goes to stderr.
_PRINTED = ("terminal", "markdown")
#: Formats for people
_TEXTS = (*_PRINTED, "html", "latex")
#: Digits of base and tool in formats that round numbers are --digits, or the given number.
_ROUNDED = {"terminal": None, "markdown": None, "latex": 6}


@dataclass(frozen=True, slots=True)
class Work:
    """The command's options; `choices` are other arguments of `Robot.dh`.

    `written` is the file of the table, if ROBOT is a table that the command writes unchanged. If `written` is
    None, the command derives a table from the robot.
    """

    robot: Robot
    written: str | None
    choices: dict[str, Any]
    base: str | None
    tip: str | None
    all_: bool
    tree: bool
    convention: str | None
    snap: float
    like: str | None
    compare: str | None
    tolerance: float
    fit: bool
    format_: str
    degrees: bool
    millimetres: bool
    digits: int
    columns: tuple[str, ...]

    @property
    def units(self) -> Units:
        return Units(
            Angles.DEGREES if self.degrees else Angles.RADIANS,
            Lengths.MILLIMETRES if self.millimetres else Lengths.METRES,
            self.digits,
            self.columns,
        )


def run(work: Work) -> Answer:
    chosen = [
        name for name, on in (("--all", work.all_), ("--tree", work.tree), ("--compare", work.compare)) if on
    ]
    if len(chosen) > 1:
        raise InputError(
            f"{' and '.join(chosen)} cannot be used together", remedy="use only one of these options"
        )
    if work.compare is not None:
        return _compare(work, work.compare)
    if work.tree:
        return _tree(work)
    return _tables(work)


# -- tables --------------------------------------------------------------------------------------------


def _tables(work: Work) -> Answer:
    tree = work.robot.tree
    tips = [tree.links[leaf] for leaf in tree.leaves()] if work.all_ else [work.tip]
    if len(tips) > 1 and work.format_ not in _FORMATS_OF_SEVERAL:
        raise InputError(
            f"--all does not support the format {work.format_!r}",
            remedy=f"use --format {', '.join(_FORMATS_OF_SEVERAL)}",
        )
    verifier = work.robot.verifier
    tables = [_make_table(work, tip, work.snap) for tip in tips]
    made = [(table, verifier.table(table) if verifier.policy else None) for table in tables]
    if work.format_ == "json":
        documents = [_document(table, check) for table, check in made]
        text = json.dumps(documents if work.all_ else documents[0], indent=2) + "\n"
    else:
        text = "\n".join(_format_table(work, table, check) for table, check in made)
    if work.format_ not in (*_PRINTED, "json"):
        for table, check in made:
            for line in _notes(work, table, check).split("\n"):
                say(line, err=True)
    return _answer(work, text, 0 if all(check is not None and check.within for _, check in made) else 3)


def _make_table(work: Work, tip: str | None, snap: float) -> DHTable:
    robot, base = work.robot, work.base
    if work.written is not None:
        table = read_table_or_screws(at_home(work.written))
        # `Robot.dh` derives a table from screws in the same way as from a URDF.
        if isinstance(table, DHTable):
            return to_convention(table, work.convention or table.convention)
    like = None
    if work.like is not None:
        like = read_table(reference_path(work.like))
        tip, base = (
            tip or _frame_of_robot(work, like.tip_frame),
            base or _frame_of_robot(work, like.base_frame),
        )
    if base is None and work.all_:
        base = robot.tree.links[1 if robot.tree.links[0] == "universe" else 0]
    convention = work.convention or (like.convention if like else "standard")
    return robot.dh(tip, base, convention, snap=snap, like=like, verify=False, **work.choices)


def _format_table(work: Work, table: DHTable, check: TableCheck | None) -> str:
    if work.format_ == "urdf":
        return to_urdf(table)
    if work.format_ == "svg":
        from urdfkin.view.dh_drawing import drawing

        return drawing(table)
    text = export(table, work.format_, work.units, verify=bool(work.robot.verifier.policy))
    return f"{text}\n{_notes(work, table, check)}\n" if work.format_ in _PRINTED else text


def _notes(work: Work, table: DHTable, check: TableCheck | None) -> str:
    """Return the lines under a table: the check, the error of the printed digits, and hints."""
    lines = [check_of_path(check)[0]]
    if work.format_ in _ROUNDED:
        lines.append(str(printed(table, work.units, _ROUNDED[work.format_])))
    if work.written is None and (
        hint := snap_hint(table, lambda snap: _make_table(work, table.tip_frame, snap))
    ):
        lines.append(f"hint: {hint}")
    if work.like is None and work.format_ in _PRINTED:
        lines += [f"hint: {line}" for line in published(work.robot.origin.source)]
    return "\n".join(lines)


def _document(table: DHTable, check: TableCheck | None) -> dict[str, Any]:
    return {**to_mapping(table), "checked": check_of_path(check)[0]}


# -- the whole tree ------------------------------------------------------------------------------------


def _tree(work: Work) -> Answer:
    parameters = tree_parameters(work.robot.tree)
    if work.format_ == "json":
        text = json.dumps(as_mapping(parameters), indent=2, allow_nan=False) + "\n"
    elif work.format_ == "csv":
        text = as_csv(parameters)
    elif work.format_ in _TEXTS:
        text = tree_document(parameters, work.units).written(work.format_)
    else:
        raise InputError(
            f"--tree does not support the format {work.format_!r}",
            remedy=f"use {', '.join(_TEXTS)}, csv or json",
        )
    check = work.robot.verifier.tree_parameters(parameters) if work.robot.verifier.policy else None
    if work.format_ in _PRINTED:
        text += f"\n{check or check_of_path(None)[0]}\n"
        q = draw(work.robot.tree, TABLE_SAMPLES, np.random.default_rng(1), with_special=True).q
        text += f"{printed_tree(parameters, work.units, q)}\n"
    else:
        say(str(check or check_of_path(None)[0]), err=True)
    return _answer(work, text, 0 if check is not None else 3)


# -- a comparison --------------------------------------------------------------------------------------


def _compare(work: Work, name: str) -> Answer:
    if work.format_ not in (*_TEXTS, "json"):
        raise InputError(
            f"--compare does not support the format {work.format_!r}",
            remedy=f"use {', '.join(_TEXTS)} or json",
        )
    path = reference_path(name)
    data = read_mapping(path)
    tip = work.tip or _frame_of_robot(work, data.get("tip_frame"))
    base = work.base or _frame_of_robot(work, data.get("base_frame"))
    chain, tolerance = work.robot.chain(tip, base), work.tolerance / 1e3
    notes: list[str] = []
    if "convention" not in data:
        convention = convention_that_fits(chain, data, tolerance, str(path))
        data = {**data, "convention": convention}
        notes = [
            f"The table names no convention; {convention} fits best. Write the convention into the table."
        ]
    try:
        reference = table_of(data, str(path))
    except InputError as error:
        if slip := diagnose(chain, data, tolerance):
            error.remedy = f"{error.remedy}; {slip}" if error.remedy else str(slip)
        raise
    found = compare(chain, reference, tolerance, fit=work.fit, digits=last_digits(data))
    slip = None if found.agrees or found.mistakes else diagnose(chain, data, tolerance, found.metres)
    if work.format_ == "json":
        text = json.dumps(_comparison(found, reference, slip), indent=2, allow_nan=False) + "\n"
    else:
        document = comparison_document(found, work.units)
        hints = ["", f"hint: {slip}"] if slip else []
        parts = [*notes, Strong(document.title), *document.parts, *hints]
        text = TextDocument("", parts).written(work.format_)
    return _answer(work, text, 0 if found.passes else 1)


def _frame_of_robot(work: Work, name: object) -> str | None:
    return name if isinstance(name, str) and name in work.robot.frame_names else None


def _comparison(
    found: TableComparison, reference: DHTable, slip: BetterInterpretation | None
) -> dict[str, Any]:
    return {
        "passes": found.passes,
        "agrees": found.agrees,
        "exact": found.exact,
        "read_as": str(reference.convention),
        "tip_off_at_most_m": found.metres,
        "tip_turned_at_most_rad": found.radians,
        "proven_tip_off_at_most_m": found.most_metres,
        "proven_tip_turned_at_most_rad": found.most_radians,
        "as_written_tip_off_at_most_m": found.written_metres,
        "as_written_tip_turned_at_most_rad": found.written_radians,
        "base_took_up": {"metres": found.base.metres, "radians": found.base.radians},
        "tool_took_up": {"metres": found.tool.metres, "radians": found.tool.radians},
        "residual_m": found.residual,
        "samples": found.samples,
        "senses": list(found.senses),
        "offsets": list(found.offsets),
        "not_compared": [{"row": row + 1, "cell": cell} for row, cell in found.hidden],
        "differences": [_difference(one) for one in found.differences],
        "likely_mistakes": [_mistake(one) for one in found.mistakes],
        "would_fit_read_as": slip and slip.as_mapping(),
        "without_fitting": [_difference(one) for one in found.instead],
        "fitted": to_mapping(found.reference),
    }


def _difference(one: CellDifference) -> dict[str, Any]:
    return {
        "row": one.row + 1,
        "joint": one.joint,
        "cell": one.cell,
        "table": one.reference,
        "urdf": one.urdf,
        "tip_m": one.tip,
        "within_last_digit": one.is_rounding,
    }


def _mistake(one: Mistake) -> dict[str, Any]:
    return {
        "kind": str(one.kind),
        "rows": [row + 1 for row in one.rows],
        "cell": one.cell and _difference(one.cell),
        "still_fitted": asdict(one.fitted),
        "tip_off_at_most_m": one.metres,
        "tip_turned_at_most_rad": one.radians,
    }


def _answer(work: Work, text: str, code: int) -> Answer:
    return Answer(lambda: TextDocument(""), {work.format_: lambda: text}, code=code)
