"""Open the viewer's page in the user's browser, without telling its key to others.

What a program is started with, every user of a machine can see; what lies in a folder of this user's alone,
nobody else can read. So the browser is started with a file that sends it on.
"""

from __future__ import annotations

import html
import os
import sys
import tempfile
import webbrowser
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


def has_screen() -> bool:
    """Whether a browser that is started can be seen: not over ssh, nor in a container."""
    return sys.platform == "darwin" or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


@contextmanager
def opened_page(address: str) -> Iterator[None]:
    """While open, a file stands that leads to the address, and the user's browser was asked to show it."""
    with tempfile.TemporaryDirectory(prefix="urdfkin-") as folder:  # of this user alone
        page = Path(folder) / "view.html"
        page.write_text(f'<meta http-equiv="refresh" content="0; url={html.escape(address)}">', "utf-8")
        webbrowser.open(page.as_uri())
        yield
