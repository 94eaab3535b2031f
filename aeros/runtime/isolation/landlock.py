"""Landlock rules, after which this process opens no file, uses no TCP, and signals no process outside.

A ruleset that handles every right its kernel knows and grants none, or those on some paths. Open files stay
open. Landlock does not cover UDP and other sockets, forks, `stat` and similar calls, for which there is
`seccomp`.
Source: Linux, Documentation/userspace-api/landlock.rst and include/uapi/linux/landlock.h
"""

from __future__ import annotations

import ctypes
import os
import stat
from collections.abc import Iterable
from typing import Final

from aeros.runtime.isolation.kernel import system_call

# The same on every architecture.
_CREATE_RULESET: Final = 444
_ADD_RULE: Final = 445
_RESTRICT_SELF: Final = 446
_CREATE_RULESET_VERSION: Final = 1

_FILE_RIGHTS: Final = {1: 13, 2: 14, 3: 15, 5: 16}
"""Number of file rights, by the version that introduced the last of them."""
_TCP_RIGHTS: Final = (4, 0b11)  # since version 4: bind, connect
_SCOPES: Final = (6, 0b11)  # since version 6: abstract UNIX sockets, signals
_SIGNAL_SCOPE: Final = 0b10

_PATH_BENEATH: Final = 1
_READ: Final = 0b1101  # execute, read a file, read a folder
_MAKE_DEVICE: Final = 1 << 6 | 1 << 11  # a character or block device
_OF_FILES: Final = 1 << 0 | 1 << 1 | 1 << 2 | 1 << 14 | 1 << 15
"""Rights on a file: execute, write, read, truncate, and requests to a device; others are of folders."""


class _Ruleset(ctypes.Structure):
    _fields_ = (
        ("handled_access_fs", ctypes.c_uint64),
        ("handled_access_net", ctypes.c_uint64),
        ("scoped", ctypes.c_uint64),
    )


class _PathRule(ctypes.Structure):
    _pack_ = 1
    _fields_ = (("allowed", ctypes.c_uint64), ("parent", ctypes.c_int32))


def landlock_version() -> int:
    """Ask the kernel for its version of Landlock.

    Returns:
        The version of the interface, from 1.

    Raises:
        OSError: the kernel has no Landlock.
    """
    return system_call(_CREATE_RULESET, None, 0, _CREATE_RULESET_VERSION)


def restrict_files(
    reads: Iterable[int] = (), writes: Iterable[int] = (), *, allows_network: bool = False
) -> None:
    """Give up every right that this kernel's Landlock handles. Needs `drop_privileges` before.

    Args:
        reads: descriptors of files and folders that it may still read and execute.
        writes: descriptors of those that it may also change; no device can be made there.
        allows_network: keep TCP and abstract UNIX sockets.

    Raises:
        OSError: there is no Landlock.
    """
    version = landlock_version()
    rights = max(count for since, count in _FILE_RIGHTS.items() if since <= version)
    ruleset = _Ruleset((1 << rights) - 1)
    # An older kernel refuses a structure whose later fields are in use.
    if version >= _TCP_RIGHTS[0] and not allows_network:
        ruleset.handled_access_net = _TCP_RIGHTS[1]
    if version >= _SCOPES[0]:
        ruleset.scoped = _SIGNAL_SCOPE if allows_network else _SCOPES[1]
    descriptor = system_call(_CREATE_RULESET, ctypes.byref(ruleset), ctypes.sizeof(ruleset), 0)
    try:
        for place in reads:
            _allow(descriptor, place, _READ)
        for place in writes:
            _allow(descriptor, place, ruleset.handled_access_fs & ~_MAKE_DEVICE)
        system_call(_RESTRICT_SELF, descriptor, 0)
    finally:
        os.close(descriptor)


def _allow(ruleset: int, place: int, rights: int) -> None:
    """Grant rights on a file, or on all that a folder holds."""
    if not stat.S_ISDIR(os.fstat(place).st_mode):
        rights &= _OF_FILES
    rule = _PathRule(rights, place)
    system_call(_ADD_RULE, ruleset, _PATH_BENEATH, ctypes.byref(rule), 0)
