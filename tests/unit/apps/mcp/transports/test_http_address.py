"""Addresses of the MCP server over HTTP."""

from __future__ import annotations

import pytest

from aeros.apps.mcp.transports.http_address import (
    HttpAddressError,
    open_listener,
    parse_address,
    server_url,
)


@pytest.mark.parametrize(
    ("text", "host", "port"),
    [
        ("8765", "127.0.0.1", 8765),
        ("localhost:0", "127.0.0.1", 0),
        ("[::1]:80", "::1", 80),
        ("192.0.2.7:80", "192.0.2.7", 80),
    ],
)
def test_an_address_is_a_port_with_or_without_a_host(text: str, host: str, port: int) -> None:
    address = parse_address(text)
    assert (address.host, address.port) == (host, port)
    assert address.is_loopback == (host in ("127.0.0.1", "::1"))


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "expected PORT or HOST:PORT"),
        ("65536", "expected PORT or HOST:PORT"),
        ("a:b", "expected PORT or HOST:PORT"),
        ("robot.example:80", "`robot.example` is not an IP address of this host"),
        ("0.0.0.0:80", "give one address of this host"),
        ("[::]:80", "give one address of this host"),
    ],
)
def test_an_address_that_is_none_is_refused(text: str, why: str) -> None:
    with pytest.raises(HttpAddressError, match=why):
        parse_address(text)


@pytest.mark.parametrize(("text", "name"), [("0", "127.0.0.1"), ("[::1]:0", "[::1]")])
def test_a_server_has_a_url(text: str, name: str) -> None:
    with open_listener(parse_address(text)) as listener:
        assert server_url(listener) == f"http://{name}:{listener.getsockname()[1]}/mcp"


def test_an_address_of_another_host_cannot_be_served() -> None:
    with pytest.raises(OSError, match="assign requested address"):
        open_listener(parse_address("192.0.2.7:0"))
