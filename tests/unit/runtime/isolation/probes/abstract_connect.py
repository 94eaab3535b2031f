"""Connects to a UNIX socket that no file stands for."""

from __future__ import annotations

import socket

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    with socket.socket(socket.AF_UNIX) as found:
        found.connect("\0" + inputs["abstract"])
        return found.send(b"secret")
