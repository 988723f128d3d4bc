"""The shell command that computes one case again, for error messages and reports."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence

from urdfkin.urdf.sources import Origin


def replay_line(
    origin: Origin, command: str, frame: str, reference: str | None, values: Mapping[str, Sequence[float]]
) -> str:
    """Return the shell command that computes one case again, with enough digits to be exact.

    >>> replay_line(Origin("ur5"), "velocity", "tool 0", "local", {"q": [0.5, 0.1], "v": []})
    "urdfkin velocity ur5 --frame 'tool 0' --reference local --q 0.5,0.1 --v neutral"
    """
    words = ["urdfkin", command, origin.words, "--frame", shlex.quote(frame)]
    if reference:
        words += ["--reference", reference]
    for letter, numbers in values.items():
        words += [f"--{letter}", ",".join(repr(float(x)) for x in numbers) or "neutral"]
    return " ".join(words)
