"""The viewer's server accepts only requests with its key from its own page."""

import http.client
import inspect
import socket
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import urdfkin
from urdfkin.cli.view import view_command
from urdfkin.errors import InputError
from urdfkin.view import server as module
from urdfkin.view.server import LOOPBACK, RequestFilter, UnguardedError, new_server
from urdfkin.view.viewer import Viewer

viser = pytest.importorskip("viser")
websockets = pytest.importorskip("websockets.asyncio.server") and pytest.importorskip("websockets")

UPGRADE = {
    "Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13",
    "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA==", "Sec-WebSocket-Protocol": f"viser-v{viser.__version__}",
}  # fmt: skip


STRANGE_PATHS = "/", "/KEYx/", "/index.html", "/KEY/index.html", "/../KEY/", "/%2e%2e/", "/key/", "/KEY/x/.."
STRANGE_ORIGINS = "null", "http://evil.example", "https://OWN", "http://127.0.0.1:1", "http://localhost"


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind((LOOPBACK, 0))
        return int(probe.getsockname()[1])


@pytest.fixture(scope="module")
def server() -> Iterator[Any]:
    server = new_server(port=free_port())
    Viewer(server, urdfkin.load("planar_two_link"))
    yield server
    server.stop()


def key_of(server: Any) -> str:
    return str(server.address.rstrip("/").rsplit("/", 1)[1])


def ask(server: Any, path: str, **headers: str | None) -> http.client.HTTPResponse:
    """Send a request with own headers; KEY in the path and OWN in a header are replaced."""
    connection = http.client.HTTPConnection(LOOPBACK, server.get_port(), timeout=20)
    connection.putrequest("GET", path.replace("KEY", key_of(server)), skip_host=True)
    own = f"{LOOPBACK}:{server.get_port()}"
    for name, value in ({"Host": own} | {k.replace("_", "-"): v for k, v in headers.items()}).items():
        if value is not None:
            connection.putheader(name, value.replace("OWN", own))
    connection.endheaders()
    answer = connection.getresponse()
    answer.close()
    connection.close()
    return answer


def connect(server: Any, path: str = "/KEY", **headers: str | None) -> int:
    return ask(server, path, **UPGRADE, **headers).status


def test_the_viewer_listens_only_on_the_loopback_address_by_default(server: Any) -> None:
    assert LOOPBACK == "127.0.0.1"
    assert inspect.signature(new_server).parameters["host"].default == "127.0.0.1"
    assert next(option for option in view_command.params if option.name == "host").default == "127.0.0.1"
    assert server.get_host() == "127.0.0.1"
    sockets = [line.split() for line in Path("/proc/net/tcp").read_text().splitlines()[1:]]
    listening = {line[1] for line in sockets if line[3] == "0A"}
    assert [at for at in listening if at.endswith(f":{server.get_port():04X}")] == [
        f"0100007F:{server.get_port():04X}"
    ]


def test_the_page_and_a_connection_need_the_key_and_the_own_origin(server: Any) -> None:
    assert ask(server, "/KEY/").status == 200
    assert ask(server, "/KEY/?darkMode").status == 200
    for path in STRANGE_PATHS:
        assert ask(server, path).status == 403, path
    assert len(key_of(server)) >= 20
    other = new_server(port=free_port())
    other.stop()
    assert key_of(other) != key_of(server)
    assert connect(server, Origin="http://OWN") == 101
    assert connect(server, "/", Origin="http://OWN") == 403
    for origin in (*STRANGE_ORIGINS, None):
        assert connect(server, Origin=origin) == 403, origin


def test_a_path_with_bytes_that_are_not_ascii_is_refused_with_the_security_headers(server: Any) -> None:
    own = f"{LOOPBACK}:{server.get_port()}".encode()
    with socket.create_connection((LOOPBACK, server.get_port()), timeout=20) as connection:
        connection.sendall(b"GET /\xff HTTP/1.1\r\nHost: " + own + b"\r\n\r\n")
        answer = http.client.HTTPResponse(connection)
        answer.begin()
        assert answer.status == 403
        assert answer.getheader("X-Frame-Options") == "DENY"
        answer.close()


def test_a_request_with_a_foreign_host_name_is_refused(server: Any) -> None:
    port = server.get_port()
    for host in (f"localhost:{port}", f"[::1]:{port}", "127.0.0.1:9000", "127.0.0.2"):
        assert ask(server, "/KEY/", Host=host).status == 200, host
    strangers = ["evil.example", f"evil.example:{port}", "6.6.6.6", "127.0.0.1.nip.example", "", None]
    for strange in [*strangers, "x@127.0.0.1", "127.0.0.1/", "localhost.", "0x7f.1"]:
        assert ask(server, "/KEY/", Host=strange).status == 403, strange
        assert connect(server, Host=strange, Origin=f"http://{strange}") == 403, strange


def test_every_response_forbids_frames_and_the_page_allows_only_its_own_scripts(server: Any) -> None:
    for path in ("/KEY/", "/"):
        answer = ask(server, path)
        assert answer.getheader("X-Frame-Options") == "DENY"
        assert answer.getheader("Referrer-Policy") == "no-referrer"
        assert answer.getheader("Cross-Origin-Resource-Policy") == "same-origin"
    policies = [ask(server, "/KEY/").getheader("Content-Security-Policy") or "" for _ in range(2)]
    assert policies[0] != policies[1]  # a nonce is used once
    rules = dict(rule.split(" ", 1) for rule in policies[0].split("; "))
    assert rules["default-src"] == rules["frame-ancestors"] == rules["base-uri"] == "'none'"
    assert "unsafe" not in rules["script-src"].replace("'wasm-unsafe-eval'", "")
    assert rules["connect-src"].endswith(f" 'self' ws://{LOOPBACK}:{server.get_port()}")


def test_the_server_accepts_no_request_to_publish_the_viewer(
    server: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: list[object] = []
    monkeypatch.setattr("viser._viser.ViserTunnel", lambda *words: opened.append(words))
    heard = {message.__name__ for message in server._websock_server._incoming_handlers}
    assert heard == {"GuiUpdateMessage"}
    assert server.request_share_url() is None
    assert opened == []


@pytest.mark.slow
def test_a_viser_version_that_starts_a_server_differently_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    # A future version of viser could call another function than the one that urdfkin replaces.
    plain = SimpleNamespace(server=SimpleNamespace(serve=websockets.asyncio.server.serve))
    future = SimpleNamespace(**vars(websockets) | {"asyncio": plain})
    monkeypatch.setattr("viser.infra._infra.websockets", future)
    port = free_port()
    with pytest.raises(UnguardedError, match=r"viser \d.*cannot be secured: .*; pip install 'viser=="):
        new_server(port=port)
    with pytest.raises(OSError, match="refused"):
        socket.create_connection((LOOPBACK, port), timeout=5)


def test_a_server_without_the_request_filter_or_with_other_scripts_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "_NONCE_REPLACEMENTS", (("<script data-other=", "{nonce}"),))
    with pytest.raises(UnguardedError, match="the page of viser has unexpected scripts"):
        new_server(port=free_port())
    monkeypatch.undo()
    monkeypatch.setattr(RequestFilter, "refusal", lambda *_, **__: None)
    with pytest.raises(UnguardedError, match="a page without the key was answered with 200"):
        new_server(port=free_port())


def test_on_all_interfaces_foreign_host_names_are_refused() -> None:
    with pytest.raises(InputError, match=r"--host 192\.0\.2\.1: cannot listen on this address"):
        new_server("192.0.2.1")
    requests = RequestFilter("0.0.0.0", "key")
    own = socket.gethostname()
    for host in ("192.168.1.7:8080", f"{own}:8080", "localhost:8080"):
        assert requests.refusal("/key/", [host], [], connects=False) is None, host
    assert requests.refusal("/key/", ["evil.example:8080"], [], connects=False) is not None
    assert requests.refusal("/", ["192.168.1.7:8080"], [], connects=False) is not None
    assert requests.address(8080) == "http://127.0.0.1:8080/key/"
    assert RequestFilter("::1", "key").address(80) == "http://[::1]:80/key/"
