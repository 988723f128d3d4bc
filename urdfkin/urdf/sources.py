"""Read the text of a robot from a source, and record how to load the robot again.

A source is a path, a `package://` or `model://` address, a catalogue name, text, bytes, an open file, or `-`
for standard input.
"""

from __future__ import annotations

import io
import os
import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, TypeGuard, TypeVar

from urdfkin.errors import InputError, QuestionsSection, SourceError, UnknownNameError, find_similar_names
from urdfkin.errors.validators import as_bool, as_str, safe_repr
from urdfkin.system.files import MAX_BYTES, expand_home, may_exist, read_start, read_start_of_standard_input
from urdfkin.urdf.catalogue import CatalogueEntry, catalogue, find_package, split_uri

USD_SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")


def check_root_joint(root_joint: object) -> None:
    if root_joint is not None and as_str(root_joint, "root_joint") not in ("floating", "planar"):
        raise InputError("root_joint must be 'floating', 'planar' or None", found=repr(root_joint))


@dataclass(frozen=True, slots=True)
class Origin:
    """The arguments of `load`, and properties of the source.

    Attributes:
        source: A path, a catalogue name, `-` for standard input, or a word such as `<text>` or `<table>`.
        table: Whether the robot was created from a Denavit-Hartenberg table or a product of exponentials.
        sha256: The digest of an MJCF or USD file; empty for other sources.
        lock: Name and value (rad or m) of each locked joint. Mimic joints are omitted.
    """

    source: str
    mimic: bool | None = None
    root_joint: str | None = None
    xacro_args: tuple[tuple[str, str], ...] = ()
    oracle: str | None = None
    table: bool = False
    sha256: str = ""
    lock: tuple[tuple[str, float], ...] = ()
    variants: tuple[tuple[str, str], ...] = ()
    articulation: str | None = None

    def __post_init__(self) -> None:
        if self.mimic is not None:
            as_bool(self.mimic, "mimic")
        if self.root_joint is not None:
            as_str(self.root_joint, "root_joint")

    @property
    def source_argument(self) -> str:
        """The argument ROBOT of a command; `-` (standard input) for a source without a name."""
        return "-" if self.source.startswith("<") else self.source

    @property
    def command_line_options(self) -> str:
        """The options as written on a command line.

        >>> Origin("arm.xacro", mimic=False, xacro_args=(("arm", "left one"),)).command_line_options
        "--xacro-arg 'arm:=left one' --no-mimic"
        """
        words = [f"--xacro-arg {shlex.quote(f'{name}:={value}')}" for name, value in self.xacro_args]
        words += [f"--variant {shlex.quote(f'{name}={variant}')}" for name, variant in self.variants]
        if self.articulation is not None:
            words.append(f"--articulation {shlex.quote(self.articulation)}")
        if self.mimic is not None:
            words.append("--mimic" if self.mimic else "--no-mimic")
        if self.root_joint is not None:
            words.append(f"--root-joint {shlex.quote(self.root_joint)}")
        if self.oracle is not None:
            words.append(f"--oracle {self.oracle}")
        words += [f"--lock {shlex.quote(f'{name}={value!r}')}" for name, value in self.lock]
        return " ".join(words)

    @property
    def command_line(self) -> str:
        """The source and the options as written on a command line.

        >>> Origin("my arm.urdf", root_joint="floating").command_line
        "'my arm.urdf' --root-joint floating"
        >>> Origin("<text>").command_line
        '-'
        """
        return " ".join(filter(None, (shlex.quote(self.source_argument), self.command_line_options)))

    @property
    def locks_text(self) -> str:
        """The locked joints in words; an empty string if there are none.

        >>> Origin("panda", lock=(("finger", 0.04), ("wrist", 0.0))).locks_text
        'finger locked at 0.04, wrist at 0'
        """
        locks = enumerate(self.lock)
        return ", ".join(f"{name}{'' if i else ' locked'} at {value:.6g}" for i, (name, value) in locks)

    @property
    def python_call(self) -> str:
        """The call of `load` in Python.

        >>> Origin("panda", mimic=False).python_call
        "urdfkin.load('panda', mimic=False)"
        """
        values = {
            "mimic": self.mimic,
            "root_joint": self.root_joint,
            "xacro_args": dict(self.xacro_args) or None,
            "oracle": self.oracle,
            "lock": dict(self.lock) or None,
            "variant": dict(self.variants) or None,
            "articulation": self.articulation,
        }
        arguments = [f"{name}={value!r}" for name, value in values.items() if value is not None]
        return f"urdfkin.load({', '.join([repr(self.source_argument), *arguments])})"


T = TypeVar("T")

#: Types of sources for `load` and `check`.
Source = str | os.PathLike[str] | bytes | IO[str] | IO[bytes]


@dataclass(frozen=True, slots=True)
class UrdfText:
    """The bytes of a URDF, and information about their source.

    Attributes:
        label: The name in messages, for example the path, `<text>` or `<stdin>`.
        source: A path, a catalogue name, `-` for standard input, or a word such as `<text>` or `<file>`.
        sha256: The digest of the MJCF or USD file from which the URDF was converted; empty for other sources.
    """

    data: bytes
    label: str
    source: str
    entry: CatalogueEntry | None = None
    xacro_args: tuple[tuple[str, str], ...] = ()
    sha256: str = ""
    variants: tuple[tuple[str, str], ...] = ()
    articulation: str | None = None


def read_source(
    source: Source, max_bytes: int = MAX_BYTES, xacro_args: Mapping[str, object] | None = None
) -> UrdfText:
    """Read a URDF from any source.

    Read at most `max_bytes` + 1 bytes (or characters of an open text file) of a URDF, so that the caller can
    recognize a longer source.

    A catalogue name has priority over a file with this name: for a file `panda`, write `./panda`.

    | Error | Cause |
    |---|---|
    | SourceError | an unreadable file, or an unknown package |
    | UnknownNameError | an unknown name, or an unknown xacro argument |
    | XacroError | xacro cannot expand the file |
    | InputError | a wrong type, an empty name, or `xacro_args` without a .xacro file |
    """
    if xacro_args is not None and not isinstance(xacro_args, Mapping):
        raise InputError("`xacro_args` must be a mapping from names to values", found=safe_repr(xacro_args))
    source = resolve_package_uri(source)
    if is_xacro(source):
        return _expand_xacro(expand_home(source), xacro_args or {})
    if xacro_args:
        names = ", ".join(map(str, xacro_args))
        raise InputError("`xacro_args` (--xacro-arg) needs the path of a .xacro file", found=names)
    if isinstance(source, bytes):
        return UrdfText(source, "<bytes>", "<bytes>")
    if isinstance(source, os.PathLike):
        return _read_file(Path(source), max_bytes)
    if isinstance(source, str):
        return _read_string(source, max_bytes)
    if hasattr(source, "read"):
        return _read_stream(source, max_bytes)
    raise InputError(
        "the source must be a path, a catalogue name, URDF text, bytes or an open file",
        found=type(source).__name__,
    )


def is_xacro(source: object) -> TypeGuard[str | os.PathLike[str]]:
    return _suffix(source) == ".xacro"


def is_urdf_path(source: object) -> TypeGuard[str | os.PathLike[str]]:
    return _suffix(source) == ".urdf"


def is_usd(source: object) -> TypeGuard[str | os.PathLike[str]]:
    """Return whether a path has a suffix of USD files.

    >>> is_usd("arm.usda"), is_usd("arm.USDZ"), is_usd("arm.urdf"), is_usd("<robot/>")
    (True, True, False, False)
    """
    return _suffix(source) in USD_SUFFIXES


def _suffix(source: object) -> str:
    if not isinstance(source, str | os.PathLike):
        return ""
    is_text = isinstance(source, str) and source.lstrip().startswith("<")
    return "" if is_text else Path(source).suffix.lower()


def _expand_xacro(path: Path, arguments: Mapping[str, object]) -> UrdfText:
    from urdfkin.urdf.xacro import expand

    words = {name: str(value) for name, value in arguments.items()}
    return UrdfText(
        expand(path, words), f"{path} (expanded)", unambiguous_path(path), xacro_args=tuple(words.items())
    )


def _read_string(source: str, max_bytes: int) -> UrdfText:
    if not source.strip():
        remedy = "give a path, a name that 'urdfkin robots' lists, or '-' for standard input"
        raise InputError("the robot's name is empty", found=repr(source), remedy=remedy)
    if source == "-":
        return UrdfText(read_start_of_standard_input(max_bytes + 1), "<stdin>", "-")
    if source.lstrip("\ufeff \t\r\n").startswith("<"):
        return _encode(source, "<text>", "<text>")
    if (entry := find_entry(source)) is not None:
        read = _read_file(entry.path, max_bytes)
        return UrdfText(read.data, read.label, source, entry)
    path = expand_home(source)
    if os.sep in source or path.suffix or may_exist(path):
        return _read_file(path, max_bytes)
    raise UnknownNameError("robot", source, catalogue(), where="neither a file nor in the catalogue")


def _read_stream(stream: IO[str] | IO[bytes], max_bytes: int) -> UrdfText:
    # A temporary file or a pipe has a number instead of a path as its name.
    name = getattr(stream, "name", None)
    label = os.fsdecode(name) if name and isinstance(name, str | bytes) else "<file>"
    try:
        content: Any = stream.read(max_bytes + 1)
        # One read from an unbuffered stream may return only a part of the content.
        while isinstance(stream, io.RawIOBase) and 0 < len(content) <= max_bytes:
            if not (more := stream.read(max_bytes + 1 - len(content))):
                break
            content += more
    except (OSError, ValueError) as error:
        remedy = "open the file for reading, or pass its path"
        if isinstance(error, UnicodeError):
            remedy = "open the file in binary mode, or pass its path"
        raise SourceError("cannot be read", where=label, found=str(error), remedy=remedy) from error
    if not isinstance(content, str | bytes):
        found = type(content).__name__
        raise InputError("read() of an open file must return text or bytes", where=label, found=found)
    return _encode(content, label, label if label.startswith("<") else unambiguous_path(Path(label)))


def resolve_package_uri(source: T) -> T | Path:
    """Return the path of a `package://` or `model://` address; return any other source unchanged.

    Raise SourceError if the package is not found.
    """
    address = split_uri(source) if isinstance(source, str) else None
    if address is None:
        return source
    name, path = address
    # The search for the package goes upwards from the current folder.
    folder = find_package(name, Path(path).absolute())
    if folder is None:
        raise SourceError(
            f"the package {name!r} is not found",
            where=str(source),
            remedy="add the folder of the package to ROS_PACKAGE_PATH, or name the file by its path",
            question=QuestionsSection.PACKAGES_AND_MESHES,
        )
    return folder / path


def _encode(content: str | bytes, label: str, source: str) -> UrdfText:
    # `surrogatepass` keeps a lone surrogate. The check of the bytes reports it later.
    data = content if isinstance(content, bytes) else content.encode("utf-8", "surrogatepass")
    return UrdfText(data, label, source)


def _read_file(path: Path, max_bytes: int) -> UrdfText:
    try:
        return UrdfText(read_start(path, max_bytes + 1, pipes=True), str(path), unambiguous_path(path))
    except SourceError as error:
        if isinstance(error.__cause__, FileNotFoundError):
            raise SourceError("no such file", where=str(path), remedy=_missing_file_remedy(path)) from None
        if isinstance(error.__cause__, IsADirectoryError):
            remedy = "name the .urdf file in this folder"
            raise SourceError("this is a folder, not a file", where=str(path), remedy=remedy) from None
        raise


def unambiguous_path(path: Path) -> str:
    """Return a path that cannot be mistaken for an option, URDF text or a catalogue name."""
    word = str(path)
    return f"./{word}" if word.startswith(("-", "<")) or find_entry(word) is not None else word


def find_entry(name: str) -> CatalogueEntry | None:
    """Return the catalogue entry of a name; a text with a dot or a path separator is a path, not a name."""
    return None if "." in name or os.sep in name else catalogue().get(name)


def _missing_file_remedy(path: Path) -> str:
    try:
        names = [entry.name for entry in path.parent.iterdir()]
    except FileNotFoundError:
        return f"the folder {path.parent} does not exist"
    except OSError:
        return f"the folder {path.parent} cannot be read"
    close = find_similar_names(path.name, names)
    return f"did you mean {', '.join(close)}?" if close else "'urdfkin robots' lists robots that need no file"
