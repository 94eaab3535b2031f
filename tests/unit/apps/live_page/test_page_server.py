"""The server of a page answers reads of it by clients that name it, and nothing else."""

from __future__ import annotations

import http.client
import socket
import threading
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager

import pytest

from aeros.apps.live_page.page_server import PageServer


@contextmanager
def served(page: str | Exception, port: int = 0) -> Iterator[PageServer]:
    def read() -> str:
        if isinstance(page, Exception):
            raise page
        return page

    with PageServer(port, read, 5.0) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        try:
            yield server
        finally:
            server.shutdown()
            thread.join(10)


def ask(server: PageServer, method: str = "GET", path: str = "/", host: str | None = None) -> tuple[int, str]:
    with closing(http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=10)) as client:
        client.request(method, path, headers={} if host is None else {"Host": host})
        answer = client.getresponse()
        assert answer.getheader("Cache-Control", "no-store") == "no-store"
        assert (answer.getheader("Refresh") == "5") is (answer.status in (200, 503))
        return answer.status, answer.read().decode()


def test_the_page_is_read_and_nothing_else() -> None:
    with served("<p>é\udc80</p>") as server:
        assert server.url == f"http://127.0.0.1:{server.server_port}/"
        assert ask(server) == (200, "<p>é\\udc80</p>")
        assert ask(server, "HEAD") == (200, "")
        assert ask(server, host=f"localhost:{server.server_port}")[0] == 200
        assert ask(server, path="/favicon.ico") == (204, "")
        assert ask(server, path="/../etc/passwd")[0] == 404
        assert ask(server, "POST")[0] == 501


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1", ""])
def test_another_host_is_refused(host: str) -> None:
    with served("secret") as server:
        assert ask(server, host=host) == (421, "this server has another Host")


def test_the_port_of_http_may_be_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    with served("here") as server:
        port = server.server_port
    monkeypatch.setattr("aeros.apps.http_hosts.HTTP_PORT", port)
    with served("here", port) as server:
        assert [ask(server, host=f"localhost{end}")[0] for end in ("", f":{port}", ":1")] == [200, 200, 421]


def test_a_page_that_cannot_be_made_is_explained() -> None:
    with served(OSError("the disk is gone")) as server:
        status, text = ask(server)
    assert status == 503
    assert "the disk is gone" in text


def test_connections_without_a_request_leave_room_once_they_are_gone() -> None:
    def is_refused() -> bool:
        try:
            assert ask(server) == (200, "here")
        except (ConnectionError, http.client.HTTPException):
            return True
        return False

    with served("here") as server, ExitStack() as open_ones:
        for _ in range(16):
            address = ("127.0.0.1", server.server_port)
            open_ones.enter_context(socket.create_connection(address, timeout=10))
        while not is_refused():
            pass
        open_ones.close()
        assert not all(is_refused() for _ in range(500))
