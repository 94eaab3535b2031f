"""Computes for ever before it is a skill."""

from __future__ import annotations

from aeros.skill import act

while True:
    act("never")
