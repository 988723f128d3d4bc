"""Mimic rules as the URDF's text states them, for the oracle: read apart from urdfkin's own reader.

Pinocchio couples nothing here (see `urdfkin.oracle`), so that a rule which the reader got wrong would be
wrong on both sides, and agree. The standard library's parser reads it a second time.
"""

from __future__ import annotations

import xml.etree.ElementTree as Xml
from collections.abc import Collection

from urdfkin.tree import Mimic


def rules_of_text(text: str, joints: Collection[str]) -> dict[str, Mimic]:
    """Whom each follower follows as the text says, chains followed to the joint that moves by itself.

    Args:
        text: The URDF.
        joints: The joints that move; others follow nobody, whatever the text says.

    Raises:
        InputError: a rule's numbers are no numbers.
    """
    rules = {
        name: Mimic(rule.get("joint", ""), float(rule.get("multiplier", "1")), float(rule.get("offset", "0")))
        for joint in Xml.fromstring(text).iterfind("joint")
        if (rule := joint.find("mimic")) is not None and (name := joint.get("name", "")) in joints
    }
    return {follower: _to_the_end(follower, rules) for follower in rules}


def _to_the_end(follower: str, rules: dict[str, Mimic]) -> Mimic:
    """q_follower = m_1 (m_2 (... q_leader ... + o_2) + o_1, multiplied out from the leader's end."""
    chain = [rules[follower]]
    while (following := rules.get(chain[-1].leader)) is not None and len(chain) <= len(rules):
        chain.append(following)
    multiplier, offset = 1.0, 0.0
    for rule in reversed(chain):
        multiplier, offset = rule.multiplier * multiplier, rule.multiplier * offset + rule.offset
    return Mimic(chain[-1].leader, multiplier, offset)
