"""Start viser's web server, refuse requests without the viewer's key, and open the viewer's page.

A web server on 127.0.0.1 can be reached by every page in the user's browser and by every user of the machine.
Four independent measures protect the viewer:

| measure | protects against |
|---|---|
| a **key** of 128 random bits in the address | other users of the machine, other pages |
| a check of the **Host** header | a foreign host name that resolves to this machine (DNS rebinding) |
| a check of the **Origin** header | another page that opens a WebSocket, which browsers allow |
| security **headers** of the page | embedding in a frame, foreign scripts, connections to other servers |

Viser checks neither the Host header nor the Origin header, and has no option for these checks. To start the
web server, viser calls `websockets.asyncio.server.serve`. While the server starts, this module replaces
`serve` by a function that adds a check of each request. To test the checks, this module sends forbidden
requests to the running server before the viewer shows a robot. If the server accepts a forbidden request,
`new_server` stops the server. A new version of viser can therefore make the viewer fail, but not make the
viewer insecure.

Every user of the machine can read the command line of the browser, so this line does not contain the address
of the viewer. The browser opens a file in a private folder, and this file redirects the browser to the
address.
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
from urdfkin.system.lazy_import import install_command, installed_version
from urdfkin.system.locks import make_fork_safe_lock


def has_screen() -> bool:
    """Return whether the user has a screen on which this process can show a browser."""
    return sys.platform == "darwin" or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


@contextmanager
def open_page(address: str) -> Iterator[None]:
    """Open the address in the user's browser.

    A temporary file redirects the browser to the address.
    """
    with tempfile.TemporaryDirectory(prefix="urdfkin-") as folder:  # Only this user can read the folder.
        page = Path(folder) / "view.html"
        page.write_text(f'<meta http-equiv="refresh" content="0; url={html.escape(address)}">', "utf-8")
        webbrowser.open(page.as_uri())
        yield


_HOST = re.compile(r"(?:\[(?P<six>[0-9a-fA-F:.]+)\]|(?P<name>[A-Za-z0-9._-]+))(?P<port>:[0-9]{1,5})?")

#: Headers of every response. The headers forbid caching, guessing the content type, and embedding the page.
#: Browsers must not send the page's address as Referer, because the address contains the key.
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
    """Accepts or refuses requests.

    Attributes:
        host: The address at which the server listens, as the user gave it.
        key: The key, which must be the whole path of every request.
    """

    host: str
    key: str

    def refusal(self, path: str, hosts: list[str], origins: list[str], *, connects: bool) -> str | None:
        """Return the reason why a request is refused, or None if the request is allowed.

        `hosts` and `origins` are the values of all Host and Origin headers. `connects` is True if the request
        opens a WebSocket. A request for a WebSocket must have an Origin header.

        Example:
            >>> requests = RequestFilter("127.0.0.1", "key")
            >>> requests.refusal("/key/", ["localhost:8080"], [], connects=False)
            >>> requests.refusal("/key/", ["rebound.example:8080"], [], connects=False)
            'the Host header of the request does not name this viewer'
            >>> requests.refusal("/key", ["localhost:8080"], ["http://localhost:3000"], connects=True)
            'another web page may not connect to this viewer'
        """
        if len(hosts) != 1 or not self._is_known(hosts[0]):
            return "the Host header of the request does not name this viewer"
        # The library websockets decodes non-ASCII bytes as surrogates.
        asked = path.partition("?")[0].strip("/").encode(errors="surrogateescape")
        if not hmac.compare_digest(asked, self.key.encode()):
            return "open the whole address that `urdfkin view` printed, including its key"
        if origins != [f"http://{hosts[0]}"] and (connects or origins):
            return "another web page may not connect to this viewer"
        return None

    def _is_known(self, host: str) -> bool:
        """Return whether the filter accepts the host in a Host header.

        An attacker can make foreign host names resolve to this machine, but cannot redirect an IP address.
        The header may have any port, because the user may forward a port to the server.
        """
        found = _HOST.fullmatch(host)
        if found is None:
            return False
        name = (found["six"] or found["name"]).lower()
        try:
            address = ip_address(name)
        except ValueError:
            own = {self.host.lower(), socket.gethostname().lower()}
            return name == "localhost" or (not self.is_local and name in own)
        return address.is_loopback or not self.is_local

    @property
    def is_local(self) -> bool:
        try:
            return ip_address(self.host).is_loopback
        except ValueError:
            return self.host.lower() == "localhost"

    def address(self, port: int) -> str:
        name = "127.0.0.1" if self.host in ("", "0.0.0.0", "::") else self.host
        return f"http://{f'[{name}]' if ':' in name else name}:{port}/{self.key}/"


def policy(nonce: str, host: str) -> str:
    """Return the Content-Security-Policy header of the viewer's page.

    The browser runs only scripts with the nonce. The nonce is random for each page, so a name in a URDF
    cannot inject a script. The page can connect only to this server, even if a link names another server with
    the parameter `?websocket=`.
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

#: The only message from a page that viser's server handles: a control has changed. The connection of each
#: page also handles other messages, for example about the camera.
_ACCEPTED_MESSAGES = ("GuiUpdateMessage",)
#: Two replacements in viser's page. The first replacement adds the nonce to viser's script. The second
#: replacement adds the nonce to a script element that viser's script creates.
_NONCE_REPLACEMENTS = (
    ("<script data-p=", '<script nonce="{nonce}" data-p='),
    ('e.type="module";', 'e.type="module";e.nonce="{nonce}";'),
)
#: urdfkin adds its style and script after this start of the page's head.
_HEAD_START = '<meta charset="utf-8" />'
_serve_lock = make_fork_safe_lock()


class UnguardedError(UrdfkinError, RuntimeError):
    """This version of urdfkin cannot secure the installed viser, so the viewer does not start."""

    def __init__(self, what: str) -> None:
        super().__init__(
            f"the viewer cannot be secured: {what}",
            where=f"viser {installed_version('viser')}",
            remedy="pip install 'viser==1.1.1', which is secure, and report this error to urdfkin",
        )


def new_server(host: str = LOOPBACK, port: int = 8080) -> Any:
    """Start viser's server with the request filter.

    `server.address` is the address to open. Raise InputError if viser is missing, or if the server cannot
    listen on `host`. Raise UnguardedError if the installed viser cannot be secured.
    """
    try:
        import viser
    except ImportError:
        raise InputError("the viewer needs viser", remedy=install_command("view")) from None

    class PrivateServer(viser.ViserServer):
        address: str

        def request_share_url(self, verbose: bool = True) -> str | None:
            del verbose
            return None  # Sharing would open a tunnel to a third party.

    _require_usable_address(host)
    requests = RequestFilter(host, secrets.token_urlsafe(16))
    # Viser would print its address without the key.
    with _filter_requests(_process_request(requests, _page())), contextlib.redirect_stdout(io.StringIO()):
        server = PrivateServer(host=host, port=port, label="urdfkin", verbose=False)
    try:
        _remove_message_handlers(server)
        _test_filter(requests, server.get_port())
    except BaseException:
        server.stop()
        raise
    server.address = requests.address(server.get_port())
    return server


def _require_usable_address(host: str) -> None:
    """Raise InputError for an unusable address, because viser would search for a free port forever."""
    try:
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        with socket.create_server((host, 0), family=family):
            pass
    except OSError as error:
        raise InputError(
            "cannot listen on this address", where=f"--host {host}", found=error.strerror or str(error)
        ) from error


# -- the response ------------------------------------------------------------------------------------


def _process_request(requests: RequestFilter, page: Callable[[str], bytes]) -> Callable[[Any, Any], Any]:
    """Return the callback that the library websockets calls for each request.

    The callback returns a response, or None to accept a WebSocket.
    """
    from websockets.datastructures import Headers
    from websockets.http11 import Response

    def response(status: http.HTTPStatus, kind: str, body: bytes, **more: str) -> Response:
        content = {"Content-Type": f"{kind}; charset=utf-8", "Content-Length": str(len(body))}
        return Response(status, status.phrase, Headers(HEADERS | content | more), body)

    def process_request(_: Any, request: Any) -> Response | None:
        hosts, origins = request.headers.get_all("Host"), request.headers.get_all("Origin")
        connects = bool(request.headers.get_all("Upgrade"))
        refusal = requests.refusal(request.path, hosts, origins, connects=connects)
        if refusal is not None:
            return response(http.HTTPStatus.FORBIDDEN, "text/plain", f"urdfkin: {refusal}\n".encode())
        if connects:
            return None
        nonce = secrets.token_urlsafe(16)
        rules = {"Content-Security-Policy": policy(nonce, hosts[0])}
        return response(http.HTTPStatus.OK, "text/html", page(nonce), **rules)

    return process_request


def _page() -> Callable[[str], bytes]:
    """Return a function that takes a nonce and returns viser's page (HTML) with this nonce."""
    import viser

    file = Path(viser.__file__).parent / "client" / "build" / "index.html"
    try:
        text = file.read_text(encoding="utf-8")
    except OSError as error:
        raise UnguardedError("the page of viser is not at the expected path") from error
    if text.count("<script") != 1 or any(text.count(old) != 1 for old, _ in _NONCE_REPLACEMENTS):
        raise UnguardedError("the page of viser has unexpected scripts")
    if text.count(_HEAD_START) != 1:
        raise UnguardedError("the page of viser has no <head> element")
    # The browser loads urdfkin's style and script before viser's.
    own = (Path(__file__).parent / "page.html").read_text(encoding="utf-8")

    def page(nonce: str) -> bytes:
        html_ = text.replace(_HEAD_START, _HEAD_START + own.replace("{nonce}", nonce))
        for old, new in _NONCE_REPLACEMENTS:
            html_ = html_.replace(old, new.format(nonce=nonce))
        return html_.encode()

    return page


@contextlib.contextmanager
def _filter_requests(process_request: Callable[[Any, Any], Any]) -> Iterator[None]:
    """Make new servers check requests with `process_request`, and log nothing."""
    from websockets.asyncio import server as module

    original: Any = module.serve
    logger = logging.Logger("urdfkin.view")
    logger.addHandler(logging.NullHandler())

    def serve(*words: Any, **options: Any) -> Any:
        return original(*words, **(options | {"process_request": process_request, "logger": logger}))

    with _serve_lock:
        setattr(module, "serve", serve)  # noqa: B010  mypy rejects a plain assignment
        try:
            yield
        finally:
            setattr(module, "serve", original)  # noqa: B010  mypy rejects a plain assignment


# -- checks of the server -----------------------------------------------------------------------------


def _remove_message_handlers(server: Any) -> None:
    """Remove the handlers of viser's server, except for `_ACCEPTED_MESSAGES`.

    For example, the handlers for sharing, uploads and commands are removed. Each page's connection keeps its
    own handlers, which affect only this page. urdfkin creates no control for a single page.
    """
    try:
        websocket_server = server._websock_server
        for message in list(websocket_server._incoming_handlers):
            if message.__name__ not in _ACCEPTED_MESSAGES:
                websocket_server.unregister_handler(message)
        accepted = {message.__name__ for message in websocket_server._incoming_handlers}
    except (AttributeError, AssertionError) as error:
        raise UnguardedError("urdfkin cannot find the message handlers of viser") from error
    if accepted != set(_ACCEPTED_MESSAGES):
        names = ", ".join(sorted(accepted)) or "(none)"
        raise UnguardedError(f"viser accepts the unexpected messages {names}")


def _test_filter(requests: RequestFilter, port: int) -> None:
    """Raise UnguardedError if the server refuses its own page, or accepts a request of another page."""
    host = requests.address(port).split("/")[2]
    here, there = {"Host": host}, {"Host": "rebound.invalid"}
    websocket = here | {
        "Upgrade": "websocket",
        "Connection": "Upgrade",
        "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA==",
    }
    cases: tuple[tuple[str, str, dict[str, str], int], ...] = (
        ("its own page", f"/{requests.key}/", here, 200),
        ("a page without the key", "/", here, 403),
        ("a page under another name", f"/{requests.key}/", there, 403),
        ("another page's connection", f"/{requests.key}", websocket | {"Origin": "http://x.invalid"}, 403),
        ("a connection without the key", "/", websocket | {"Origin": f"http://{host}"}, 403),
    )
    for what, path, headers, expected in cases:
        connection = http.client.HTTPConnection(host, timeout=30)
        try:
            connection.request("GET", path, headers=headers)
            response = connection.getresponse()
            has_headers = response.getheader("X-Frame-Options") == HEADERS["X-Frame-Options"]
            if response.status != expected or not has_headers:
                raise UnguardedError(f"{what} was answered with {response.status}")
        except (OSError, http.client.HTTPException) as error:
            raise UnguardedError(f"{what} was not answered: {error}") from error
        finally:
            connection.close()
