"""Connects to a UNIX socket in the file system."""

from __future__ import annotations

import socket

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    with socket.socket(socket.AF_UNIX) as found:
        found.connect(inputs["unix"])
        return found.send(b"secret")
