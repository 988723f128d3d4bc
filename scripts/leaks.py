"""Check for leaks: load N different robots, and print the memory and the open files after each part.

python -m scripts.leaks 10000
"""

import argparse
import gc
import json
import sys
import tempfile
import warnings
from pathlib import Path

import psutil

import urdfkin
from urdfkin.compiled.preload import use_only

PARTS = 5
_ROBOT = """<robot name="r{k}">
  <link name="base{k}"/><link name="arm"/><link name="{odd}tip{k}"/>
  <joint name="a{k}" type="revolute"><parent link="base{k}"/><child link="arm"/><origin xyz="0 0 {x}"/>
    <axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="b" type="continuous"><parent link="arm"/><child link="{odd}tip{k}"/><origin xyz="{x} 0 0"/>
    <axis xyz="0 1 0"/></joint>
</robot>
"""


def use_robot(k: int, folder: Path) -> None:
    text = _ROBOT.format(k=k, x=0.1 + 1e-6 * k, odd="&lt;b&gt; " if k % 3 else "")
    path = folder / f"{k % 10}.urdf"
    path.write_text(text if k % 5 else text.replace("</robot>", ""))
    urdfkin.check(path)
    try:
        robot = urdfkin.load(path)
    except urdfkin.UrdfkinError:
        return
    robot.acceleration(robot.sample(20), robot.sample(20), robot.sample(20), robot.tip_frame)
    robot.dh()


def measure_usage() -> dict[str, float]:
    gc.collect()
    here = psutil.Process()
    memory = here.memory_info().rss / 2**20
    return {"MiB": memory, "descriptors": here.num_fds(), "objects": len(gc.get_objects())}


def measure(n: int) -> list[dict[str, float]]:
    # `use_only` loads each kernel at its first use, because a later load of a kernel would look like a leak.
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings(), use_only("compiled"):
        warnings.simplefilter("ignore")
        found = []
        for k in range(n):
            use_robot(k, Path(folder))
            if (k + 1) % (n // PARTS) == 0:
                found.append(measure_usage())
                print(f"{k + 1} robots: {json.dumps(found[-1])}", file=sys.stderr, flush=True)
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("robots", type=int, nargs="?", default=10_000)
    print(json.dumps(measure(parser.parse_args().robots)))
