"""Errors of motions: what a robot cannot do is refused before it begins, or broken off."""

from __future__ import annotations


class ActionRejectedError(Exception):
    """The plant cannot do this action; the message says why. Raised before any motion."""


class BlockedError(Exception):
    """Something holds the robot back during a motion; the message says where."""
