"""seccomp filter, after which this process can only compute, use open descriptors, sleep, and end.

An allowlist: every other system call, known today or added to the kernel later, fails with EPERM. Memory can
never be made executable. A call of a foreign architecture kills the process.
Source: Linux, Documentation/userspace-api/seccomp_filter.rst; numbers from asm/unistd_64.h and
asm-generic/unistd.h
"""

from __future__ import annotations

import ctypes
import errno
import os
from collections.abc import Iterable, Iterator
from typing import Final, NamedTuple

from aeros.runtime.isolation.kernel import process_control


class CpuArchitecture(NamedTuple):
    """Processor architecture for a filter.

    Attributes:
        audit: its number in Linux's audit interface (AUDIT_ARCH_*).
        calls: its system call numbers by name.
    """

    audit: int
    calls: dict[str, int]


# fmt: off
ARCHITECTURES: Final = {
    "x86_64": CpuArchitecture(0xC000003E, {
        "read": 0, "write": 1, "close": 3, "mmap": 9, "mprotect": 10, "munmap": 11, "brk": 12,
        "rt_sigprocmask": 14, "rt_sigreturn": 15, "sched_yield": 24, "mremap": 25, "madvise": 28,
        "nanosleep": 35, "getpid": 39, "exit": 60, "gettimeofday": 96, "gettid": 186, "futex": 202,
        "restart_syscall": 219, "clock_gettime": 228, "clock_nanosleep": 230, "exit_group": 231,
        "getrandom": 318,
    }),
    "aarch64": CpuArchitecture(0xC00000B7, {
        "read": 63, "write": 64, "close": 57, "mmap": 222, "mprotect": 226, "munmap": 215, "brk": 214,
        "rt_sigprocmask": 135, "rt_sigreturn": 139, "sched_yield": 124, "mremap": 216, "madvise": 233,
        "nanosleep": 101, "getpid": 172, "exit": 93, "gettimeofday": 169, "gettid": 178, "futex": 98,
        "restart_syscall": 128, "clock_gettime": 113, "clock_nanosleep": 115, "exit_group": 94,
        "getrandom": 278,
    }),
}
"""System calls that a worker may make, by machine; on other machines this layer is missing."""
# fmt: on

_NOT_EXECUTABLE: Final = frozenset(("mmap", "mprotect"))
"""Allowed only without PROT_EXEC in their third argument."""

# Instructions of the classic Berkeley packet filter.
_LOAD: Final = 0x20
_JUMP_EQUAL: Final = 0x15
_JUMP_AT_LEAST: Final = 0x35
_JUMP_BITS: Final = 0x45
_RETURN: Final = 0x06

_CALL_NUMBER_OFFSET: Final = 0
_ARCHITECTURE_OFFSET: Final = 4
_THIRD_ARGUMENT_OFFSET: Final = 32  # its lower half, little-endian
_PROT_EXEC: Final = 4

_ALLOW: Final = 0x7FFF0000
_DENY: Final = 0x00050000 | errno.EPERM
_KILL: Final = 0x80000000

_SOCKET_CALLS: Final = {"x86_64": (41, 425), "aarch64": (198, 425)}
"""Numbers of `socket`, and of `io_uring_setup`, by which sockets can be made, too."""
_X32_CALLS: Final = 0x40000000
"""Least number of the calls of x86's other interface, which has the same number in the audit interface."""

_PR_SET_SECCOMP: Final = 22
_MODE_FILTER: Final = 2


class _Instruction(ctypes.Structure):
    _fields_ = (
        ("code", ctypes.c_uint16),
        ("if_true", ctypes.c_uint8),
        ("if_false", ctypes.c_uint8),
        ("operand", ctypes.c_uint32),
    )


class _FilterProgram(ctypes.Structure):
    _fields_ = (("length", ctypes.c_uint16), ("instructions", ctypes.POINTER(_Instruction)))


def restrict_system_calls() -> None:
    """Restrict this process to the allowed system calls, permanently. Needs `drop_privileges` before.

    Raises:
        OSError: the architecture is not listed, or the kernel refuses the filter.
    """
    machine = os.uname().machine
    if machine not in ARCHITECTURES:
        raise OSError(errno.ENOSYS, f"the system calls of {machine} are not listed")
    _install(_filter(ARCHITECTURES[machine]))


def restrict_sockets() -> None:
    """Take the right to make sockets of any kind, permanently. Needs `drop_privileges` before.

    Connected pairs of sockets (`socketpair`) lead nowhere and stay allowed.

    Raises:
        OSError: the architecture is not listed, or the kernel refuses the filter.
    """
    machine = os.uname().machine
    if machine not in _SOCKET_CALLS:
        raise OSError(errno.ENOSYS, f"the system calls of {machine} are not listed")
    _install(_socket_filter(ARCHITECTURES[machine].audit, _SOCKET_CALLS[machine]))


def _install(filter_: Iterable[tuple[int, int, int, int]]) -> None:
    instructions = [_Instruction(*fields) for fields in filter_]
    array = (_Instruction * len(instructions))(*instructions)
    program = _FilterProgram(len(instructions), array)
    process_control(_PR_SET_SECCOMP, _MODE_FILTER, ctypes.byref(program))


def _load_call(audit: int) -> Iterator[tuple[int, int, int, int]]:
    """Yield the start of a program: kill for a foreign architecture, and load the number of the call."""
    yield _LOAD, 0, 0, _ARCHITECTURE_OFFSET
    yield _JUMP_EQUAL, 1, 0, audit
    yield _RETURN, 0, 0, _KILL
    yield _LOAD, 0, 0, _CALL_NUMBER_OFFSET


def _socket_filter(audit: int, denied: Iterable[int]) -> Iterator[tuple[int, int, int, int]]:
    """Yield the program: (code, instructions to skip if true, if false, operand)."""
    yield from _load_call(audit)
    yield _JUMP_AT_LEAST, 0, 1, _X32_CALLS
    yield _RETURN, 0, 0, _KILL
    for number in denied:
        yield _JUMP_EQUAL, 0, 1, number
        yield _RETURN, 0, 0, _DENY
    yield _RETURN, 0, 0, _ALLOW


def _filter(architecture: CpuArchitecture) -> Iterator[tuple[int, int, int, int]]:
    """Yield the program: (code, instructions to skip if true, if false, operand)."""
    yield from _load_call(architecture.audit)
    for name, number in architecture.calls.items():
        if name in _NOT_EXECUTABLE:
            yield _JUMP_EQUAL, 0, 4, number
            yield _LOAD, 0, 0, _THIRD_ARGUMENT_OFFSET
            yield _JUMP_BITS, 0, 1, _PROT_EXEC
            yield _RETURN, 0, 0, _DENY
            yield _RETURN, 0, 0, _ALLOW
        else:
            yield _JUMP_EQUAL, 0, 1, number
            yield _RETURN, 0, 0, _ALLOW
    yield _RETURN, 0, 0, _DENY
