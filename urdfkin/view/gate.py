"""Who may talk to the viewer: this user's browser, on the viewer's own page, and nobody else.

A web server on 127.0.0.1 is within reach of every page that the user has open and of every user of the
machine. Four things keep them out, and none relies on another:

- the **key**, 128 random bits in the address: other users of the machine do not know it, nor do other pages;
- the **Host** that is asked for, which a name that an attacker points at this machine is not (DNS rebinding);
- the **Origin** of a connection, which is the viewer's own page (a browser lets any page open a WebSocket);
- **headers** for the page: shown in no frame, running no script but its own, connecting to nothing but this.

This module knows neither viser nor a network: a request goes in, a refusal comes out.
"""

from __future__ import annotations

import hmac
import re
import socket
from dataclasses import dataclass
from ipaddress import ip_address

_HOST = re.compile(r"(?:\[(?P<six>[0-9a-fA-F:.]+)\]|(?P<name>[A-Za-z0-9._-]+))(?P<port>:[0-9]{1,5})?")

#: For every answer: nothing is kept, guessed, embedded elsewhere or told to others, the key least of all.
HEADERS = {
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}


@dataclass(frozen=True, slots=True)
class Gate:
    """What a request must have.

    Attributes:
        host: The address the server listens on, as the user gave it.
        key: The first and only part of every path.
    """

    host: str
    key: str

    def refusal(self, path: str, hosts: list[str], origins: list[str], *, connects: bool) -> str | None:
        """Why a request is refused, in one sentence; None when it may pass.

        Args:
            path: As it was asked for.
            hosts: Every Host header.
            origins: Every Origin header.
            connects: Whether it asks for a WebSocket, which needs an Origin; a page that is opened has none.

        Example:
            >>> gate = Gate("127.0.0.1", "key")
            >>> gate.refusal("/key/", ["localhost:8080"], [], connects=False)
            >>> gate.refusal("/key/", ["rebound.example:8080"], [], connects=False)
            'this address is not known by that name'
            >>> gate.refusal("/key", ["localhost:8080"], ["http://localhost:3000"], connects=True)
            'another page may not use this viewer'
        """
        if len(hosts) != 1 or not self._is_known(hosts[0]):
            return "this address is not known by that name"
        if not hmac.compare_digest(path.partition("?")[0].strip("/").encode(), self.key.encode()):
            return "open the whole address that `urdfkin view` has printed: it holds the key"
        if origins != [f"http://{hosts[0]}"] and (connects or origins):
            return "another page may not use this viewer"
        return None

    def _is_known(self, host: str) -> bool:
        """Whether a browser that was sent here on purpose would ask for this name.

        A number cannot be pointed elsewhere; a name can, if it is not this machine's. The port may differ:
        it does when it is forwarded.
        """
        found = _HOST.fullmatch(host)
        if found is None:
            return False
        name = (found["six"] or found["name"]).lower()
        try:
            address = ip_address(name)
        except ValueError:
            return name == "localhost" or (not self.is_local and name in {self.host.lower(), _own_name()})
        return address.is_loopback or not self.is_local

    @property
    def is_local(self) -> bool:
        """Whether only this machine can reach the server."""
        try:
            return ip_address(self.host).is_loopback
        except ValueError:
            return self.host.lower() == "localhost"

    def address(self, port: int) -> str:
        """What to open in a browser on this machine."""
        name = "127.0.0.1" if self.host in ("", "0.0.0.0", "::") else self.host
        return f"http://{f'[{name}]' if ':' in name else name}:{port}/{self.key}/"


def _own_name() -> str:
    return socket.gethostname().lower()


def policy(nonce: str, host: str) -> str:
    """The page's Content-Security-Policy.

    Scripts need the nonce, which nothing knows that was written before this server began: names in a URDF
    cannot bring their own. The page connects to this server alone, although viser's client would follow
    `?websocket=` in its address to any other. Styles and images are drawn by the page itself.
    """
    return "; ".join(
        [
            "default-src 'none'",
            f"script-src 'nonce-{nonce}' 'wasm-unsafe-eval'",
            "worker-src blob: data:",
            "style-src 'unsafe-inline'",
            "img-src data: blob:",
            "font-src data:",
            f"connect-src data: blob: 'self' ws://{host}",
            "base-uri 'none'",
            "form-action 'none'",
            "frame-ancestors 'none'",
        ]
    )
