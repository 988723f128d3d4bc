"""Comments for urdfkin: what they silence, and where."""

from tests.lint.cases.arm import ACCEPT, REJECT, WARN, Case, arm, axis

_SAID = "<!-- urdfkin: ignore[{}] as drawn -->"
_LONG = '<axis xyz="0 0 2"/>'


def _before(comment: str, text: str = arm(axis=_LONG)) -> str:
    """The comment on a line of its own before the joint with the long axis; everything else as before."""
    return text.replace('  <joint name="j1"', f'  {comment}\n  <joint name="j1"')


CASES = [
    Case("silenced-before-the-joint", _before(_SAID.format("URDF503")), ACCEPT),
    Case("silenced-by-its-name", _before(_SAID.format("axis-not-unit")), ACCEPT),
    Case("silenced-with-others", _before(_SAID.format("URDF601, URDF503")), ACCEPT, [("URDF121", 6)]),
    Case(
        "silenced-behind-it",
        arm(axis=_LONG).replace("</joint>", "</joint> " + _SAID.format("503"), 1),
        ACCEPT,
    ),
    Case(
        "silenced-for-the-file",
        arm(head='<?xml version="1.0" encoding="cp1252"?>\n' + _SAID.format("104 503"), axis=_LONG),
        ACCEPT,
    ),
    Case(
        "silenced-elsewhere",
        arm(axis=_LONG, more=_SAID.format("URDF503")),
        WARN,
        [("URDF503", 6), ("URDF121", 8)],
    ),
    Case("silenced-another-code", _before(_SAID.format("URDF601")), WARN, [("URDF503", 7), ("URDF121", 6)]),
    Case("silenced-without-a-reason", _before("<!--urdfkin: ignore[503]-->"), WARN, [("URDF120", 6)]),
    Case("silenced-no-code", _before(_SAID.format("")), WARN, [("URDF120", 6), ("URDF503", 7)]),
    Case("silenced-unknown-code", _before(_SAID.format("URDF5O3")), WARN, [("URDF120", 6), ("URDF503", 7)]),
    Case("silence-not-understood", _before("<!-- urdfkin: noqa -->"), WARN, [("URDF120", 6)]),
    Case(
        "an-error-cannot-be-silenced",
        _before(_SAID.format("URDF502"), axis("0 0 0")),
        REJECT,
        [("URDF502", 7), ("URDF121", 6)],
    ),
    Case("a-comment-for-others", _before("<!-- noqa: URDF503 urdfkin: ignore -->"), WARN, [("URDF503", 7)]),
]
