"""Check that namespace prefixes are declared (`xmlns:`). urdfdom does not require it, but most readers do."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

from urdfkin.lint.finding import quoted, shortened
from urdfkin.lint.reporter import Reporter
from urdfkin.lint.rule import WARNING, Rule
from urdfkin.urdf.element import Element

UNDECLARED_PREFIX = Rule("URDF214", "undeclared-prefix", WARNING)

#: Prefixes that XML declares itself.
_PREDECLARED = ("xml", "xmlns")

#: Prefixes with findings of their own (URDF202, URDF112).
_REPORTED = ("xacro:", "xi:include")


@dataclass(slots=True)
class _Use:
    """The first use of a prefix, and the number of uses."""

    element: Element
    attribute: str | None
    times: int = 0


def check_prefixes(report: Reporter, root: Element) -> None:
    """Report each undeclared prefix once."""
    for prefix, use in _undeclared_prefixes(root).items():
        more = f" and {use.times - 1} more" if use.times > 1 else ""
        report.add(
            UNDECLARED_PREFIX,
            f"the prefix {quoted(prefix)} is not declared; most XML readers refuse the file",
            use.element,
            attribute=use.attribute,
            found=quoted(use.attribute or f"<{use.element.tag}>") + more,
            remedy=f'write xmlns:{shortened(prefix)}="..." in <robot>, or remove the names with this prefix',
        )


def _undeclared_prefixes(root: Element) -> dict[str, _Use]:
    """Return the undeclared prefixes with their uses."""
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
        for prefix, attribute in _prefixes_of(element):
            if declared[prefix] < 1:
                found.setdefault(prefix, _Use(element, attribute)).times += 1
    return found


def _prefixes_of(element: Element) -> Iterator[tuple[str, str | None]]:
    """Yield the prefixes of an element's tag (attribute None) and of its attributes."""
    if ":" in element.tag and not element.tag.startswith(_REPORTED):
        yield element.tag.partition(":")[0], None
    for key in element.attributes:
        if ":" in key:
            yield key.partition(":")[0], key
