"""Starts a thread."""

from __future__ import annotations

import _thread

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    return _thread.start_new_thread(len, ("",))
