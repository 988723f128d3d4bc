"""What a Universal Robots arm was calibrated to in the factory, from the YAML that its ROS driver writes.

The controller keeps Denavit-Hartenberg parameters: of two axes a milliradian from parallel, so that d is
hundreds of metres and the next d takes them back. `ur_calibration` draws the links in along their axes and
writes what is left as x, y, z, roll, pitch, yaw of each joint in the one before.

Two orders of turns are met there. The driver takes the angles from R = Rx(roll) Ry(pitch) Rz(yaw) (Eigen's
`eulerAngles(0, 1, 2)`), the robot description hands them to a URDF, which reads Rz(yaw) Ry(pitch) Rx(roll).
Where one angle is a quarter of a turn and another small, the two differ by the small one, 1e-5 to 1e-4 rad.
"driver" is what the robot's controller computes, "urdf" what the ROS description makes of the same file.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from urdfkin.errors import InputError, UnknownNameError
from urdfkin.errors.numbers import parse_float
from urdfkin.kinematics.rotation import rotation_from_euler
from urdfkin.model.pose import pose
from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree, build_tree
from urdfkin.system.files import read_text

#: The links of the file in the order of the arm, and the joint that each hangs from.
LINKS = {
    "shoulder": "shoulder_pan_joint",
    "upper_arm": "shoulder_lift_joint",
    "forearm": "elbow_joint",
    "wrist_1": "wrist_1_joint",
    "wrist_2": "wrist_2_joint",
    "wrist_3": "wrist_3_joint",
}
#: SciPy's names of the two orders; the letters of the second turn about the axes as they were.
ORDERS = {"driver": "XYZ", "urdf": "xyz"}
_SIX = ("x", "y", "z", "roll", "pitch", "yaw")


def read_calibration(path: Path, order: str = "driver") -> dict[str, FloatArray]:
    """(4, 4) origins by the names of joints, without a prefix.

    Args:
        path: The driver's YAML, or a `default_kinematics.yaml` of its robot description.
        order: "driver" or "urdf": in which order the angles turn.

    Raises:
        SourceError: the file cannot be read.
        InputError: no such file; a link or a number is missing.
        UnknownNameError: another order.
    """
    if order not in ORDERS:
        raise UnknownNameError("order of turns", order, ORDERS)
    try:
        data = yaml.safe_load(read_text(path, pipes=True))
    except (yaml.YAMLError, RecursionError) as error:
        raise InputError("no YAML", where=str(path), found=" ".join(str(error).split())[:100]) from None
    kinematics = data.get("kinematics") if isinstance(data, Mapping) else None
    if not isinstance(kinematics, Mapping):
        raise InputError(
            "no calibration of a Universal Robots arm",
            where=str(path),
            remedy="the driver writes kinematics: shoulder: x: ...",
        )
    return {joint: _origin(kinematics, link, ORDERS[order], str(path)) for link, joint in LINKS.items()}


def _origin(kinematics: Mapping[Any, Any], link: str, sequence: str, where: str) -> FloatArray:
    entry = kinematics.get(link)
    if not isinstance(entry, Mapping):
        raise InputError("a link is missing", where=where, found=f"no {link}")
    six = []
    for name in _SIX:
        # YAML 1.1 takes 1e-05, which the driver writes for 0.00001, for a word; and a list of lists that are
        # one another's may be short in the file and endless when it is written out.
        value = entry.get(name)
        number = parse_float(str(value)) if isinstance(value, int | float | str) else None
        if number is None:
            found = repr(value)[:60] if isinstance(value, float | str) else type(value).__name__
            raise InputError("not a finite number", where=f"{where}, {link} {name}", found=found)
        six.append(number)
    return pose(rotation_from_euler(sequence, six[3:]), six[:3])


def calibrated_tree(origins: Mapping[str, FloatArray]) -> KinematicTree:
    """The arm of a calibration alone: `base` to `tool0`, six joints that turn about z."""
    z, rows, parent = np.array([0.0, 0.0, 1.0]), [], "base"
    for joint, T in origins.items():
        child = "tool0" if joint == "wrist_3_joint" else f"{joint}_link"
        rows.append((Joint(joint, JointKind.CONTINUOUS, 0, T, z), parent, child))
        parent = child
    return build_tree("calibration", "base", rows)
