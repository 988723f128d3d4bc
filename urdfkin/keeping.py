"""Folders for what is kept between runs: one for each state of the sources that it is made from.

What an upgrade leaves behind is deleted when nobody has used it for a month.
"""

from __future__ import annotations

import contextlib
import hashlib
import shutil
import time
from collections.abc import Iterable
from pathlib import Path

import platformdirs

_A_MONTH = 30 * 24 * 3600.0
_USED = ".used"


def kept_folder(kind: str, sources: Iterable[Path], *besides: str, root: Path | None = None) -> Path | None:
    """A folder of this user's, made if need be; None if none can be written.

    Args:
        kind: What is kept; the folder's name begins with it.
        sources: Files on whose contents it depends.
        besides: Other things on which it depends.
        root: Where; None for the user's cache.
    """
    digest = hashlib.sha256("\n".join(besides).encode())
    for source in sources:
        digest.update(source.read_bytes())
    root = root or Path(platformdirs.user_cache_dir("urdfkin"))
    folder = root / f"{kind}-{digest.hexdigest()[:16]}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / _USED).touch()
    except OSError:
        return None
    _forget_unused(root, kind)
    return folder


def _forget_unused(root: Path, kind: str) -> None:
    """Delete folders of this kind that were last used a month ago."""
    for mark in root.glob(f"{kind}-*/{_USED}"):
        with contextlib.suppress(OSError):
            if time.time() - mark.stat().st_mtime > _A_MONTH:
                shutil.rmtree(mark.parent, ignore_errors=True)
