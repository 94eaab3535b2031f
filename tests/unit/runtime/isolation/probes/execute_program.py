"""Becomes another program."""

from __future__ import annotations

import os

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    os.execv("/bin/sh", ["sh", "-c", f"echo here > {inputs['folder']}/executed"])
