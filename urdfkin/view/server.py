"""The border to viser's server: it answers through the gate or not at all.

Viser checks neither Host nor Origin and offers no way to: its web server is begun inside a method, by a call
of `websockets.asyncio.server.serve`. That one call is made through here, with an answer of our own in place
of viser's. Nothing is taken on trust: before a robot is shown, the server that runs is asked what it must
refuse, and it is ended if it does not. A new version of viser can make the viewer fail, but not open it.
"""

from __future__ import annotations

import contextlib
import http
import http.client
import io
import logging
import secrets
import socket
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from urdfkin.errors import InputError, UrdfkinError
from urdfkin.system.forking import lock_over_forks
from urdfkin.view.gate import HEADERS, Gate, policy

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
    gate = Gate(host, secrets.token_urlsafe(16))
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


def _answer(gate: Gate, page: Callable[[str], bytes]) -> Callable[[Any, Any], Any]:
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


def _try_the_gate(gate: Gate, port: int) -> None:
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
