"""Reads where everything lies in memory."""

from __future__ import annotations

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    with open("/proc/self/maps") as file:
        return file.read()
