"""Forks and forks."""

from __future__ import annotations

import os
import time

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    children = []
    for _ in range(100):
        child = os.fork()
        if child == 0:
            while True:
                time.sleep(60)
        children.append(child)
    return len(children)
