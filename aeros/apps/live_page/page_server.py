"""HTTP server of one page on this host: it answers reads of the page, and nothing else.

A web page that rebinds its name to this host is refused by `Host`.
"""

from __future__ import annotations

from collections.abc import Callable
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import BoundedSemaphore
from typing import Any, Final

from aeros.apps.http_hosts import allowed_hosts, http_authority
from aeros.descriptions import describe_exception

HOST: Final = "127.0.0.1"
_MAX_CONNECTIONS: Final = 16
_TIMEOUT_S: Final = 5.0
"""Longest wait for the next bytes of a client (s)."""

_HEADERS: Final = {
    "Content-Type": "text/html; charset=utf-8",
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
}


class PageServer(ThreadingHTTPServer):
    """Server of one page at 127.0.0.1.

    Args:
        port: Port; 0 for any free one.
        page: Returns the page, as HTML.
        every: Time after which a browser loads the page again, s.

    Raises:
        OSError: The port is in use, or may not be used.
    """

    daemon_threads = True
    request_queue_size = _MAX_CONNECTIONS

    def __init__(self, port: int, page: Callable[[], str], every: float) -> None:
        super().__init__((HOST, port), _PageHandler)
        self.page = page
        self.every = every
        self.hosts = allowed_hosts(HOST, self.server_port)
        self._free = BoundedSemaphore(_MAX_CONNECTIONS)

    @property
    def url(self) -> str:
        """The address for browsers."""
        return f"http://{http_authority(HOST, self.server_port)}/"

    def process_request(self, request: Any, client_address: Any) -> None:
        """Answer a connection in a thread of its own, or close it if too many are open.

        Args:
            request: The connection.
            client_address: The client's address.
        """
        if not self._free.acquire(blocking=False):
            self.shutdown_request(request)
            return
        super().process_request(request, client_address)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Answer a connection.

        Args:
            request: The connection.
            client_address: The client's address.
        """
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._free.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Leave out broken connections: only the client loses by them.

        Args:
            request: The connection.
            client_address: The client's address.
        """


class _PageHandler(BaseHTTPRequestHandler):
    server: PageServer
    timeout = _TIMEOUT_S
    server_version = "aeros"
    sys_version = ""

    def do_GET(self) -> None:
        self._answer(has_body=True)

    def do_HEAD(self) -> None:
        self._answer(has_body=False)

    def _answer(self, *, has_body: bool) -> None:
        if self.headers.get_all("Host", []) not in [[one] for one in self.server.hosts]:
            self._send(HTTPStatus.MISDIRECTED_REQUEST, "this server has another Host", has_body)
        elif self.path == "/favicon.ico":  # browsers ask for it on their own
            self._send(HTTPStatus.NO_CONTENT, "", has_body)
        elif self.path != "/":
            self._send(HTTPStatus.NOT_FOUND, "there is one page, /", has_body)
        else:
            try:
                page = self.server.page()
            except Exception as error:
                self._send(HTTPStatus.SERVICE_UNAVAILABLE, f"no page: {describe_exception(error)}", has_body)
                return
            self._send(HTTPStatus.OK, page, has_body)

    def _send(self, status: HTTPStatus, text: str, has_body: bool) -> None:
        body = text.encode("utf-8", "backslashreplace")
        is_page = status is HTTPStatus.OK
        self.send_response(status)
        for name, value in _HEADERS.items():
            self.send_header(
                name, value if is_page or name != "Content-Type" else "text/plain; charset=utf-8"
            )
        if is_page or status is HTTPStatus.SERVICE_UNAVAILABLE:
            self.send_header("Refresh", f"{self.server.every:g}")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        if has_body:
            self.wfile.write(body)

    def log_message(self, *_: Any, **__: Any) -> None:
        """Leave out the log of requests."""
