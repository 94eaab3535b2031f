"""Kills a process by a handle instead of a number."""

from __future__ import annotations

import os
import signal

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    handle = os.pidfd_open(inputs["victim"])
    signal.pidfd_send_signal(handle, signal.SIGKILL)
    return "killed"
