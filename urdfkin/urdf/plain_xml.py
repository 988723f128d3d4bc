"""XML as urdfdom's parser takes it: names as they are written, prefixes that nobody declared included.

ElementTree's own reader refuses an undeclared prefix, and with it a robot that urdfdom reads. This is a
second reader beside `urdfkin.lint.rules.document`, for those who check what was read through that one.
"""

from __future__ import annotations

from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat


def plain_xml(text: str) -> Element:
    """The root element of a text that passed the checks.

    Raises:
        expat.ExpatError: it is not well-formed.

    >>> plain_xml("<robot><drake:x/></robot>")[0].tag
    'drake:x'
    """
    builder = TreeBuilder()
    parser = expat.ParserCreate("utf-8")  # without a separator, namespaces are not processed
    parser.buffer_text = True
    parser.StartElementHandler = builder.start
    parser.EndElementHandler = builder.end
    parser.CharacterDataHandler = builder.data
    parser.Parse(text.encode(), True)
    return builder.close()
