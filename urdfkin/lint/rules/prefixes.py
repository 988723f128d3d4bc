"""Prefixes of names that no `xmlns:` around them declares: urdfdom does not mind, most XML readers do."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

from urdfkin.lint.finding import quoted, shortened
from urdfkin.lint.reporter import Reporter
from urdfkin.lint.rule import WARNING, Rule
from urdfkin.urdf.element import Element

UNDECLARED_PREFIX = Rule("URDF214", "undeclared-prefix", WARNING)

#: What XML declares itself.
_PREDECLARED = ("xml", "xmlns")

#: Told already, as something that is missing from the robot (URDF202, URDF112).
_TOLD = ("xacro:", "xi:include")


@dataclass(slots=True)
class _Use:
    """Where a prefix is used first, and how often in all."""

    element: Element
    attribute: str | None
    times: int = 0


def check_prefixes(report: Reporter, root: Element) -> None:
    """Report each undeclared prefix once."""
    for prefix, use in _undeclared(root).items():
        more = f" and {use.times - 1} more" if use.times > 1 else ""
        report.add(
            UNDECLARED_PREFIX,
            f"the prefix {quoted(prefix)} is not declared; most XML readers refuse the file",
            use.element,
            attribute=use.attribute,
            found=quoted(use.attribute or f"<{use.element.tag}>") + more,
            remedy=f'write xmlns:{shortened(prefix)}="..." in <robot>, or remove what has the prefix',
        )


def _undeclared(root: Element) -> dict[str, _Use]:
    """Prefix -> its uses outside every element that declares it."""
    found: dict[str, _Use] = {}
    declared = Counter(_PREDECLARED)
    stack = [(root, False)]
    while stack:
        element, leaving = stack.pop()
        own = [key.removeprefix("xmlns:") for key in element.attributes if key.startswith("xmlns:")]
        if leaving:
            declared.subtract(own)
            continue
        declared.update(own)
        if own:
            stack.append((element, True))
        stack += [(child, False) for child in reversed(element.children)]
        for prefix, attribute in _prefixed(element):
            if declared[prefix] < 1:
                found.setdefault(prefix, _Use(element, attribute)).times += 1
    return found


def _prefixed(element: Element) -> Iterator[tuple[str, str | None]]:
    """The prefixes of an element's tag (attribute None) and attributes."""
    if ":" in element.tag and not element.tag.startswith(_TOLD):
        yield element.tag.partition(":")[0], None
    for key in element.attributes:
        if ":" in key:
            yield key.partition(":")[0], key
