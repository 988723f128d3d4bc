"""Parse XML like urdfdom, and accept undeclared namespace prefixes.

ElementTree's parser rejects undeclared prefixes. The parser of this module is independent of
`urdfkin.urdf.parser`. The package `verify` uses this module to check results of `urdfkin.urdf.parser`.
"""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from urdfkin.errors import QuestionsSection


def parse_xml(text: str) -> Element:
    """Return the root element of a URDF; raise expat.ExpatError if the text is not well-formed."""
    builder = TreeBuilder()
    # Without a namespace separator, expat ignores namespaces.
    parser = expat.ParserCreate("utf-8")
    parser.buffer_text = True
    parser.StartElementHandler = builder.start
    parser.EndElementHandler = builder.end
    parser.CharacterDataHandler = builder.data
    parser.Parse(text.encode(), True)
    return builder.close()


def joint_order_sentence(urdf: str, joints: Sequence[str]) -> str:
    """Return a sentence that says whether the URDF has its joints in the same order as q.

    `joints` contains the names of the joints in the order of q.
    """
    known = set(joints)
    written = [e.get("name", "") for e in parse_xml(urdf) if e.tag == "joint" and e.get("name") in known]
    ours = [name for name in joints if name in set(written)]
    ours_is = "order of joints in q, v and columns: Pinocchio's (depth first, siblings by name)"
    first = next((k for k, pair in enumerate(zip(written, ours, strict=False)) if pair[0] != pair[1]), None)
    if first is None:
        return f"{ours_is}; the file has the same order"
    differs = f"{written[first]} is number {first + 1} in the file and {ours[first]} here"
    return f"{ours_is}; the order in the file differs: {differs}; {QuestionsSection.JOINT_ORDER}"
