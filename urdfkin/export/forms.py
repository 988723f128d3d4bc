"""Export code that follows a URDF's joints, the rows of a Denavit-Hartenberg table, or screws.

A table or a product of exponentials is first converted to a robot with one joint for each row or screw.
"""

from __future__ import annotations

import warnings
from collections.abc import Collection
from dataclasses import replace
from typing import Any

from urdfkin.dh.convert import link_names
from urdfkin.dh.export.text import table_document
from urdfkin.dh.screws import ProductOfExponentials, screws_document
from urdfkin.dh.table import DHTable
from urdfkin.dh.units import Units
from urdfkin.errors import InputError, UnknownNameError
from urdfkin.export import DEFAULT_QUANTITIES, FORMS
from urdfkin.export.code import FrameCode, make_verified_code
from urdfkin.export.naming import safe_name, unique_safe_names
from urdfkin.model.chain import joints_between
from urdfkin.model.reference import Reference
from urdfkin.system.lazy_import import get_hook
from urdfkin.urdf.findings import UrdfWarning


def make_robot_code(
    robot: Any,
    frame: str,
    quantities: Collection[str],
    reference: Reference | str,
    form: str = "tree",
    *,
    name: str | None = None,
    verify: bool | None = None,
) -> FrameCode:
    if form not in FORMS:
        raise UnknownNameError("form", form, FORMS)
    verify = bool(robot.verifier.resolve_policy(verify))
    if form == "tree":
        return make_verified_code(
            robot.verifier, robot.plan, frame, quantities, reference, name=name, verify=verify
        )
    for joint, _ in joints_between(robot.tree, frame, robot.base_frame):
        if joint.kind.nq and not joint.kind.has_axis:
            raise InputError(
                f"the form {form} cannot contain a {joint.kind.value} joint",
                where=f"joint {joint.name}",
                found=f"this joint lies between {robot.base_frame} and {frame}",
                remedy="use the form tree, or another frame",
            )
    chain = robot.dh(frame, verify=verify) if form == "dh" else robot.screws(frame, verify=verify)
    code = make_chain_code(chain, quantities, reference, name=name, verify=verify)
    return replace(code, maybe_proof=replace(code.proof, lock=robot.origin.lock))


def make_chain_code(
    chain: DHTable | ProductOfExponentials,
    quantities: Collection[str] | None = None,
    reference: Reference | str = Reference.LOCAL_WORLD_ALIGNED,
    *,
    name: str | None = None,
    verify: bool = True,
) -> FrameCode:
    """Return code for the last frame of a chain.

    The chain's base is the world frame.
    """
    if isinstance(chain, DHTable):
        text, chain = table_document(chain, Units()).text(), _replace_unsafe_names(chain)
    else:
        text = screws_document(chain).text()
    with warnings.catch_warnings():
        # The user did not write the generated URDF, so warnings about it do not help.
        warnings.simplefilter("ignore", UrdfWarning)
        robot = get_hook("a robot of a source")(chain, verify=verify)
    tip = link_names(chain)[-1] if isinstance(chain, DHTable) else robot.link_names[-1]
    frame = robot.tree.frame_name(robot.link_names.index(tip))
    if quantities is None:
        quantities = DEFAULT_QUANTITIES if robot.nv else DEFAULT_QUANTITIES[:1]
    return make_verified_code(
        robot.verifier,
        robot.plan,
        frame,
        quantities,
        reference,
        name=name,
        verify=verify,
        about=text,
    )


def _replace_unsafe_names(table: DHTable) -> DHTable:
    """Replace every name by a safe identifier, because a URDF does not allow all names."""
    names = dict.fromkeys(
        [table.base_frame, *(row.joint for row in table.rows), *table.joint_names, table.tip_frame]
    )
    new = dict(zip(names, unique_safe_names(names), strict=True))
    rows = tuple(
        replace(
            row,
            joint=new[row.joint],
            mimic=row.mimic and replace(row.mimic, mimicked_joint=new[row.mimic.mimicked_joint]),
        )
        for row in table.rows
    )
    base, tip = new[table.base_frame], new[table.tip_frame]
    return replace(table, robot=safe_name(table.robot), base_frame=base, tip_frame=tip, rows=rows)
