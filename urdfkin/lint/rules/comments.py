"""Read the comments for urdfkin that silence findings, and report invalid and unused ones."""

from __future__ import annotations

import re
from collections.abc import Mapping

from urdfkin.lint.finding import quoted
from urdfkin.lint.reporter import Reporter
from urdfkin.lint.rule import NOTE, WARNING, Rule
from urdfkin.lint.suppressions import Comment, Silence, Silences

BAD_COMMENT = Rule("URDF120", "bad-comment", WARNING)
UNUSED_COMMENT = Rule("URDF121", "unused-comment", NOTE)

_FORM = re.compile(r"\s*urdfkin:\s*ignore\s*\[([^\]]*)\]\s*(.*)", re.DOTALL)
_BETWEEN = re.compile(r"[,\s]+")


def read_comments(report: Reporter, codes: Mapping[str, str]) -> None:
    """Apply the comments of a document, and report invalid ones.

    Args:
        report: The reporter of the file.
        codes: Names of codes in lower case -> code.
    """
    silences = Silences()
    for comment in report.comments:
        if (silence := _read(report, comment, codes)) is not None:
            silences.add(silence)
    report.silence(silences)


def _read(report: Reporter, comment: Comment, codes: Mapping[str, str]) -> Silence | None:
    match = _FORM.fullmatch(comment.text)
    words = [word for word in _BETWEEN.split(match[1]) if word] if match else []
    unknown = next((word for word in words if word.lower() not in codes), None)
    reason = " ".join(match[2].split()) if match else ""
    remedy: str | None
    if words and unknown is None and reason:
        return Silence(comment, tuple(dict.fromkeys(codes[word.lower()] for word in words)), reason)
    if not words:
        what, remedy = "no code in brackets", "write <!-- urdfkin: ignore[URDF503] the reason -->"
    elif unknown is not None:
        close = report.nearest(unknown.lower(), codes)
        what = f"unknown code {quoted(unknown)}"
        remedy = f"did you mean {', '.join(dict.fromkeys(codes[word] for word in close))}?" if close else None
    else:
        what, remedy = "no reason is given", "write the reason after the bracket"
    report.add(
        BAD_COMMENT,
        f"{what}, so the comment silences nothing",
        found=quoted(f"<!--{comment.text}-->"),
        remedy=remedy,
        position=(comment.line, comment.column),
    )
    return None


def check_unused(report: Reporter) -> None:
    """Report the codes of comments that silence no finding, after all rules."""
    for silence in report.silences.all:
        for code in silence.codes:
            if code not in silence.used:
                report.add(
                    UNUSED_COMMENT,
                    f"{code} is silenced, but there is no such warning or note here",
                    found=quoted(f"<!--{silence.comment.text}-->"),
                    remedy="remove it; an error cannot be silenced",
                    position=(silence.comment.line, silence.comment.column),
                )
