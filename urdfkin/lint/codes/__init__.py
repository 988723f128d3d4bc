"""Every code urdfkin can report, by its id; one module a family.

The first digit tells the family: 1 text and XML, 2 dialect and elements, 3 numbers, 4 names and structure,
5 joints, 6 suspicious, 7 inertials, geometry and materials.
"""

from __future__ import annotations

from types import ModuleType

from urdfkin.lint.codes import dialect, extras, joints, numbers, structure, suspicious, text
from urdfkin.lint.rule import Code

_FAMILIES: tuple[ModuleType, ...] = (
    text,
    dialect,
    numbers,
    structure,
    joints,
    suspicious,
    extras,
)

#: Id -> code, in the order of the ids.
REGISTRY: dict[str, Code] = {
    code.id: code
    for code in sorted(
        (value for family in _FAMILIES for value in vars(family).values() if isinstance(value, Code)),
        key=lambda code: code.id,
    )
}
