"""Comments that are meant for urdfkin: what they silence, and those that say or do nothing."""

from __future__ import annotations

import re
from collections.abc import Callable

from urdfkin.errors import InputError, UrdfkinError
from urdfkin.lint.escape import quoted
from urdfkin.lint.reporter import Reporter
from urdfkin.lint.rule import NOTE, WARNING, Rule
from urdfkin.lint.silence import Comment, Silence, Silences

BAD_COMMENT = Rule("URDF120", "bad-comment", WARNING)
UNUSED_COMMENT = Rule("URDF121", "unused-comment", NOTE)

_FORM = re.compile(r"\s*urdfkin:\s*ignore\s*\[([^\]]*)\]\s*(.*)", re.DOTALL)


def read_comments(report: Reporter, find_rule: Callable[[str], Rule]) -> None:
    """Obey the comments of a document that was read, and report those that cannot be understood.

    Args:
        report: The file.
        find_rule: A rule by its code or short name.
    """
    silences = Silences()
    for comment in report.comments:
        if (silence := _read(report, comment, find_rule)) is not None:
            silences.add(silence)
    report.silence(silences)


def _read(report: Reporter, comment: Comment, find_rule: Callable[[str], Rule]) -> Silence | None:
    try:
        codes, reason = _said(comment.text, find_rule)
    except UrdfkinError as error:
        report.add(
            BAD_COMMENT,
            f"{error.what}, so the comment silences nothing",
            found=quoted(f"<!--{comment.text}-->"),
            remedy=error.remedy,
            position=(comment.line, comment.column),
        )
        return None
    return Silence(comment, codes, reason)


def _said(text: str, find_rule: Callable[[str], Rule]) -> tuple[tuple[str, ...], str]:
    """The codes and the reason of a comment."""
    match = _FORM.fullmatch(text)
    words = re.split(r"[,\s]+", match[1].strip(", \t\r\n")) if match else [""]
    if match is None or words == [""]:
        raise InputError(
            "no code in brackets", remedy="write <!-- urdfkin: ignore[URDF503] why that is meant -->"
        )
    if not (reason := " ".join(match[2].split())):
        raise InputError("no reason is given", remedy="say behind the bracket why that is meant")
    return tuple(dict.fromkeys(find_rule(word).id for word in words)), reason


def check_unused(report: Reporter) -> None:
    """Report codes of comments that silenced no finding, once all rules were applied."""
    for silence in report.silences.all:
        for code in silence.codes:
            if code not in silence.used:
                report.add(
                    UNUSED_COMMENT,
                    f"{code} is silenced where there is no warning and no note of it",
                    found=quoted(f"<!--{silence.comment.text}-->"),
                    remedy="remove it; an error cannot be silenced",
                    position=(silence.comment.line, silence.comment.column),
                )
