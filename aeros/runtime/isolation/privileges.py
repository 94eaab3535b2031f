"""Privileges: drop all capabilities and the means to regain them. Always done, even if layers are missing."""

from __future__ import annotations

import ctypes
import os
from typing import Final

from aeros.runtime.isolation.kernel import process_control, system_call

_PR_SET_NO_NEW_PRIVS: Final = 38
_PR_SET_CHILD_SUBREAPER: Final = 36
_CAPSET: Final = {"x86_64": 126, "aarch64": 91}
_CAPABILITY_VERSION: Final = 0x20080522


def drop_privileges() -> None:
    """Drop every capability, and prevent executed programs from gaining any."""
    process_control(_PR_SET_NO_NEW_PRIVS, 1)
    number = _CAPSET.get(os.uname().machine)
    if number is None:
        return  # an ordinary user has none to drop; root is left to the layers
    header = (ctypes.c_uint32 * 2)(_CAPABILITY_VERSION, 0)
    system_call(number, ctypes.byref(header), ctypes.byref((ctypes.c_uint32 * 6)()))


def become_subreaper() -> None:
    """Make this process the parent of every descendant whose own parent ends."""
    process_control(_PR_SET_CHILD_SUBREAPER, 1)
