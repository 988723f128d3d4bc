"""Mimic rules as the URDF's text states them, for the oracle: read apart from urdfkin's own reader.

Pinocchio couples nothing here (see `urdfkin.oracle`), so that a rule which the reader got wrong would be
wrong on both sides, and agree. `urdfkin.plain_xml` reads it a second time.
"""

from __future__ import annotations

from dataclasses import replace

from urdfkin.errors import InputError
from urdfkin.plain_xml import plain_xml
from urdfkin.tree import KinematicTree, Mimic


def with_rules_of_text(tree: KinematicTree, text: str) -> KinematicTree:
    """The tree, its followers following as the text says.

    Args:
        tree: urdfkin's reading; which joints follow is taken from it, whom and how is not.
        text: The URDF.

    Raises:
        InputError: the text lets a follower of the tree move freely.
    """
    if not any(joint.mimic for joint in tree.joints):
        return tree
    rules = {
        joint.get("name", ""): Mimic(
            rule.get("joint", ""), float(rule.get("multiplier", "1")), float(rule.get("offset", "0"))
        )
        for joint in plain_xml(text).iterfind("joint")
        if (rule := joint.find("mimic")) is not None
    }
    missing = [joint.name for joint in tree.joints if joint.mimic and joint.name not in rules]
    if missing:
        raise InputError("the URDF has no mimic rule for a joint", where=f"joint {missing[0]}")
    known: dict[str, Mimic] = {}
    joints = (replace(j, mimic=_to_the_end(j.name, rules, known)) if j.mimic else j for j in tree.joints)
    return KinematicTree(tree.name, tree.links, tuple(joints))


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
