"""Connections that bring no request keep nobody out, with or without a token."""

from __future__ import annotations

import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing
from importlib.util import find_spec

import pytest

from aeros.runtime.execution.governor import OperatorCommand
from tests.unit.apps.mcp.cells import FREE, Cell, cell, dumplings
from tests.unit.apps.mcp.http_clients import TOKEN, HttpClient, served

pytestmark = pytest.mark.skipif(find_spec("mcp") is None, reason="the extra `mcp` is not installed")

LIMIT_S = 0.5
HEAD = f"POST /mcp HTTP/1.1\r\nHost: 127.0.0.1:PORT\r\nAuthorization: Bearer {TOKEN}\r\n"
SENT = {
    "nothing": "",
    "half a head": HEAD,
    "half a body": f"{HEAD}Content-Length: 100\r\n\r\n{{",
    "a request without token or body": HEAD.replace(TOKEN, "b") + "Content-Length: 9\r\n\r\n",
    "a refused request": HEAD.replace(TOKEN, "b") + "Content-Length: 1\r\n\r\n{",
    "one request and half of another": f"{HEAD}Content-Length: 1\r\n\r\n{{{HEAD}",
}


@pytest.fixture(scope="module")
def one(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cell]:
    with cell(dumplings(), tmp_path_factory.mktemp("cell"), FREE) as found:
        yield found


@pytest.fixture
def port(one: Cell) -> Iterator[int]:
    one.operator.asked = OperatorCommand.RUN
    with served(one) as found:
        yield found


def connected(port: int, sent: str, stack: ExitStack) -> socket.socket:
    found = stack.enter_context(socket.create_connection(("127.0.0.1", port), timeout=20))
    found.sendall(sent.replace("PORT", str(port)).encode())
    return found


def is_closed(connection: socket.socket) -> bool:
    """True once the server has closed it, whatever it answered before."""
    connection.settimeout(0.0)
    try:
        while connection.recv(4096):
            pass
    except BlockingIOError:
        return False
    except ConnectionError:
        return True
    return True


@pytest.mark.parametrize("number", [70, 300])
@pytest.mark.parametrize("sent", ["nothing", "half a body"])
def test_a_stop_goes_through_a_flood_of_connections(number: int, sent: str, one: Cell, port: int) -> None:
    with ExitStack() as stack:
        idle = [connected(port, SENT[sent], stack) for _ in range(number)]
        began = time.monotonic()
        assert HttpClient(port).call("stop") == {"status": "stopped"}
        assert time.monotonic() - began < 5
        assert one.operator.command is OperatorCommand.STOP
        assert sum(map(is_closed, idle)) >= number - 256
        assert not is_closed(idle[-1])


@pytest.mark.parametrize("sent", SENT)
def test_a_connection_without_a_complete_request_is_closed_soon(
    sent: str, port: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    from aeros.apps.mcp.transports import http_connection

    monkeypatch.setattr(http_connection, "REQUEST_LIMIT_S", LIMIT_S)
    with ExitStack() as stack:
        connection = connected(port, SENT[sent], stack)
        latest = time.monotonic() + 4  # uvicorn itself closes connections that are idle for 5 s
        while not is_closed(connection):
            assert time.monotonic() < latest
            time.sleep(0.02)


def test_a_connection_that_waits_for_its_response_is_kept(
    one: Cell, port: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    from aeros.apps.mcp.transports import http_connection

    monkeypatch.setattr(http_connection, "REQUEST_LIMIT_S", LIMIT_S)
    client = HttpClient(port)
    one.operator.at_first["decision"] = lambda: one.operator.ask(OperatorCommand.PAUSE)
    with closing(client.watch(client.proposed())) as watching:
        time.sleep(3 * LIMIT_S)
        assert one.robot.is_busy
        client.call("stop")
        assert "stopped by the operator" in watching.getresponse().read().decode()


def test_a_stop_displaces_even_connections_with_requests(
    one: Cell, port: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    from aeros.apps.mcp.transports import http_connection

    monkeypatch.setattr(http_connection, "MAX_CONNECTIONS", 3)
    client = HttpClient(port)
    plan = client.proposed()
    one.operator.at_first["decision"] = lambda: one.operator.ask(OperatorCommand.PAUSE)
    with ExitStack() as stack:
        watching = [stack.enter_context(closing(client.watch(plan))) for _ in range(3)]
        while not one.robot.is_busy:
            time.sleep(0.01)
        assert client.call("stop") == {"status": "stopped"}
        with pytest.raises(ConnectionError):
            watching[0].getresponse().read()
