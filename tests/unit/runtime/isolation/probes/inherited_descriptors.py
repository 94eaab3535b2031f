"""Looks for descriptors it was not meant to have."""

from __future__ import annotations

import os

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    found = []
    for descriptor in range(3, 1024):
        try:
            os.write(descriptor, b"")
        except OSError:
            continue
        found.append(descriptor)
    if len(found) <= 1:
        raise PermissionError("only its own channel")
    return found
