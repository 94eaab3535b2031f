"""Connects to a server on this host."""

from __future__ import annotations

import socket

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    with socket.create_connection(("127.0.0.1", inputs["tcp"]), 2) as found:
        return found.send(b"secret")
