"""Compare the order of the moving joints in a URDF with their order in q."""

from __future__ import annotations

from collections.abc import Sequence

from urdfkin.errors import Question
from urdfkin.urdf.plain_xml import plain_xml


def order_words(urdf: str, joints: Sequence[str]) -> str:
    """Return a sentence that compares the joint order of a file with the order of q.

    Args:
        urdf: The text of the URDF.
        joints: Names of the moving joints, in the order of q.
    """
    known = set(joints)
    written = [e.get("name", "") for e in plain_xml(urdf) if e.tag == "joint" and e.get("name") in known]
    ours = [name for name in joints if name in set(written)]
    ours_is = "order of joints: Pinocchio's (depth first, siblings by name), for q, v and columns"
    first = next((k for k, pair in enumerate(zip(written, ours, strict=False)) if pair[0] != pair[1]), None)
    if first is None:
        return f"{ours_is}; the file has the same"
    differs = f"{written[first]} is number {first + 1} there, {ours[first]} here"
    return f"{ours_is}; the file's differs: {differs}; {Question.JOINT_ORDER}"
