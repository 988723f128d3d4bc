"""Make the tables of `urdfkin dh`, and compare a robot with a table."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from urdfkin.cli.options import lock_settings, locked_line
from urdfkin.cli.output import Answer, format_pinocchio_check
from urdfkin.cli.streams import say
from urdfkin.dh import DHTable, Units, export, read_table, to_convention
from urdfkin.dh.compare import (
    BetterInterpretation,
    CellDifference,
    Mistake,
    TableComparison,
    compare,
    comparison_document,
    fast_fit_errors,
    find_better_interpretation,
    find_dh_convention,
)
from urdfkin.dh.convert import link_names, to_urdf
from urdfkin.dh.export.data import to_mapping
from urdfkin.dh.export.text import measure_printed_table
from urdfkin.dh.parse_table import (
    parse_table_data,
    read_mapping,
    read_table_or_screws,
    reference_path,
    suggest_published_tables,
)
from urdfkin.dh.rows import half_digits_by_row
from urdfkin.dh.snapping import snap_hint
from urdfkin.dh.tree_parameters import (
    as_csv,
    as_mapping,
    make_tree_parameters,
    measure_printed_tree,
    tree_document,
)
from urdfkin.dh.units import AngleUnit, LengthUnit
from urdfkin.errors import InputError
from urdfkin.errors.display import Strong, TextDocument
from urdfkin.model.chain import FrameChain
from urdfkin.model.configuration import draw_samples
from urdfkin.model.tree import LinkFrame
from urdfkin.robot import Robot
from urdfkin.system.files import expand_home
from urdfkin.verify.tables import TableCheck
from urdfkin.verify.verifier import TABLE_SAMPLES

_MULTI_TABLE_FORMATS = ("terminal", "markdown", "latex", "json")
#: Formats in which the result of the check is printed below the table.
_FORMATS_WITH_CHECK_LINE = ("terminal", "markdown")
_DOCUMENT_FORMATS = (*_FORMATS_WITH_CHECK_LINE, "html", "latex")
#: Number of significant digits of the base and tool transforms, for each format with rounded numbers. None
#: means the value of `--digits`.
_TRANSFORM_DIGITS = {"terminal": None, "markdown": None, "latex": 6}


@dataclass(frozen=True, slots=True)
class DHRequest:
    """The values of the options of `urdfkin dh`.

    `unchanged_table` is the path of a file with a table or screws. It is None if ROBOT is another input, or
    if an option such as --tip requires a new table. `dh_arguments` are arguments of `Robot.dh`.
    """

    robot: Robot
    unchanged_table: str | None
    dh_arguments: dict[str, Any]
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
            AngleUnit.DEGREES if self.degrees else AngleUnit.RADIANS,
            LengthUnit.MILLIMETRES if self.millimetres else LengthUnit.METRES,
            self.digits,
            self.columns,
        )


def make_dh_answer(request: DHRequest) -> Answer:
    modes = {"--all": request.all_, "--tree": request.tree, "--compare": request.compare}
    chosen = [name for name, value in modes.items() if value]
    if len(chosen) > 1:
        raise InputError(
            f"{' and '.join(chosen)} cannot be used together", remedy="use only one of these options"
        )
    if request.compare is not None:
        return _make_comparison_answer(request, request.compare)
    return _make_tree_answer(request) if request.tree else _make_tables_answer(request)


def _require_format(request: DHRequest, option: str, formats: Sequence[str]) -> None:
    if request.format_ not in formats:
        raise InputError(
            f"{option} does not support the format {request.format_!r}",
            remedy=f"use --format {', '.join(formats)}",
        )


# -- tables --------------------------------------------------------------------------------------------


def _make_tables_answer(request: DHRequest) -> Answer:
    tree, verifier, format_ = request.robot.tree, request.robot.verifier, request.format_
    tips = [tree.links[leaf] for leaf in tree.leaves()] if request.all_ else [request.tip]
    if len(tips) > 1:
        _require_format(request, "--all", _MULTI_TABLE_FORMATS)
    tables = [_make_table(request, tip, request.snap) for tip in tips]
    checks = [
        verifier.check_table(_with_link_frames(request, table)) if verifier.policy else None
        for table in tables
    ]
    results = list(zip(tables, checks, strict=True))
    if format_ == "json":
        lock = lock_settings(request.robot)
        documents = [
            {**to_mapping(table), **lock, "checked": format_pinocchio_check(check)[0]}
            for table, check in results
        ]
        text = json.dumps(documents if request.all_ else documents[0], indent=2) + "\n"
    else:
        text = "\n".join(_format_table(request, table, check) for table, check in results)
    if format_ not in (*_FORMATS_WITH_CHECK_LINE, "json"):
        for table, check in results:
            for line in _lines_below_table(request, table, check):
                say(line, err=True)
    code = 0 if all(check is not None and check.is_within_bounds for check in checks) else 3
    return _make_answer(request, text, code)


def _make_table(request: DHRequest, tip: str | None, snap: float) -> DHTable:
    robot, base = request.robot, request.base
    if request.unchanged_table is not None:
        table = read_table_or_screws(expand_home(request.unchanged_table))
        # If the file contains screws, the rest of this function derives a table.
        if isinstance(table, DHTable):
            return to_convention(table, request.convention or table.convention)
    like = None
    if request.like is not None:
        like = read_table(reference_path(request.like))
        tip = _frame_of_robot(request, like.tip_frame) if tip is None else tip
        base = _frame_of_robot(request, like.base_frame) if base is None else base
    if base is None and request.all_:
        base = robot.tree.links[1 if robot.tree.links[0] == "universe" else 0]
    convention = request.convention or (like.convention if like else "standard")
    return robot.dh(tip, base, convention, snap=snap, like=like, verify=False, **request.dh_arguments)


def _with_link_frames(request: DHRequest, table: DHTable) -> DHTable:
    """Name the table's base and tip as links, because a joint of the robot can have the same name."""
    links = link_names(table)
    # A table that is derived from screws already has unambiguous names, such as "link:tip".
    if request.unchanged_table is None or not {links[0], links[-1]} <= set(request.robot.tree.links):
        return table
    return replace(table, base_frame=LinkFrame.of(links[0]), tip_frame=LinkFrame.of(links[-1]))


def _format_table(request: DHRequest, table: DHTable, check: TableCheck | None) -> str:
    if request.format_ == "urdf":
        return to_urdf(table)
    if request.format_ == "svg":
        from urdfkin.view.dh_drawing import draw_table_svg

        return draw_table_svg(table)
    text = export(table, request.format_, request.units, verify=bool(request.robot.verifier.policy))
    if request.format_ in _FORMATS_WITH_CHECK_LINE:
        return "\n".join([text, *_lines_below_table(request, table, check), ""])
    return text


def _lines_below_table(request: DHRequest, table: DHTable, check: TableCheck | None) -> Iterator[str]:
    yield format_pinocchio_check(check)[0]
    yield from _locked_lines(request)
    if request.format_ in _TRANSFORM_DIGITS:
        yield from str(measure_printed_table(table, request.units, _TRANSFORM_DIGITS[request.format_])).split(
            "\n"
        )
    if request.unchanged_table is None and (
        hint := snap_hint(table, lambda snap: _make_table(request, table.tip_frame, snap))
    ):
        yield f"hint: {hint}"
    if request.like is None and request.format_ in _FORMATS_WITH_CHECK_LINE:
        yield from (f"hint: {line}" for line in suggest_published_tables(request.robot.origin.source))


def _locked_lines(request: DHRequest) -> list[str]:
    form = request.format_ if request.format_ in _FORMATS_WITH_CHECK_LINE else "terminal"
    line = locked_line(request.robot)
    return [TextDocument("", [line]).render(form).rstrip("\n")] if line else []


# -- the whole tree ------------------------------------------------------------------------------------


def _make_tree_answer(request: DHRequest) -> Answer:
    robot, format_ = request.robot, request.format_
    _require_format(request, "--tree", (*_DOCUMENT_FORMATS, "csv", "json"))
    parameters = make_tree_parameters(robot.tree)
    if format_ == "json":
        text = json.dumps(as_mapping(parameters) | lock_settings(robot), indent=2, allow_nan=False) + "\n"
    elif format_ == "csv":
        text = as_csv(parameters)
    else:
        text = tree_document(parameters, request.units).render(format_)
    check = robot.verifier.check_tree_parameters(parameters) if robot.verifier.policy else None
    check_line = "\n".join([str(check or format_pinocchio_check(None)[0]), *_locked_lines(request)])
    if format_ in _FORMATS_WITH_CHECK_LINE:
        q = draw_samples(robot.tree, TABLE_SAMPLES, np.random.default_rng(1), with_zero_and_limits=True).q
        text += f"\n{check_line}\n{measure_printed_tree(parameters, request.units, q)}\n"
    else:
        say(check_line, err=True)
    return _make_answer(request, text, 0 if check is not None else 3)


# -- a comparison --------------------------------------------------------------------------------------


def _make_comparison_answer(request: DHRequest, name: str) -> Answer:
    _require_format(request, "--compare", (*_DOCUMENT_FORMATS, "json"))
    path = reference_path(name)
    data = read_mapping(path)
    tip, base = request.tip, request.base
    tip = _frame_of_robot(request, data.get("tip_frame")) if tip is None else tip
    base = _frame_of_robot(request, data.get("base_frame")) if base is None else base
    chain, tolerance = request.robot.chain(tip, base), request.tolerance / 1e3
    notes: list[str] = []
    if "convention" not in data:
        convention = find_dh_convention(chain, data, tolerance, str(path))
        data = {**data, "convention": convention}
        notes = [
            f"The table names no convention; {convention} fits best. Write the convention into the table."
        ]
    try:
        reference = parse_table_data(data, str(path))
    except InputError as error:
        if mistake := find_better_interpretation(chain, data, tolerance):
            error.remedy = f"{error.remedy}; {mistake}" if error.remedy else str(mistake)
        raise
    if any(row.mimic for row in reference.rows):
        notes.append("The mimic rules of the table are not compared: each joint moves independently.")
    found = compare(chain, reference, tolerance, fit=request.fit, half_digits=half_digits_by_row(data))
    mistake = _better_interpretation(chain, data, reference, found)
    if request.format_ == "json":
        data = _comparison_data(found, reference, mistake) | lock_settings(request.robot)
        text = json.dumps(data, indent=2, allow_nan=False) + "\n"
    else:
        document = comparison_document(found, request.units)
        hints = ["", f"hint: {mistake}"] if mistake else []
        lock = [line] if (line := locked_line(request.robot)) else []
        parts = [*notes, *lock, Strong(document.title), *document.parts, *hints]
        text = TextDocument("", parts).render(request.format_)
    return _make_answer(request, text, 0 if found.agrees_without_mistakes else 1)


def _better_interpretation(
    chain: FrameChain, data: Mapping[str, Any], reference: DHTable, found: TableComparison
) -> BetterInterpretation | None:
    if found.agrees or found.mistakes:
        return None
    metres = found.metres
    if not found.is_fitted:
        # `find_better_interpretation` needs the tip error after a fit. With --no-fit, `found.metres` is the
        # tip error without a fit.
        metres, radians = fast_fit_errors(chain, reference, found.tolerance)
        if max(metres, radians * found.reach) <= found.tolerance:
            return None
    return find_better_interpretation(chain, data, found.tolerance, metres)


def _frame_of_robot(request: DHRequest, name: object) -> str | None:
    return name if isinstance(name, str) and name in request.robot.frame_names else None


def _comparison_data(
    found: TableComparison, reference: DHTable, mistake: BetterInterpretation | None
) -> dict[str, Any]:
    return {
        "passes": found.agrees_without_mistakes,
        "agrees": found.agrees,
        "exact": found.is_exact,
        "read_as": str(reference.convention),
        "tip_off_at_most_m": found.metres,
        "tip_turned_at_most_rad": found.radians,
        "proven_tip_off_at_most_m": found.metres_bound,
        "proven_tip_turned_at_most_rad": found.radians_bound,
        "proven_if": found.range_condition or None,
        "as_written_tip_off_at_most_m": found.unfitted_metres,
        "as_written_tip_turned_at_most_rad": found.unfitted_radians,
        "base_took_up": {"metres": found.base.metres, "radians": found.base.radians},
        "tool_took_up": {"metres": found.tool.metres, "radians": found.tool.radians},
        "residual_m": found.residual,
        "samples": found.samples,
        "senses": list(found.senses),
        "offsets": list(found.offsets),
        "not_compared": [
            *({"row": row + 1, "cell": cell} for row, cell in found.not_compared),
            *({"row": i, "cell": "mimic"} for i, row in enumerate(reference.rows, 1) if row.mimic),
        ],
        "differences": [_difference_data(one) for one in found.differences],
        "likely_mistakes": [_mistake_data(one) for one in found.mistakes],
        "would_fit_read_as": mistake and mistake.as_mapping(),
        "without_fitting": [_difference_data(one) for one in found.unfitted_differences],
        "fitted": to_mapping(found.fitted_table),
    }


def _difference_data(difference: CellDifference) -> dict[str, Any]:
    return {
        "row": difference.row + 1,
        "joint": difference.joint,
        "cell": difference.cell,
        "table": difference.reference,
        "urdf": difference.urdf,
        "tip_m": difference.tip_displacement,
        "within_last_digit": difference.is_rounding,
    }


def _mistake_data(mistake: Mistake) -> dict[str, Any]:
    return {
        "kind": str(mistake.kind),
        "rows": [row + 1 for row in mistake.rows],
        "cell": mistake.cell and _difference_data(mistake.cell),
        "still_fitted": asdict(mistake.fit_changes),
        "tip_off_at_most_m": mistake.metres,
        "tip_turned_at_most_rad": mistake.radians,
    }


def _make_answer(request: DHRequest, text: str, code: int) -> Answer:
    return Answer(lambda: TextDocument(""), {request.format_: lambda: text}, code=code)
