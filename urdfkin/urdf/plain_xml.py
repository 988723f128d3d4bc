"""Parse XML like urdfdom: names as written, with undeclared namespace prefixes allowed.

ElementTree's own parser refuses an undeclared prefix, which urdfdom accepts. This second parser is
independent of `urdfkin.lint.rules.document` and serves to check its results.
"""

from __future__ import annotations

from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat


def plain_xml(text: str) -> Element:
    """Return the root element of a URDF that passed the checks.

    Raises:
        expat.ExpatError: the text is not well-formed.

    >>> plain_xml("<robot><drake:x/></robot>")[0].tag
    'drake:x'
    """
    builder = TreeBuilder()
    parser = expat.ParserCreate("utf-8")  # no separator: namespaces are not processed
    parser.buffer_text = True
    parser.StartElementHandler = builder.start
    parser.EndElementHandler = builder.end
    parser.CharacterDataHandler = builder.data
    parser.Parse(text.encode(), True)
    return builder.close()
