"""Asks the kernel about the network."""

from __future__ import annotations

import socket

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    with socket.socket(socket.AF_NETLINK, socket.SOCK_RAW, 0) as asking:
        return asking.getsockname()
