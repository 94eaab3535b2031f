"""Connects to a server on this host."""

from __future__ import annotations

import socket

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    with socket.socket() as found:
        found.connect(("127.0.0.1", inputs["tcp"]))
        return found.send(b"secret")
