"""Files that are kept between runs, each with a digest: damaged or renamed ones are noticed, and made anew.

Half a file, or one with a flipped bit, might not be read, kill the process, or compute something else. The
digest is of the file's name too, and of its folder's, which say what the content was made from: a file in
another one's place would be another robot's.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import tempfile
from pathlib import Path

from urdfkin.errors import SourceError
from urdfkin.system.files import MOST_DATA, read_if_there
from urdfkin.system.keeping import say_once

_DIGEST = hashlib.sha256().digest_size


def keep(place: Path, data: bytes) -> None:
    """Write a sealed file, whole or not at all; where it cannot be written, that is said and nothing else."""
    name = ""
    try:
        with tempfile.NamedTemporaryFile(dir=place.parent, prefix=f".{place.name}.", delete=False) as file:
            name = file.name
            file.write(_seal(place, data) + data)
        Path(name).replace(place)
    except OSError as error:
        if name:
            with contextlib.suppress(OSError):
                Path(name).unlink()
        say_once(f"nothing can be kept in {place.parent}: {error.strerror or error}")


def kept(place: Path) -> bytes | None:
    """What a sealed file holds; None where there is none, or where it is damaged, which is said."""
    try:
        content = read_if_there(place, MOST_DATA)
    except SourceError as error:
        damaged(place, error.found or error.what)
        return None
    if content is None:
        return None
    seal, data = content[:_DIGEST], content[_DIGEST:]
    if _seal(place, data) != seal:
        damaged(place, "its content is not what was written under this name")
        return None
    return data


def _seal(place: Path, data: bytes) -> bytes:
    digest = hashlib.sha256()
    for part in (os.fsencode(place.parent.name), os.fsencode(place.name), data):
        digest.update(len(part).to_bytes(8, "big") + part)
    return digest.digest()


def damaged(place: Path, reason: str) -> None:
    """Say that a file cannot be used; what it held is made and written anew."""
    say_once(f"{place} is damaged and is made anew: {reason}")
