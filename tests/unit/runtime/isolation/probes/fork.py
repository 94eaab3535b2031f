"""Forks."""

from __future__ import annotations

import os

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    child = os.fork()
    if child == 0:
        os._exit(0)
    return child
