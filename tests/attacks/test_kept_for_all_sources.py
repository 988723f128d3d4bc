"""What is kept between runs is kept for all the sources that it depends on, not for one of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import pytest

from urdfkin import compiled as recursion
from urdfkin import kinematics
from urdfkin.compiled import kept, machine
from urdfkin.system import cache
from urdfkin.system.cache import kept_folder


@pytest.mark.parametrize("changed", [0, 1, 2])
def test_a_change_in_any_source_leads_to_another_folder(changed: int, tmp_path: Path) -> None:
    sources = [tmp_path / f"{name}.py" for name in "abc"]
    for source in sources:
        source.write_text("x = 1")
    before = kept_folder("kernels", sources, root=tmp_path)
    sources[changed].write_text("x = 2")
    assert kept_folder("kernels", sources, root=tmp_path) not in (before, None)


@pytest.mark.parametrize(
    ("module", "ask", "needed"),
    [
        (cache, kept.cache_folder, [recursion, machine, kinematics]),
    ],
    ids=["kernels"],
)
def test_every_file_of_the_part_is_among_the_sources(
    module: Any, ask: Any, needed: list[Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[Path] = []

    def noting(kind: str, sources: Iterable[Path], *besides: str, root: Path | None = None) -> Path:
        seen.extend(sources)
        return tmp_path

    monkeypatch.setattr(module, "kept_folder", noting)
    uncached: Callable[[], Path | None] = ask.__wrapped__
    assert uncached() == tmp_path
    files = {path for each in needed for path in _files(Path(str(each.__file__)))}
    assert len(files) > 5
    assert files <= set(seen)


def _files(path: Path) -> list[Path]:
    return sorted(path.parent.glob("*.py")) if path.stem == "__init__" else [path]


def test_even_whom_one_trusts_above_a_folder_may_not_own_the_folder_itself(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    owner = tmp_path.stat().st_uid
    assert cache._unsafe_reason(tmp_path) is None
    monkeypatch.setattr(cache, "_TRUSTED", (0, owner))
    monkeypatch.setattr("os.geteuid", lambda: owner + 1)
    assert str(cache._unsafe_reason(tmp_path)).startswith(f"{tmp_path} belongs to another user")
