"""Where a robot comes from and how it was asked for, in words that ask for it again."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from typing import Literal

from urdfkin.errors.demands import switch, word


@dataclass(frozen=True, slots=True)
class Origin:
    """What was given to `load`.

    Attributes:
        source: A path, a catalogue name, `-`; text, bytes and streams without a name are `<text>`, `<bytes>`.
        mimic: As it was given.
        root_joint: As it was given.
        xacro_args: Names and values.
        oracle: Who checks besides Pinocchio or in its place, if anybody.
        table: Whether it is a table, whose frames between base and tip are its convention's, not links that
            somebody placed.
        sha256: The digest of the MJCF that the URDF was made of; empty where the URDF itself was given.

    Raises:
        InputError: `mimic` is neither True, False nor None, or `root_joint` is no name.
    """

    source: str
    mimic: bool | None = None
    root_joint: str | None = None
    xacro_args: tuple[tuple[str, str], ...] = ()
    oracle: Literal["pinocchio", "mujoco"] | None = None
    table: bool = False
    sha256: str = ""

    def __post_init__(self) -> None:
        if self.mimic is not None:
            switch(self.mimic, "mimic")
        if self.root_joint is not None:
            word(self.root_joint, "root_joint")

    @property
    def again(self) -> str:
        """What to pass to `load` to read it again; a text has to come from standard input."""
        return "-" if self.source.startswith("<") else self.source

    @property
    def options(self) -> str:
        """What a command line says besides.

        >>> Origin("arm.xacro", mimic=False, xacro_args=(("arm", "left one"),)).options
        "--xacro-arg 'arm:=left one' --no-mimic"
        """
        words = [f"--xacro-arg {shlex.quote(f'{name}:={value}')}" for name, value in self.xacro_args]
        if self.mimic is not None:
            words.append("--mimic" if self.mimic else "--no-mimic")
        if self.root_joint is not None:
            words.append(f"--root-joint {shlex.quote(self.root_joint)}")
        if self.oracle is not None:
            words.append(f"--oracle {self.oracle}")
        return " ".join(words)

    @property
    def words(self) -> str:
        """The robot on a command line.

        >>> Origin("my arm.urdf", root_joint="floating").words
        "'my arm.urdf' --root-joint floating"
        >>> Origin("<text>").words
        '-'
        """
        return " ".join(filter(None, (shlex.quote(self.again), self.options)))

    @property
    def python(self) -> str:
        """The robot in Python.

        >>> Origin("panda", mimic=False).python
        "urdfkin.load('panda', mimic=False)"
        """
        given = {
            "mimic": self.mimic,
            "root_joint": self.root_joint,
            "xacro_args": dict(self.xacro_args) or None,
            "oracle": self.oracle,
        }
        arguments = [f"{name}={value!r}" for name, value in given.items() if value is not None]
        return f"urdfkin.load({', '.join([repr(self.again), *arguments])})"
