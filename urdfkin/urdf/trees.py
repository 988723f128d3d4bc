"""URDF text from what other libraries hold: an ElementTree, of Python's or of lxml's, or yourdfpy's robot.

Told apart by what they have and not by their classes, so that no library is imported for another one's sake.
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
        """Its name."""

    @property
    def attrib(self) -> Any:
        """Names and values."""


class XmlTree(Protocol):
    """A tree of such elements."""

    def getroot(self) -> Any:
        """Its first element."""


def text_of(source: Any) -> tuple[str, str] | None:
    """The text, and what to call it in messages; None for any other source.

    Raises:
        InputError: an element holds what XML cannot, or a yourdfpy robot is no tree.
    """
    if any(kind.__module__.partition(".")[0] == "yourdfpy" for kind in type(source).__mro__):
        from urdfkin.urdf.reader import urdf_of  # noqa: PLC0415  the door of yourdfpy

        return urdf_of(getattr(source, "robot", source)), "<yourdfpy>"
    root = source.getroot() if hasattr(source, "getroot") else source
    if hasattr(root, "tag") and hasattr(root, "attrib") and hasattr(root, "iter"):
        return _text(root), "<ElementTree>"
    return None


def without_rotation(source: Any) -> list[str]:
    """Joints of a yourdfpy robot whose origin has no rotation; none for any other source.

    yourdfpy (0.0.60) drops the attribute quat_xyzw and keeps no text: whether the file wrote a rotation so
    cannot be seen any more.
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
    """Elements, attributes and text; comments, whose tag is no name, are left out."""
    if not isinstance(root.tag, str):
        raise InputError("an ElementTree whose root is no element", found=safe_repr(root.tag))
    try:
        copy = ElementTree.Element(root.tag, dict(root.attrib))
        open_ = [(root, copy)]
        while open_:
            element, made = open_.pop()
            made.text = element.text
            for child in element:
                if isinstance(child.tag, str):
                    open_.append((child, ElementTree.SubElement(made, child.tag, dict(child.attrib))))
        return ElementTree.tostring(copy, encoding="unicode")
    except (TypeError, AttributeError, RecursionError) as error:
        raise InputError("an ElementTree that cannot be written as XML", found=str(error)) from None
