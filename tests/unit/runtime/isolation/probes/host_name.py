"""Looks up which host it is on."""

from __future__ import annotations

import os

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    return os.uname().nodename
