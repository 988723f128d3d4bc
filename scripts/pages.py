"""Write generated parts into a page, each between the comments `<!-- NAME -->` and `<!-- end -->`."""

from __future__ import annotations

import re


def inserted(page: str, **parts: str) -> str:
    """Return a page with the given parts in their places.

    Raises:
        ValueError: the page does not have exactly one place for a part.

    >>> print(inserted("before <!-- size --> old <!-- end --> after", size="new"))
    before <!-- size -->
    new
    <!-- end --> after
    """
    for name, part in parts.items():
        place = re.compile(rf"(<!-- {name} -->).*?(<!-- end -->)", re.DOTALL)
        text = part.strip("\n")
        page, count = place.subn(lambda found, text=text: f"{found[1]}\n{text}\n{found[2]}", page)  # type: ignore[misc]
        if count != 1:
            raise ValueError(f"the page has {count} places <!-- {name} -->")
    return page
