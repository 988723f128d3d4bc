"""Arrays by name from an .npz file, whose every mistake is told with the file and the array."""

from __future__ import annotations

import io
import zipfile
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from urdfkin.errors import InputError, SourceError
from urdfkin.kinematics.inputs import FloatArray, scalars
from urdfkin.system.files import MOST_DATA, read_bytes

#: An array's shape after its first axis, which counts samples.
Shapes = Mapping[str, tuple[int, ...]]


def read_arrays(path: Path, shapes: Shapes, required: Sequence[str]) -> dict[str, FloatArray]:
    """Arrays (n, ...) of finite numbers, n the same for all; nothing in the file is ever executed.

    Args:
        path: What `numpy.savez` has written.
        shapes: The arrays that may be there.
        required: Those that must.

    Raises:
        SourceError: it cannot be read, or is no such file.
        InputError: an array that is unknown, missing, of another shape, or not of finite numbers.
    """
    try:
        with np.load(io.BytesIO(read_bytes(path, MOST_DATA, pipes=True)), allow_pickle=False) as archive:
            if not isinstance(archive, np.lib.npyio.NpzFile):
                raise ValueError("a single array")
            _check_names(path, archive.files, shapes, required)
            entries = archive.zip.infolist() if archive.zip else []
            size = sum(entry.file_size for entry in entries)
            if size > MOST_DATA:
                raise ValueError(f"arrays of {size} bytes, more than {MOST_DATA}")
            given = {name: archive[name] for name in archive.files}
    except (
        ValueError,
        EOFError,
        OSError,
        zipfile.BadZipFile,
        zlib.error,
        NotImplementedError,
        MemoryError,
    ) as error:
        raise SourceError(
            "no .npz file of numbers", where=str(path), found=str(error), remedy="write it with numpy.savez"
        ) from error
    arrays = {name: scalars(array, f"{path}: {name}") for name, array in given.items()}
    n = len(arrays[required[0]]) if arrays[required[0]].ndim else 0
    for name, array in arrays.items():
        if array.shape != (n, *shapes[name]):
            expected = ", ".join(map(str, ("n", *shapes[name])))
            raise InputError(
                f"{name} has the shape ({expected})", where=str(path), found=f"{array.shape}, where n is {n}"
            )
    return arrays


def _check_names(path: Path, names: Sequence[str], shapes: Shapes, required: Sequence[str]) -> None:
    unknown = [name for name in names if name not in shapes]
    missing = [name for name in required if name not in names]
    if unknown or missing:
        wrong = {"unknown": unknown, "missing": missing}
        raise InputError(
            "other arrays than a trajectory has",
            where=str(path),
            found="; ".join(f"{word}: {', '.join(found)}" for word, found in wrong.items() if found),
            remedy=f"name them {', '.join(shapes)}; there must be {', '.join(required)}",
        )
