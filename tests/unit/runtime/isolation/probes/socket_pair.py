"""Makes a pair of sockets."""

from __future__ import annotations

import socket

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    one, other = socket.socketpair()
    return one.fileno(), other.fileno()
