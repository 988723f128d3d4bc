"""Whether a file has its moving joints in another order than q, and from where on."""

from __future__ import annotations

from collections.abc import Sequence

from urdfkin.errors import Question
from urdfkin.urdf.plain_xml import plain_xml


def order_words(urdf: str, joints: Sequence[str]) -> str:
    """A sentence about a robot's moving joints, by name in the order of q, and the text they came from."""
    known = set(joints)
    written = [e.get("name", "") for e in plain_xml(urdf) if e.tag == "joint" and e.get("name") in known]
    ours = [name for name in joints if name in set(written)]
    says = "order of joints: Pinocchio's (depth first, siblings by name), for q, v and columns"
    first = next((k for k, pair in enumerate(zip(written, ours, strict=False)) if pair[0] != pair[1]), None)
    if first is None:
        return f"{says}; the file has the same"
    differs = f"{written[first]} is number {first + 1} there, {ours[first]} here"
    return f"{says}; the file's differs: {differs}; {Question.JOINT_ORDER}"
