"""Mimic rules as the URDF's text states them, for the oracle: read apart from urdfkin's own reader.

Pinocchio couples nothing here (see `urdfkin.verify.pinocchio`), so that a rule which the reader got wrong
would be wrong on both sides, and agree. So nothing is taken from the document that `urdfkin.lint` read,
neither its elements nor its records: who guards a reading must not read through it. Like Pinocchio, this
takes the text, and only when a result is first checked; `load` reads it once.
"""

from __future__ import annotations

from collections.abc import Collection

from urdfkin.model.tree import Mimic
from urdfkin.urdf.plain_xml import plain_xml


def rules_of_text(text: str, joints: Collection[str]) -> dict[str, Mimic]:
    """Whom each follower follows as the text says, chains followed to the joint that moves by itself.

    Args:
        text: The URDF.
        joints: The joints that move; others follow nobody, whatever the text says.

    Raises:
        ValueError: a rule's numbers are no numbers.
        expat.ExpatError: the text is not well-formed.
    """
    if "mimic" not in text:
        return {}
    rules = {
        name: Mimic(rule.get("joint", ""), float(rule.get("multiplier", "1")), float(rule.get("offset", "0")))
        for joint in plain_xml(text).iterfind("joint")
        if (rule := joint.find("mimic")) is not None and (name := joint.get("name", "")) in joints
    }
    known: dict[str, Mimic] = {}
    return {follower: _to_the_end(follower, rules, known) for follower in rules}


def _to_the_end(follower: str, rules: dict[str, Mimic], known: dict[str, Mimic]) -> Mimic:
    """q_follower = m_1 (m_2 (... q_leader ... + o_2) + o_1, multiplied out from the leader's end.

    What is found is kept in `known`: in a chain of followers, each is asked for once.
    """
    chain = [follower]
    while (leader := rules[chain[-1]].leader) in rules and leader not in known and len(chain) <= len(rules):
        chain.append(leader)
    for name in reversed(chain):
        rule = rules[name]
        end = known.get(rule.leader, Mimic(rule.leader, 1.0, 0.0))
        offset = rule.multiplier * end.offset + rule.offset
        known[name] = Mimic(end.leader, rule.multiplier * end.multiplier, offset)
    return known[follower]
