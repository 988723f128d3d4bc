"""Convert objects of other libraries to URDF text: ElementTree, lxml and yourdfpy.

The library is recognized by the object's attributes and module name, so that no library is imported.
"""

from __future__ import annotations

from typing import Any, Protocol
from xml.etree import ElementTree

import numpy as np

from urdfkin.errors import InputError
from urdfkin.errors.validators import safe_repr


class XmlElement(Protocol):
    """An element of Python's ElementTree or of lxml's."""

    @property
    def tag(self) -> Any:
        """The name of the element."""

    @property
    def attrib(self) -> Any:
        """The names and values of the attributes."""


class XmlTree(Protocol):
    """A tree of `XmlElement`."""

    def getroot(self) -> Any:
        """Return the root element."""


def text_of(source: Any) -> tuple[str, str] | None:
    """Return the URDF text of an object and its name in messages; None for any other source.

    Raises:
        InputError: an element cannot be written as XML, or a yourdfpy robot is not a tree.
    """
    if any(kind.__module__.partition(".")[0] == "yourdfpy" for kind in type(source).__mro__):
        from urdfkin.urdf.reader import urdf_of  # noqa: PLC0415  only for yourdfpy

        return urdf_of(getattr(source, "robot", source)), "<yourdfpy>"
    root = source.getroot() if hasattr(source, "getroot") else source
    if hasattr(root, "tag") and hasattr(root, "attrib") and hasattr(root, "iter"):
        return _text(root), "<ElementTree>"
    return None


def without_rotation(source: Any) -> list[str]:
    """Return the joints of a yourdfpy robot whose origin has no rotation; none for any other source.

    yourdfpy (0.0.60) ignores the attribute quat_xyzw and does not store the text. A rotation that the file
    writes as quat_xyzw is therefore lost without a trace.
    """
    robot = getattr(source, "robot", source)
    if not type(robot).__module__.startswith("yourdfpy"):
        return []
    return [
        str(joint.name)
        for joint in robot.joints
        if joint.origin is not None and (joint.origin[:3, :3] == np.eye(3)).all()
    ]


def _text(root: Any) -> str:
    """Write elements, attributes and text; skip comments, whose tag is not a string."""
    if not isinstance(root.tag, str):
        raise InputError("the root of this ElementTree is not an element", found=safe_repr(root.tag))
    try:
        copy = ElementTree.Element(root.tag, dict(root.attrib))
        open_ = [(root, copy)]
        while open_:
            element, duplicate = open_.pop()
            duplicate.text = element.text
            for child in element:
                if isinstance(child.tag, str):
                    open_.append((child, ElementTree.SubElement(duplicate, child.tag, dict(child.attrib))))
        return ElementTree.tostring(copy, encoding="unicode")
    except (TypeError, AttributeError, RecursionError) as error:
        raise InputError("this ElementTree cannot be written as XML", found=str(error)) from None
