"""Load all MJCF files below a folder, and count the results of the checks for docs/mjcf.md.

pip install --no-deps --target models gymnasium==1.4.0 dm-control==1.0.50
python scripts/survey_mjcf.py models
"""

import argparse
import warnings
from collections import Counter
from pathlib import Path

import urdfkin
from urdfkin.errors import UrdfkinError
from urdfkin.urdf.mjcf import is_mjcf


def describe_result(path: Path) -> str:
    try:
        robot = urdfkin.load(path)
        robot.placement(robot.sample(2), robot.link_frames)
    except UrdfkinError as error:
        return f"refused: {error.what}"
    certificate = robot.certificate()
    if not certificate.verified:
        return "not verified"
    shapes, _, remark = certificate.source_notes.partition("Pinocchio's MJCF reader")
    suffix = ", without its shapes" if "only without shapes" in shapes else ""
    phrases = (
        "agrees on the poses of the bodies",
        "disagrees",
        "does not accept",
        "different joints",
        "does not find",
    )
    for phrase in phrases:
        if phrase in remark:
            return f"verified{suffix}; Pinocchio's MJCF reader: {phrase}"
    return f"verified{suffix}; {remark}"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("folder", type=Path)
    folder: Path = parser.parse_args().folder
    warnings.simplefilter("ignore", urdfkin.UrdfWarning)
    counts = Counter(describe_result(path) for path in sorted(folder.rglob("*.xml")) if is_mjcf(path))
    for result, count in counts.most_common():
        print(f"{count:5d}  {result}")
    print(f"{sum(counts.values()):5d}  files")
