"""`urdfkin.check`: findings about anything that can hold a URDF, without computing anything."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from urdfkin.demands import switch, word
from urdfkin.lint import DEFAULT_LIMITS, Finding, Limits
from urdfkin.lint.reporter import Reporter
from urdfkin.lint.rules.meshes import check_meshes
from urdfkin.lint.runner import check_robot, read_document
from urdfkin.sources import Source, Text, read_source


def check(
    source: Source,
    *,
    limits: Limits = DEFAULT_LIMITS,
    mimic: bool | None = None,
    root_joint: str | None = None,
    xacro_args: Mapping[str, object] | None = None,
    fold: bool = False,
) -> list[Finding]:
    """Findings about a URDF, by line.

    Besides what the text itself tells, packages and files that meshes are said to lie in are looked for; no
    mesh is opened.

    Args:
        source: A path, a name of the catalogue, URDF text, bytes, an open file, or `-` for standard input.
        limits: How large the file may be.
        mimic: Whether mimic joints are to follow; without, what is wrong with them is a note. None: True,
            except for the robots whose catalogue entry says that theirs cannot work.
        root_joint: `"floating"` or `"planar"` when the robot will hang from such a joint.
        xacro_args: Arguments for a .xacro file, which is expanded first; lines are those of the result.
        fold: Whether many warnings of one kind are folded into one that lists the lines, and errors from the
            hundredth of a kind on into that one.

    Returns:
        The findings; an empty list for a file nothing can be said against. Of each kind 10,000 are written
        out; `also` of the last holds the lines of the others.

    Raises:
        SourceError: the file cannot be read.
        UnknownNameError: neither a file nor a name of the catalogue; the nearest names are offered.
        InputError: something else than a source.

    >>> for finding in check('<robot name="r"><link name="base"/><link name="stray"/></robot>'):
    ...     print(finding)  # doctest: +ELLIPSIS
    <text>:1:42: URDF411 error: link 'stray': the link has no parent, and neither has "base"; ...
    """
    if mimic is not None:
        switch(mimic, "mimic")
    if root_joint is not None:
        word(root_joint, "root_joint")
    switch(fold, "fold")
    text = read_source(source, limits.bytes, xacro_args)
    if mimic is None:
        mimic = text.entry is None or text.entry.mimic
    report = Reporter(text.label, text.data, limits)
    root = read_document(report, text.data)
    if root is not None and check_robot(report, root, mimic=mimic, root_joint=root_joint) is not None:
        check_meshes(report, root, _file(text))
    return list(report.findings(fold=fold))


def _file(text: Text) -> Path | None:
    """The file a text was read from, which tells where its packages may lie."""
    path = Path(text.source if text.entry is None else text.label)
    return None if text.source in ("-", "<text>", "<bytes>") or not path.is_file() else path
