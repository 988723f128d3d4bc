"""A command that computes one case again."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence

from urdfkin.urdf.origin import Origin


def replay_line(
    origin: Origin, command: str, frame: str, reference: str | None, values: Mapping[str, Sequence[float]]
) -> str:
    """The command; numbers are written so that they read back exactly.

    Args:
        origin: The robot; a text has to be given to the command on standard input.
        command: The quantity's command.
        frame: A link or joint.
        reference: None for a placement, which has none.
        values: Numbers of q, v and a, as many of the three as the command takes.

    >>> replay_line(Origin("ur5"), "velocity", "tool 0", "local", {"q": [0.5, 0.1], "v": []})
    "urdfkin velocity ur5 --frame 'tool 0' --reference local --q 0.5,0.1 --v neutral"
    """
    words = ["urdfkin", command, origin.words, "--frame", shlex.quote(frame)]
    if reference:
        words += ["--reference", reference]
    for letter, numbers in values.items():
        words += [f"--{letter}", ",".join(repr(float(x)) for x in numbers) or "neutral"]
    return " ".join(words)
