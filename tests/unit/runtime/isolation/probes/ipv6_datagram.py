"""Opens a socket of IPv6."""

from __future__ import annotations

import socket

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    with socket.socket(socket.AF_INET6, socket.SOCK_DGRAM) as sending:
        return sending.fileno()
