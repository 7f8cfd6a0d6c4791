"""The viewer's page as it is served here: it asks no other host for anything.

As the viewer serves it, it would ask for fonts, for newer versions and for examples, and send usage statistics.
"""

from __future__ import annotations

import re
import threading
import urllib.request
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.error import URLError
from urllib.parse import quote

# What the page may ask for: this machine's servers alone. It is a program in WebAssembly, with scripts in the page.
POLICY = "; ".join((
    "default-src 'self' data: blob:",
    "script-src 'self' 'unsafe-inline' 'wasm-unsafe-eval' blob:",
    "style-src 'self' 'unsafe-inline'",
    "connect-src 'self' data: blob: http://127.0.0.1:*",
    "form-action 'none'",
    "frame-ancestors 'none'",
))  # fmt: skip
# A browser would connect for these before it has a look at the policy.
LINK_ELSEWHERE = re.compile(rb"<link[^>]*https?://[^>]*>")
PASSED_ON = ("Content-Type", "rerun-final-length")
TIMEOUT_S = 30.0


class WebPage:
    """Serves what the viewer's web server at `viewer` has, on 127.0.0.1 and a port that the system picks.

    `address`: for the browser; the page shows what the server at `url` has. Who asks for it by another name is refused
    (421). It ends with `close` or this process.
    """

    def __init__(self, viewer: str, url: str) -> None:
        self._server = _Server(("127.0.0.1", 0), _handler(viewer))
        self.address = f"http://127.0.0.1:{self._server.server_port}/?url={quote(url, safe='')}&theme=dark"
        self._thread = threading.Thread(target=self._server.serve_forever, name="web page", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Ends it."""
        self._server.shutdown()
        self._thread.join()
        self._server.server_close()


class _Server(ThreadingHTTPServer):
    daemon_threads = True

    def handle_error(self, request: object, client_address: object) -> None:
        """Says nothing of a browser that has hung up."""


def _own_hosts(port: int) -> list[list[str]]:
    """The Host headers of those that ask this page by its own address. A page of somebody else's, whose name is made to
    lead here (DNS rebinding), says another, and could read what is served."""
    return [[f"{name}:{port}"] for name in ("127.0.0.1", "localhost")]


def _handler(viewer: str) -> type[BaseHTTPRequestHandler]:
    # The viewer is on this machine: no proxy of the user's is asked for it.
    direct = urllib.request.build_opener(urllib.request.ProxyHandler({}))

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            if not self.path.startswith("/"):
                self.send_error(400)
                return
            if self.headers.get_all("Host") not in _own_hosts(self.connection.getsockname()[1]):
                self.send_error(421)
                return
            try:
                with direct.open(f"{viewer}{self.path}", timeout=TIMEOUT_S) as answer:
                    body, headers = answer.read(), answer.headers
            except URLError as error:
                self.send_error(getattr(error, "code", 502))
                return
            self.send_response(200)
            for name in PASSED_ON:
                if name in headers:
                    self.send_header(name, headers[name])
            if headers.get_content_type() == "text/html":
                body = LINK_ELSEWHERE.sub(b"", body)
            self.send_header("Content-Length", str(len(body)))
            self.send_header("Content-Security-Policy", POLICY)
            self.send_header("Referrer-Policy", "no-referrer")
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, format: str, *args: object) -> None:  # noqa: A002 - its name there
            """Says nothing: the terminal is for sentences."""

    return Handler
