"""Renames a file of the host."""

from __future__ import annotations

import os

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    os.rename(inputs["canary"], inputs["folder"] + "/renamed")
    return "renamed"
