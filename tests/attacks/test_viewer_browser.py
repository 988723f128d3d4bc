"""In a real browser, other pages and names in a URDF cannot read, control, embed or redirect the viewer."""

import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import msgspec
import pytest
from websockets.sync.client import connect

from tests.attacks.hostile import IN_XML, NAMES, chain_of_all
from tests.attacks.test_viewer_server import free_port, key_of
from tests.report.browser import Browser, opened
from tests.urdfs import loaded
from urdfkin.view.server import new_server
from urdfkin.view.viewer import Viewer

viser = pytest.importorskip("viser")
pytestmark = [pytest.mark.long, pytest.mark.browser]

#: Attacks of another page, which knows the viewer's address and key
ATTACK = """
const [address, protocol, done] = arguments, found = {};
const socket = new WebSocket(address.replace("http", "ws").replace(/\\/$/, ""), [protocol]);
const connected = new Promise((resolve) => {
  socket.onopen = () => resolve("open");
  socket.onerror = () => resolve("refused");
});
const read = fetch(address, { mode: "no-cors" }).then(() => "read", () => "refused");
const frame = document.createElement("iframe");
frame.src = address;
const shown = new Promise((resolve) => { frame.onload = resolve; setTimeout(resolve, 5000); });
document.body.append(frame);
Promise.all([connected, read, shown]).then(([a, b]) => done([a, b]));
"""


@contextmanager
def other_site() -> Iterator[str]:
    """Serve a page of another origin."""

    class Page(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(b"<body>another site</body>")

        def log_message(self, format: str, *args: Any) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Page)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/"
    server.shutdown()
    server.server_close()


@pytest.fixture(scope="module")
def viewer() -> Iterator[Viewer]:
    server = new_server(port=free_port())
    yield Viewer(server, loaded(chain_of_all()))
    server.stop()


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    rules = "--host-resolver-rules=MAP rebound.test 127.0.0.1"
    with opened(
        tmp_path_factory.mktemp("profile"), width=800, height=500, draws=False, flags=(rules,)
    ) as browser:
        yield browser


def attack(browser: Browser, address: str) -> tuple[list[str], list[str]]:
    """Attack an address from the shown page; return the results and the browser's errors."""
    browser.errors()
    found = browser.chrome.execute_async_script(ATTACK, address, f"viser-v{viser.__version__}")
    return found, browser.errors()


def test_another_page_cannot_connect_to_read_or_embed_the_viewer(viewer: Viewer, browser: Browser) -> None:
    with other_site() as site:
        for page in (site, site.replace("127.0.0.1", "localhost")):
            browser.chrome.get(page)
            found, errors = attack(browser, viewer.server.address)
            assert found == ["refused", "refused"]
            assert any("frame" in error.lower() for error in errors), errors
        # The same attacks succeed on a server without the filter, so this test can fail.
        plain = viser.ViserServer(host="127.0.0.1", port=free_port(), verbose=False)
        try:
            found, errors = attack(browser, f"http://127.0.0.1:{plain.get_port()}/")
        finally:
            plain.stop()
        assert found == ["open", "read"]
        assert not any("frame" in error.lower() for error in errors), errors


def test_a_foreign_host_name_of_this_machine_shows_a_refusal(viewer: Viewer, browser: Browser) -> None:
    browser.chrome.get(viewer.server.address.replace("127.0.0.1", "rebound.test"))
    assert (
        browser.js("return document.body.innerText").strip()
        == "urdfkin: the Host header of the request does not name this viewer"
    )


def test_the_page_does_not_connect_to_another_server_in_the_address(viewer: Viewer, browser: Browser) -> None:
    # Viser's client connects to the server in `?websocket=`, whose messages could run code in the page.
    with socket.create_server(("127.0.0.1", 0)) as elsewhere:
        elsewhere.settimeout(0.2)
        port = elsewhere.getsockname()[1]
        browser.chrome.get(f"{viewer.server.address}?websocket=ws://127.0.0.1:{port}/")
        time.sleep(8.0)
        with pytest.raises(TimeoutError):
            elsewhere.accept()


def test_no_name_becomes_an_element_or_a_script_in_any_panel(viewer: Viewer, browser: Browser) -> None:
    browser.chrome.get(viewer.server.address)
    browser.wait_for("verified")
    viewer.dh.value = "standard"
    for frame in IN_XML.values():
        viewer.frame.value = frame
        assert viewer.dh_words.content != ""
        time.sleep(0.1)
        assert browser.js("return document.querySelectorAll('#hacked, iframe, form').length") == 0, frame
    viewer.dh.value = "none"
    browser.settle()
    assert browser.js("return window.hacked === undefined")
    images = browser.js("return [...document.querySelectorAll('img')].map((i) => i.src)")
    assert [image for image in images if not image.startswith("data:image/svg+xml,")] == []  # viser's logo
    links = browser.js("return [...document.querySelectorAll('a')].map((a) => a.href)")
    assert [link for link in links if "evil" in link or "javascript" in link] == []
    # An error message with a name
    viewer.frame.value = "base"
    viewer.dh.value = "standard"
    viewer._update_dh_table()
    assert browser.js("return document.querySelectorAll('#hacked, iframe').length") == 0
    viewer.dh.value, viewer.frame.value = "standard", NAMES["script"]
    viewer._update_dh_table()
    browser.chrome.get(viewer.server.address)
    browser.wait_for(f"base to {NAMES['script']}")


def test_a_client_with_the_key_cannot_publish_the_viewer(
    viewer: Viewer, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[object] = []
    monkeypatch.setattr("viser._viser.ViserTunnel", lambda *words: asked.append(words))
    host = f"127.0.0.1:{viewer.server.get_port()}"
    origin: Any = f"http://{host}"
    protocol: Any = f"viser-v{viser.__version__}"
    with connect(f"ws://{host}/{key_of(viewer.server)}", origin=origin, subprotocols=[protocol]) as client:
        for _ in range(3):
            client.send(msgspec.msgpack.encode({"type": "ShareUrlRequest"}))
        client.recv(timeout=20)
        time.sleep(1.0)
    assert asked == []
