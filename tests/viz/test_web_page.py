"""The viewer's page is passed on whole, but for what would lead a browser to other hosts."""

from __future__ import annotations

import http.client
import threading
import urllib.request
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.error import HTTPError, URLError
from urllib.parse import urlsplit

import pytest

from viz.web_page import POLICY, WebPage

HTML = b"""<html><link rel="icon" href="favicon.ico" />
<link rel="preconnect" href="https://example.org" crossorigin />
<link
  href="http://example.org/font.css"
  rel="stylesheet"
/>
<script src="a.js"></script></html>"""
PROGRAM = bytes(range(256)) * 1000
FILES = {"/": ("text/html", HTML), "/a.wasm": ("application/wasm", PROGRAM)}


class Viewer(BaseHTTPRequestHandler):
    def do_GET(self) -> None:
        path = self.path.partition("?")[0]
        if path not in FILES:
            self.send_error(404)
            return
        kind, body = FILES[path]
        self.send_response(200)
        self.send_header("Content-Type", kind)
        self.send_header("rerun-final-length", "7")
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002 - its name there
        pass


@pytest.fixture
def viewer() -> Iterator[ThreadingHTTPServer]:
    server = ThreadingHTTPServer(("127.0.0.1", 0), Viewer)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield server
    server.shutdown()
    thread.join()
    server.server_close()


@pytest.fixture
def page(viewer: ThreadingHTTPServer) -> Iterator[WebPage]:
    page = WebPage(f"http://127.0.0.1:{viewer.server_port}", "rerun+http://127.0.0.1:1/proxy")
    yield page
    page.close()


def test_files_are_passed_on_as_they_are(page: WebPage) -> None:
    root = page.address.partition("?")[0]
    with urllib.request.urlopen(f"{root}a.wasm", timeout=10) as answer:
        assert answer.read() == PROGRAM
        assert (answer.headers["Content-Type"], answer.headers["rerun-final-length"]) == ("application/wasm", "7")
    with pytest.raises(HTTPError, match="404"):
        urllib.request.urlopen(f"{root}none", timeout=10)
    connection = http.client.HTTPConnection(urlsplit(root).netloc, timeout=10)
    connection.request("GET", "http://example.org/")
    assert connection.getresponse().status == 400
    connection.close()


def test_the_page_comes_without_links_elsewhere_and_with_a_policy(page: WebPage) -> None:
    assert page.address.endswith("/?url=rerun%2Bhttp%3A%2F%2F127.0.0.1%3A1%2Fproxy&theme=dark")
    with urllib.request.urlopen(page.address, timeout=10) as answer:
        body = answer.read()
        assert answer.headers["Content-Security-Policy"] == POLICY
    assert b"example.org" not in body
    assert b'<link rel="icon" href="favicon.ico" />' in body
    assert b'<script src="a.js"></script></html>' in body
    assert int(answer.headers["Content-Length"]) == len(body)


@pytest.mark.parametrize("host", ["example.org", "example.org:{port}", "127.0.0.1", "127.0.0.1:1", "", None])
def test_who_asks_by_another_name_is_refused(page: WebPage, host: str | None) -> None:
    place = urlsplit(page.address)
    assert status(place.port, None if host is None else host.format(port=place.port)) == 421


@pytest.mark.parametrize("name", ["127.0.0.1", "localhost"])
def test_who_asks_by_its_own_name_is_answered(page: WebPage, name: str) -> None:
    port = urlsplit(page.address).port
    assert status(port, f"{name}:{port}") == 200


def status(port: int | None, host: str | None) -> int:
    """What the page answers to who asks for it by this name; None: by no name."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    connection.putrequest("GET", "/", skip_host=True)
    if host is not None:
        connection.putheader("Host", host)
    connection.endheaders()
    answer = connection.getresponse().status
    connection.close()
    return answer


def test_a_viewer_that_is_gone_is_told_and_a_closed_page_is_gone() -> None:
    page = WebPage("http://127.0.0.1:9", "")
    with pytest.raises(HTTPError, match="502"):
        urllib.request.urlopen(page.address, timeout=10)
    page.close()
    with pytest.raises(URLError):
        urllib.request.urlopen(page.address, timeout=10)
