"""Landlock rules, after which this process opens no file, uses no TCP, and signals no process outside.

A ruleset that handles every right its kernel knows and grants none. Open files stay open. Landlock does not
cover UDP and other sockets, forks, `stat` and similar calls, for which there is `seccomp`.
Source: Linux, Documentation/userspace-api/landlock.rst and include/uapi/linux/landlock.h
"""

from __future__ import annotations

import ctypes
import os
from typing import Final

from aeros.runtime.isolation.kernel import system_call

# The same on every architecture.
_CREATE_RULESET: Final = 444
_RESTRICT_SELF: Final = 446
_CREATE_RULESET_VERSION: Final = 1

_FILE_RIGHTS: Final = {1: 13, 2: 14, 3: 15, 5: 16}
"""Number of file rights, by the version that introduced the last of them."""
_TCP_RIGHTS: Final = (4, 0b11)  # since version 4: bind, connect
_SCOPES: Final = (6, 0b11)  # since version 6: abstract UNIX sockets, signals


class _Ruleset(ctypes.Structure):
    _fields_ = (
        ("handled_access_fs", ctypes.c_uint64),
        ("handled_access_net", ctypes.c_uint64),
        ("scoped", ctypes.c_uint64),
    )


def landlock_version() -> int:
    """Ask the kernel for its version of Landlock.

    Returns:
        The version of the interface, from 1.

    Raises:
        OSError: the kernel has no Landlock.
    """
    return system_call(_CREATE_RULESET, None, 0, _CREATE_RULESET_VERSION)


def restrict_files() -> None:
    """Give up every right that this kernel's Landlock handles. Needs `drop_privileges` before."""
    version = landlock_version()
    rights = max(count for since, count in _FILE_RIGHTS.items() if since <= version)
    ruleset = _Ruleset((1 << rights) - 1)
    # An older kernel refuses a structure whose later fields are in use.
    if version >= _TCP_RIGHTS[0]:
        ruleset.handled_access_net = _TCP_RIGHTS[1]
    if version >= _SCOPES[0]:
        ruleset.scoped = _SCOPES[1]
    descriptor = system_call(_CREATE_RULESET, ctypes.byref(ruleset), ctypes.sizeof(ruleset), 0)
    try:
        system_call(_RESTRICT_SELF, descriptor, 0)
    finally:
        os.close(descriptor)
