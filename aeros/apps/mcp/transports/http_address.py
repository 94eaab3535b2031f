"""Address at which the MCP server listens over HTTP."""

from __future__ import annotations

import ipaddress
import re
import socket
from typing import Final, NamedTuple

from aeros.apps.http_hosts import http_authority

HTTP_PATH: Final = "/mcp"

_ADDRESS: Final = re.compile(r"(?:(?P<host>[^\[\]:]+|\[[^\[\]]+\]):)?(?P<port>[0-9]{1,5})")


class HttpAddressError(ValueError):
    """An address that cannot be served; the message says why."""


class HttpAddress(NamedTuple):
    """Address that the server listens at.

    Attributes:
        host: IP address of this host.
        port: Port; 0 for any free one.
    """

    host: str
    port: int

    @property
    def is_loopback(self) -> bool:
        """True if only this host can connect."""
        return ipaddress.ip_address(self.host).is_loopback


def parse_address(text: str) -> HttpAddress:
    """Parse `PORT` or `HOST:PORT`.

    Args:
        text: The text; HOST is an IP address, in brackets for IPv6, or `localhost`.

    Returns:
        The address; the host is 127.0.0.1 if the text has none.

    Raises:
        HttpAddressError: The text is no such address, or names all addresses of this host.
    """
    match = _ADDRESS.fullmatch(text)
    if match is None or int(match["port"]) > 65_535:
        raise HttpAddressError("expected PORT or HOST:PORT, as in 8765 or 127.0.0.1:8765")
    host = (match["host"] or "127.0.0.1").strip("[]")
    host = "127.0.0.1" if host == "localhost" else host
    try:
        address = ipaddress.ip_address(host)
    except ValueError as error:
        raise HttpAddressError(f"`{host}` is not an IP address of this host") from error
    if address.is_unspecified:
        raise HttpAddressError("give one address of this host: requests must name it")
    return HttpAddress(str(address), int(match["port"]))


def open_listener(address: HttpAddress) -> socket.socket:
    """Open the listening socket.

    Args:
        address: The address.

    Returns:
        The socket.

    Raises:
        OSError: The address is not of this host, or is in use.
    """
    family = socket.AF_INET6 if ":" in address.host else socket.AF_INET
    return socket.create_server((address.host, address.port), family=family)


def server_url(listener: socket.socket) -> str:
    """Return the address for clients.

    Args:
        listener: The listening socket.

    Returns:
        The URL.
    """
    return f"http://{http_authority(*listener.getsockname()[:2])}{HTTP_PATH}"
