"""Open the viewer's page in the user's browser, without telling its key to others.

What a program is started with, every user of a machine can see; what lies in a folder of this user's alone,
nobody else can read. So the browser is started with a file that sends it on.


Who may talk to the viewer: this user's browser, on the viewer's own page, and nobody else.

A web server on 127.0.0.1 is within reach of every page that the user has open and of every user of the
machine. Four things keep them out, and none relies on another:

- the **key**, 128 random bits in the address: other users of the machine do not know it, nor do other pages;
- the **Host** that is asked for, which a name that an attacker points at this machine is not (DNS rebinding);
- the **Origin** of a connection, which is the viewer's own page (a browser lets any page open a WebSocket);
- **headers** for the page: shown in no frame, running no script but its own, connecting to nothing but this.

This module knows neither viser nor a network: a request goes in, a refusal comes out.


The border to viser's server: it answers through the gate or not at all.

Viser checks neither Host nor Origin and offers no way to: its web server is begun inside a method, by a call
of `websockets.asyncio.server.serve`. That one call is made through here, with an answer of our own in place
of viser's. Nothing is taken on trust: before a robot is shown, the server that runs is asked what it must
refuse, and it is ended if it does not. A new version of viser can make the viewer fail, but not open it.
"""

from __future__ import annotations

import contextlib
import hmac
import html
import http
import http.client
import io
import logging
import os
import re
import secrets
import socket
import sys
import tempfile
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from ipaddress import ip_address
from pathlib import Path
from typing import Any

from urdfkin.errors import InputError, UrdfkinError
from urdfkin.system.processes import lock_over_forks


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
class RequestFilter:
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
            >>> gate = RequestFilter("127.0.0.1", "key")
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


LOOPBACK = "127.0.0.1"

#: What a client may say: that a control was moved. Where it looks from is told to its own connection.
_HEARD = ("GuiUpdateMessage",)
#: Where viser's page gets its nonce: its first script, and the script that this one makes.
_SCRIPTS = (
    ("<script data-p=", '<script nonce="{nonce}" data-p='),
    ('e.type="module";', 'e.type="module";e.nonce="{nonce}";'),
)
_swapping = lock_over_forks()


class UnguardedError(UrdfkinError, RuntimeError):
    """Viser is not what this version of urdfkin knows how to guard: the viewer does not start."""

    def __init__(self, what: str) -> None:
        super().__init__(
            f"the viewer cannot be guarded: {what}",
            where=f"viser {_version()}",
            remedy="pip install 'viser==1.1.1', with which it can, and report this",
        )


def new_server(host: str = LOOPBACK, port: int = 8080) -> Any:
    """Viser's server behind the gate; `server.address` is what to open.

    Raises:
        InputError: viser is not installed, or the address is none of this machine's.
        UnguardedError: viser has changed, and what must be refused would be answered.
    """
    try:
        import viser  # noqa: PLC0415  an extra
    except ImportError:
        raise InputError("the viewer needs viser", remedy="pip install 'urdfkin[view]'") from None

    class PrivateServer(viser.ViserServer):
        """Viser's server, which publishes nothing."""

        address: str

        def request_share_url(self, verbose: bool = True) -> str | None:
            """Nothing: sharing would open a tunnel to a third party."""
            del verbose
            return None

    _require_address(host)
    gate = RequestFilter(host, secrets.token_urlsafe(16))
    # Viser prints an address without the key, which nobody can use.
    with _answering(_answer(gate, _page())), contextlib.redirect_stdout(io.StringIO()):
        server = PrivateServer(host=host, port=port, label="urdfkin", verbose=False)
    try:
        _silence(server)
        _try_the_gate(gate, server.get_port())
    except BaseException:
        server.stop()
        raise
    server.address = gate.address(server.get_port())
    return server


def _require_address(host: str) -> None:
    """Viser would look for a free port for ever."""
    try:
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        with socket.create_server((host, 0), family=family):
            pass
    except OSError as error:
        raise InputError(
            "nothing can listen there", where=f"--host {host}", found=error.strerror or str(error)
        ) from error


# -- the answer --------------------------------------------------------------------------------------


def _answer(gate: RequestFilter, page: Callable[[str], bytes]) -> Callable[[Any, Any], Any]:
    """What websockets asks before it connects anybody: a response, or None to go on."""
    from websockets.datastructures import Headers  # noqa: PLC0415  with viser
    from websockets.http11 import Response  # noqa: PLC0415

    def response(status: http.HTTPStatus, kind: str, body: bytes, **more: str) -> Response:
        length = {"Content-Type": f"{kind}; charset=utf-8", "Content-Length": str(len(body))}
        return Response(status, status.phrase, Headers(HEADERS | length | more), body)

    def answer(_: Any, request: Any) -> Response | None:
        hosts, origins = request.headers.get_all("Host"), request.headers.get_all("Origin")
        connects = bool(request.headers.get_all("Upgrade"))
        refusal = gate.refusal(request.path, hosts, origins, connects=connects)
        if refusal is not None:
            return response(http.HTTPStatus.FORBIDDEN, "text/plain", f"urdfkin: {refusal}\n".encode())
        if connects:
            return None
        nonce = secrets.token_urlsafe(16)
        rules = {"Content-Security-Policy": policy(nonce, hosts[0])}
        return response(http.HTTPStatus.OK, "text/html", page(nonce), **rules)

    return answer


def _page() -> Callable[[str], bytes]:
    """Viser's page, the one file that its client is, for any nonce."""
    import viser  # noqa: PLC0415  an extra

    file = Path(viser.__file__).parent / "client" / "build" / "index.html"
    try:
        text = file.read_text(encoding="utf-8")
    except OSError as error:
        raise UnguardedError("its page is not where it was") from error
    if text.count("<script") != 1 or any(text.count(plain) != 1 for plain, _ in _SCRIPTS):
        raise UnguardedError("its page has other scripts than it had")

    def page(nonce: str) -> bytes:
        marked = text
        for plain, guarded in _SCRIPTS:
            marked = marked.replace(plain, guarded.format(nonce=nonce))
        return marked.encode()

    return page


@contextlib.contextmanager
def _answering(answer: Callable[[Any, Any], Any]) -> Iterator[None]:
    """While viser starts, the server that it begins answers as we say, and logs nothing of strangers."""
    from websockets.asyncio import server as module  # noqa: PLC0415  with viser

    plain: Any = module.serve
    logger = logging.Logger("urdfkin.view")
    logger.addHandler(logging.NullHandler())

    def serve(*words: Any, **options: Any) -> Any:
        return plain(*words, **(options | {"process_request": answer, "logger": logger}))

    with _swapping:
        setattr(module, "serve", serve)  # noqa: B010  a function of a module, says mypy
        try:
            yield
        finally:
            setattr(module, "serve", plain)  # noqa: B010


# -- what is made sure of ----------------------------------------------------------------------------


def _silence(server: Any) -> None:
    """Take away what viser would do for a client and nothing here has use for: sharing, uploads, commands."""
    try:
        known = server._websock_server
        for message in list(known._incoming_handlers):
            if message.__name__ not in _HEARD:
                known.unregister_handler(message)
        left = {message.__name__ for message in known._incoming_handlers}
    except (AttributeError, AssertionError) as error:
        raise UnguardedError("what it listens to cannot be told") from error
    if left != set(_HEARD):
        raise UnguardedError(f"it listens to {', '.join(sorted(left)) or 'nothing'}")


def _try_the_gate(gate: RequestFilter, port: int) -> None:
    """Ask the server that runs: it must know its page, and refuse three kinds of strangers.

    Raises:
        UnguardedError: it does not.
    """
    host = gate.address(port).split("/")[2]
    socket_ = {
        "Upgrade": "websocket",
        "Connection": "Upgrade",
        "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA==",
    }
    here, there = {"Host": host}, {"Host": "rebound.invalid"}
    cases: tuple[tuple[str, str, dict[str, str], int], ...] = (
        ("its own page", f"/{gate.key}/", here, 200),
        ("a page without the key", "/", here, 403),
        ("a page under another name", f"/{gate.key}/", there, 403),
        ("another page's connection", f"/{gate.key}", here | socket_ | {"Origin": "http://x.invalid"}, 403),
        ("a connection without the key", "/", here | socket_ | {"Origin": f"http://{host}"}, 403),
    )
    for what, path, headers, expected in cases:
        connection = http.client.HTTPConnection(host, timeout=30)
        try:
            connection.request("GET", path, headers=headers)
            answer = connection.getresponse()
            guarded = answer.getheader("X-Frame-Options") == HEADERS["X-Frame-Options"]
            if answer.status != expected or not guarded:
                raise UnguardedError(f"{what} was answered with {answer.status}")
        except (OSError, http.client.HTTPException) as error:
            raise UnguardedError(f"{what} was not answered: {error}") from error
        finally:
            connection.close()


def _version() -> str:
    from importlib import metadata  # noqa: PLC0415  for an error only

    return metadata.version("viser")
