"""Where a robot comes from and how it was asked for, in words that ask for it again.

Where a robot comes from: a path, `package://...`, a catalogue name, text, bytes, an open file, or `-`.
"""

from __future__ import annotations

import os
import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Literal, TypeGuard

from urdfkin.errors import InputError, Question, SourceError, UnknownNameError, nearest
from urdfkin.errors.validators import as_bool, as_str, safe_repr
from urdfkin.system.files import MOST, at_home, exists, read_start, read_start_of_standard_input
from urdfkin.urdf.catalogue import Entry, catalogue
from urdfkin.urdf.packages import find_package, split_uri


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
            as_bool(self.mimic, "mimic")
        if self.root_joint is not None:
            as_str(self.root_joint, "root_joint")

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


#: What `load` and `check` take.
Source = str | os.PathLike[str] | bytes | IO[str] | IO[bytes]


@dataclass(frozen=True, slots=True)
class Text:
    """A URDF that was read.

    Attributes:
        data: Its bytes.
        label: What to call it in messages: the path, `<text>`, `<stdin>`.
        source: What to give again to get it again; `<text>`, `<bytes>` or `<file>` where that has no name.
        entry: The catalogue's entry, if that is where it came from.
        xacro_args: Names and values that it was expanded with.
        sha256: The digest of the MJCF that it was made of; empty for a URDF.
    """

    data: bytes
    label: str
    source: str
    entry: Entry | None = None
    xacro_args: tuple[tuple[str, str], ...] = ()
    sha256: str = ""


def read_source(source: Source, most: int = MOST, xacro_args: Mapping[str, object] | None = None) -> Text:
    """The bytes of a URDF, wherever it is.

    A catalogue name comes before a file of the same name without a folder; write `./panda` for the file.

    Args:
        source: Any of the above.
        most: Bytes (characters, for text files) after which reading ends, with one more, so that the checks
            see that there are too many: a device may never end.
        xacro_args: Arguments for a .xacro file, which is expanded.

    Raises:
        SourceError: the file cannot be read.
        UnknownNameError: neither a file nor a name of the catalogue, or an argument that the xacro file does
            not take; the nearest names are offered.
        InputError: something else than a source.
    """
    if xacro_args is not None and not isinstance(xacro_args, Mapping):
        raise InputError("xacro_args are a mapping from names to values", found=safe_repr(xacro_args))
    if isinstance(source, str) and (address := split_uri(source)) is not None:
        source = _in_package(*address)
    if is_xacro(source):
        return _expanded(at_home(source), xacro_args or {})
    if xacro_args:
        raise InputError(
            "xacro_args go with the path of a .xacro file", found=", ".join(map(str, xacro_args))
        )
    if isinstance(source, bytes):
        return Text(source, "<bytes>", "<bytes>")
    if isinstance(source, os.PathLike):
        return _read_file(Path(source), most)
    if isinstance(source, str):
        return _read_word(source, most)
    if hasattr(source, "read"):
        label = str(getattr(source, "name", "<file>"))
        return _encoded(source.read(most + 1), label, label)
    raise InputError(
        "a robot comes from a path, a catalogue name, URDF text, bytes or an open file",
        found=type(source).__name__,
    )


def is_xacro(source: object) -> TypeGuard[str | os.PathLike[str]]:
    """Whether a source is the path of a xacro file, by its name.

    >>> is_xacro("arm.urdf.xacro"), is_xacro("arm.urdf"), is_xacro("<robot/>")
    (True, False, False)
    """
    if isinstance(source, str) and source.lstrip().startswith("<"):
        return False
    return isinstance(source, str | os.PathLike) and Path(source).suffix.lower() == ".xacro"


def _expanded(path: Path, arguments: Mapping[str, object]) -> Text:
    from urdfkin.urdf.xacro import expand  # noqa: PLC0415  only for those who pass xacro

    words = {name: str(value) for name, value in arguments.items()}
    return Text(expand(path, words), f"{path} (expanded)", as_word(path), xacro_args=tuple(words.items()))


def _read_word(word: str, most: int) -> Text:
    if not word.strip():
        raise InputError(
            "no robot is named", found=repr(word), remedy="a path, a name that 'urdfkin robots' lists, or '-'"
        )
    if word == "-":
        return Text(read_start_of_standard_input(most + 1), "<stdin>", "-")
    if word.lstrip("\ufeff \t\r\n").startswith("<"):
        return _encoded(word, "<text>", "<text>")
    if (entry := catalogue().get(word)) is not None:
        read = _read_file(entry.path, most)
        return Text(read.data, read.label, word, entry)
    path = at_home(word)
    if os.sep in word or path.suffix or exists(path):
        return _read_file(path, most)
    raise UnknownNameError("robot", word, catalogue(), where="neither a file nor in the catalogue")


def _in_package(name: str, path: str) -> Path:
    """The file of a `package://` address, which the current folder is searched for, too."""
    folder = find_package(name, Path(path).absolute())
    if folder is None:
        raise SourceError(
            f"the package {name!r} is not found",
            where=f"package://{name}/{path}",
            remedy="put its folder into ROS_PACKAGE_PATH, or name the file by its path",
            question=Question.PACKAGES_AND_MESHES,
        )
    return folder / path


def _encoded(content: str | bytes, label: str, source: str) -> Text:
    # A lone surrogate cannot be encoded; it reaches the checks as the bytes they refuse.
    data = content if isinstance(content, bytes) else content.encode("utf-8", "surrogatepass")
    return Text(data, label, source)


def _read_file(path: Path, most: int) -> Text:
    try:
        return Text(read_start(path, most + 1, pipes=True), str(path), as_word(path))
    except SourceError as error:
        if isinstance(error.__cause__, FileNotFoundError):
            raise SourceError("no such file", where=str(path), remedy=_nearest_file(path)) from None
        if isinstance(error.__cause__, IsADirectoryError):
            raise SourceError(
                "a folder, not a file", where=str(path), remedy="name the .urdf inside"
            ) from None
        raise


def as_word(path: Path) -> str:
    """A path that cannot be taken for a name of the catalogue, an option, standard input or text."""
    word = str(path)
    return f"./{word}" if word in catalogue() or word.startswith(("-", "<")) else word


def _nearest_file(path: Path) -> str:
    try:
        names = [entry.name for entry in path.parent.iterdir()]
    except OSError:
        return f"there is no folder {path.parent}"
    close = nearest(path.name, names)
    return f"did you mean {', '.join(close)}?" if close else "'urdfkin robots' lists names that need no file"
