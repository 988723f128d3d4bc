"""Count the files of urdfkin whose functions run during `load` and during `same`.

A reader must open these files to follow a call of `load` or `same`. Files that are only imported do not
count.

    python scripts/count_files.py                # load(A) and same(A, B) for two robots of this repository
    python scripts/count_files.py A.urdf         # load(A)
    python scripts/count_files.py A.urdf B.urdf  # load(A) and same(A, B)
"""

import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import FrameType

import urdfkin
from urdfkin.compiled.preload import use_only

ROOT = Path(urdfkin.__file__).parent
ROBOTS = Path(__file__).parents[1] / "robots"

A, B = ROBOTS / "elbow.urdf", ROBOTS / "planar_two_link.urdf"


def files_run(call: Callable[[], object]) -> list[str]:
    file_names: set[str] = set()
    importing = 0

    def profile(frame: FrameType, event: str, _: object) -> None:
        nonlocal importing
        code = frame.f_code
        if code.co_name == "<module>":
            importing += (event == "call") - (event == "return")
        elif event == "call" and not importing:
            file_names.add(code.co_filename)

    sys.setprofile(profile)
    try:
        call()
    finally:
        sys.setprofile(None)
    inside = (Path(file) for file in file_names if Path(file).is_relative_to(ROOT))
    return sorted(path.relative_to(ROOT).as_posix() for path in inside)


def files_of_load(source: Path) -> list[str]:
    return files_run(partial(urdfkin.load, source))


def files_of_same(first: Path, second: Path) -> list[str]:
    same = partial(urdfkin.same, first, second)
    with use_only("compiled"):
        same()
        return files_run(same)


if __name__ == "__main__":
    sources = [*map(Path, sys.argv[1:])] or [A, B]
    counts = {"load": files_of_load(sources[0])}
    if len(sources) > 1:
        counts["same"] = files_of_same(*sources)
    for name, files in counts.items():
        print(f"{name}: {len(files)} files", *(f"  {file}" for file in files), sep="\n")
