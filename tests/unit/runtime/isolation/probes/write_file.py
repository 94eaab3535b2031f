"""Writes a new file."""

from __future__ import annotations

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    with open(inputs["folder"] + "/written", "w") as file:
        return file.write("I was here")
