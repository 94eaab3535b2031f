"""Reads a file of the host."""

from __future__ import annotations

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    with open(inputs["canary"]) as file:
        return file.read()
