"""From a library's order of rows and coordinates to urdfkin's."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree import ElementTree as ET

import numpy as np

from urdfkin.tree import FloatArray

#: Takes [angular; linear] to [linear; angular].
LINEAR_FIRST = [3, 4, 5, 0, 1, 2]


def positions(ours: Sequence[str], theirs: Sequence[str]) -> list[int]:
    """For each of a library's coordinates, by name, which of urdfkin's it is."""
    index = {name: i for i, name in enumerate(ours)}
    return [index[name] for name in theirs]


def spread(J: FloatArray, columns: Sequence[int], nv: int) -> FloatArray:
    """(n, 6, nv) with the columns of `J` (n, 6, m) at `columns`, zeros elsewhere."""
    full = np.zeros((*J.shape[:-1], nv))
    full[..., list(columns)] = J
    return full


def breadth_first(urdf: str) -> list[str]:
    """The moving joints, link after link from the root, in the file's order: as dynibo numbers them."""
    joints = ET.fromstring(urdf).findall("joint")
    ends = [(_link(joint, "parent"), _link(joint, "child")) for joint in joints]
    links = sorted({parent for parent, _ in ends} - {child for _, child in ends})
    names = []
    for link in links:  # grows while it is walked
        for joint, (parent, child) in zip(joints, ends, strict=True):
            if parent == link:
                links.append(child)
                names += [joint.attrib["name"]] * (joint.get("type") != "fixed")
    return names


def _link(joint: ET.Element, tag: str) -> str:
    return next(joint.iter(tag)).attrib["link"]
