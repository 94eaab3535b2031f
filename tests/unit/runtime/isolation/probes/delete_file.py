"""Deletes a file of the host."""

from __future__ import annotations

import os

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    os.unlink(inputs["canary"])
    return "deleted"
