"""Functions that write the XML of small URDFs."""

import re
import warnings
from collections.abc import Iterable
from typing import Any
from xml.sax.saxutils import quoteattr

import urdfkin
from urdfkin.model.tree import KinematicTree
from urdfkin.robot import Robot
from urdfkin.urdf.writer import to_urdf


def limit(lower: object = -1, upper: object = 1) -> str:
    """Write a <limit> with an effort and a velocity of 1."""
    return f'<limit lower="{lower}" upper="{upper}" effort="1" velocity="1"/>'


def mimic(mimicked_joint: str, multiplier: object = 1, offset: object = 0) -> str:
    return f'<mimic joint="{mimicked_joint}" multiplier="{multiplier}" offset="{offset}"/>'


def joint(
    name: str, kind: str, parent: str, child: str, origin: str = "", axis: str = "0 0 1", more: str = ""
) -> str:
    """Write a joint; `origin` are the attributes of <origin>, and `more` are additional elements."""
    inside = f"<parent link={quoteattr(parent)}/><child link={quoteattr(child)}/>"
    inside += f"<origin {origin}/>" * bool(origin) + f'<axis xyz="{axis}"/>' * bool(axis) + more
    return f'<joint name={quoteattr(name)} type="{kind}">{inside}</joint>'


def robot(*joints: str, name: str = "r", attributes: str = "") -> str:
    """Write a robot with joints, and with the parent and child links of these joints."""
    links = dict.fromkeys(re.findall(r"<(?:parent|child) (link=(?:\"[^\"]*\"|'[^']*'))/>", "".join(joints)))
    named = "".join(f"<{link.replace('=', ' name=', 1)}/>" for link in links)
    return f"<robot name={quoteattr(name)} {attributes}>{named}{''.join(joints)}</robot>"


def chain(
    inside: Iterable[str],
    kind: str = "continuous",
    origin: str = 'xyz="0.1 0.2 0.3"',
    axis: str = "0 0 1",
    **how: Any,
) -> str:
    """Write a chain of links l0, l1, ... with a joint j0, j1, ... for each text of additional elements."""
    parts = [joint(f"j{i}", kind, f"l{i}", f"l{i + 1}", origin, axis, x) for i, x in enumerate(inside)]
    return robot(*parts, **how)


def loaded(source: Any, **how: Any) -> Robot:
    """Load a robot from any source or from a tree, without warnings."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", urdfkin.UrdfWarning)
        return urdfkin.load(to_urdf(source) if isinstance(source, KinematicTree) else source, **how)


def built(*joints: str, **how: Any) -> Robot:
    """Load the robot that consists of these joints and their links, without warnings."""
    return loaded(robot(*joints), **how)
