"""Looks for secrets in the environment."""

from __future__ import annotations

import os

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    return os.environ["AEROS_PROBE_SECRET"]
