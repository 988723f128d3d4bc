"""Check that the joints connect the links to one tree: one root, and one parent for every other link.

All functions are iterative, because a chain of 50,000 links would exceed the recursion limit.
"""

from __future__ import annotations

from urdfkin.lint.finding import quoted
from urdfkin.lint.reporter import Reporter
from urdfkin.lint.rule import ERROR, Rule
from urdfkin.urdf.records import JointRecord, RobotRecord

UNKNOWN_LINK = Rule("URDF408", "unknown-link", ERROR)
SELF_PARENT = Rule("URDF409", "self-parent", ERROR)
SEVERAL_PARENTS = Rule("URDF410", "several-parents", ERROR)
SEVERAL_ROOTS = Rule("URDF411", "several-roots", ERROR)
CYCLE = Rule("URDF412", "cycle", ERROR)


def check_structure(report: Reporter, robot: RobotRecord) -> bool:
    """Report the reasons why the joints form no tree; return whether they form one."""
    edges = [joint for joint in robot.joints if _ends_exist(report, robot, joint)]
    sound = len(edges) == len(robot.joints) and _no_loops_or_diamonds(report, robot, edges)
    return _one_root(report, robot) and sound and bool(robot.links)


def _ends_exist(report: Reporter, robot: RobotRecord, joint: JointRecord) -> bool:
    """Return whether a joint has two different links that exist; report them otherwise."""
    for tag, link in (("parent", joint.parent), ("child", joint.child)):
        if link is not None and link not in robot.links:
            nearest = report.nearest(link, robot.links)
            report.add(
                UNKNOWN_LINK,
                f"the {tag} link does not exist",
                joint.element.first(tag),
                attribute="link",
                found=quoted(link),
                remedy=f"did you mean {', '.join(nearest)}?"
                if nearest
                else f"add <link name={quoted(link)}/>",
            )
    if joint.parent is not None and joint.parent == joint.child:
        report.add(
            SELF_PARENT,
            "the joint connects a link with itself",
            joint.element.first("child"),
            attribute="link",
            found=quoted(joint.parent),
            remedy="name another parent or child",
        )
        return False
    return joint.parent in robot.links and joint.child in robot.links


def _no_loops_or_diamonds(report: Reporter, robot: RobotRecord, edges: list[JointRecord]) -> bool:
    """Search depth first for links with several parents.

    A joint to a link on the current path closes a loop. A joint to another visited link gives this link a
    second parent.
    """
    below: dict[str, list[JointRecord]] = {}
    children = set()
    for joint in edges:
        below.setdefault(joint.parent or "", []).append(joint)
        children.add(joint.child)
    first: dict[str, JointRecord] = {}
    repeated: list[tuple[JointRecord, bool]] = []
    visited: set[str] = set()
    for start in [link for link in robot.links if link not in children] + list(robot.links):
        if start in visited:
            continue
        path: set[str] = {start}
        stack: list[tuple[str, list[JointRecord]]] = [(start, list(reversed(below.get(start, []))))]
        visited.add(start)
        while stack:
            link, pending = stack[-1]
            if not pending:
                stack.pop()
                path.discard(link)
                continue
            joint = pending.pop()
            child = joint.child or ""
            if child in visited:
                repeated.append((joint, child in path))
                continue
            visited.add(child)
            first[child] = joint
            path.add(child)
            stack.append((child, list(reversed(below.get(child, [])))))
    for joint, loop in repeated:
        _report_repeat(report, joint, first.get(joint.child or ""), loop=loop)
    return not repeated


def _report_repeat(report: Reporter, joint: JointRecord, first: JointRecord | None, *, loop: bool) -> None:
    if loop:
        rule, remedy = CYCLE, "remove a joint of the loop; a URDF is a tree"
        message = (
            f"the joint closes a loop: its child is an ancestor of its parent {quoted(joint.parent or '')}"
        )
    else:
        other = f"joint {quoted(first.name)} on line {first.element.line}" if first else "another joint"
        rule, remedy = SEVERAL_PARENTS, "a link has one parent; remove one of the joints"
        message = f"the child link is already the child of {other}"
    at, found = joint.element.first("child"), quoted(joint.child or "")
    report.add(rule, message, at, attribute="link", found=found, remedy=remedy)


def _one_root(report: Reporter, robot: RobotRecord) -> bool:
    """Return whether exactly one link has no parent; report the others.

    A link is not reported if a joint with an error may be its parent joint.
    """
    children = {joint.child for joint in robot.joints}
    roots = [link for link in robot.links if link not in children]
    if not roots and robot.links and not report.failed:
        report.add(CYCLE, "no link is a root: every link is the child of a joint", robot.element)
    if len(roots) < 2:
        return len(roots) == 1
    if not children <= robot.links.keys():
        return False  # already reported: a joint with a missing or wrong child
    parents = {joint.parent for joint in robot.joints}
    # The first root with children is the robot; the others are disconnected.
    main = next((root for root in roots if root in parents), roots[0])
    for root in roots:
        if root != main:
            report.add(
                SEVERAL_ROOTS,
                f"the link has no parent, and neither has {quoted(main)}",
                robot.links[root],
                attribute="name",
                remedy="connect it with a joint, or remove it",
            )
    return False
