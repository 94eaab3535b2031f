"""Imports a module from a folder."""

from __future__ import annotations

import sys

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    sys.path.insert(0, inputs["folder"])
    return __import__("neighbour").VALUE
