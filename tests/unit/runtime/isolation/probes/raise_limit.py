"""Lifts its own limits."""

from __future__ import annotations

import resource

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    resource.setrlimit(resource.RLIMIT_NOFILE, (15, 15))
    return "changed"
