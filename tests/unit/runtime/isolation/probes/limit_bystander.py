"""Lowers a limit of another process."""

from __future__ import annotations

import resource

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    return resource.prlimit(inputs["victim"], resource.RLIMIT_NOFILE, (64, 64))
