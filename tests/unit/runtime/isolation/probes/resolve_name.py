"""Looks up a name."""

from __future__ import annotations

import socket

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    return socket.gethostbyname(b"localhost")
