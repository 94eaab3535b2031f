"""Names by which requests may address an HTTP server: a web page may rebind its own name to this host."""

from __future__ import annotations

import ipaddress
from http.client import HTTP_PORT


def http_authority(host: str, port: int) -> str:
    """Write an address as URLs do.

    Args:
        host: IP address or name.
        port: port.

    Returns:
        Both, an IPv6 address in brackets.
    """
    return f"{_bracketed(host)}:{port}"


def allowed_hosts(host: str, port: int) -> list[str]:
    """List the names of a server that requests may give in `Host`.

    Args:
        host: IP address that it listens at.
        port: its port.

    Returns:
        Address and port; on a loopback address also `localhost` and port. Without the port, too, if it is
        that of HTTP, which clients leave out.
    """
    names = [host, "localhost"] if ipaddress.ip_address(host).is_loopback else [host]
    short = [_bracketed(name) for name in names] if port == HTTP_PORT else []
    return [http_authority(name, port) for name in names] + short


def _bracketed(host: str) -> str:
    return f"[{host}]" if ":" in host else host
