"""Listens for connections."""

from __future__ import annotations

import socket

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        listening.listen()
        return listening.getsockname()
