"""Names that requests may give a server: its address and `localhost`, and no other."""

from __future__ import annotations

import pytest

from aeros.apps.http_hosts import allowed_hosts, http_authority


@pytest.mark.parametrize(
    ("host", "port", "names"),
    [
        ("127.0.0.1", 8765, ["127.0.0.1:8765", "localhost:8765"]),
        ("::1", 8765, ["[::1]:8765", "localhost:8765"]),
        ("192.0.2.7", 8765, ["192.0.2.7:8765"]),
        ("127.0.0.1", 80, ["127.0.0.1:80", "localhost:80", "127.0.0.1", "localhost"]),
        ("2001:db8::7", 80, ["[2001:db8::7]:80", "[2001:db8::7]"]),
    ],
)
def test_a_server_is_named_by_its_address_and_on_this_host_by_localhost(
    host: str, port: int, names: list[str]
) -> None:
    assert allowed_hosts(host, port) == names
    assert http_authority(host, port) == names[0]
