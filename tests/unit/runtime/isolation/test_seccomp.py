from __future__ import annotations

import errno
import os
import struct
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from aeros.runtime.isolation import seccomp as module
from aeros.runtime.isolation.seccomp import ARCHITECTURES


def test_the_same_system_calls_are_allowed_on_every_machine() -> None:
    names = [frozenset(one.calls) for one in ARCHITECTURES.values()]
    assert len(set(names)) == 1
    for one in ARCHITECTURES.values():
        assert len(set(one.calls.values())) == len(one.calls)


@pytest.mark.parametrize(
    ("machine", "header"),
    [
        ("x86_64", "/usr/include/x86_64-linux-gnu/asm/unistd_64.h"),
        ("aarch64", "/usr/include/asm-generic/unistd.h"),
    ],
)
def test_the_numbers_are_those_of_the_kernels_headers(machine: str, header: str) -> None:
    if not Path(header).exists():
        pytest.skip(f"this host has no {header}")
    words = [
        line.split() for line in Path(header).read_text().splitlines() if line.startswith("#define __NR")
    ]
    numbers = {
        line[1].removeprefix("__NR_").removeprefix("__NR3264_"): int(line[2])
        for line in words
        if len(line) >= 3 and line[2].isdigit()
    }
    assert {name: numbers[name] for name in ARCHITECTURES[machine].calls} == ARCHITECTURES[machine].calls


ALLOW, KILL, DENY = 0x7FFF0000, 0x80000000, 0x00050000 | errno.EPERM


def test_architectures_have_the_audit_numbers_of_the_kernel() -> None:
    # linux/audit.h: EM_X86_64 (62) and EM_AARCH64 (183), 64 bit, little-endian.
    assert {name: one.audit for name, one in ARCHITECTURES.items()} == {
        "x86_64": 62 | 0x80000000 | 0x40000000,
        "aarch64": 183 | 0x80000000 | 0x40000000,
    }


class Filter:
    """A filter as the kernel would run it, taken from the call that installs it."""

    def __init__(self, machine: str, name: str = "restrict_system_calls") -> None:
        installed: list[list[tuple[int, int, int, int]]] = []

        def take(option: int, mode: int, program: Any) -> int:
            assert (option, mode) == (22, 2)  # PR_SET_SECCOMP, SECCOMP_MODE_FILTER
            found = program._obj
            fields = [found.instructions[place] for place in range(found.length)]
            installed.append([(one.code, one.if_true, one.if_false, one.operand) for one in fields])
            return 0

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(module, "process_control", take)
            patch.setattr(os, "uname", lambda: SimpleNamespace(machine=machine))
            getattr(module, name)()
        (self.instructions,) = installed

    def run(self, architecture: int, call: int, third: int = 0) -> int:
        """The verdict on a system call; the data is laid out as `struct seccomp_data` is."""
        data = struct.pack("<IIQ6Q", call, architecture, 0, 0, 0, third, 0, 0, 0)
        place = loaded = 0
        while True:
            code, if_true, if_false, operand = self.instructions[place]
            place += 1
            match code:
                case 0x20:  # load a word
                    (loaded,) = struct.unpack_from("<I", data, operand)
                case 0x15:  # jump if equal
                    place += if_true if loaded == operand else if_false
                case 0x35:  # jump if at least
                    place += if_true if loaded >= operand else if_false
                case 0x45:  # jump if any bit is set
                    place += if_true if loaded & operand else if_false
                case 0x06:
                    return operand
                case _:
                    raise AssertionError(code)


@pytest.mark.parametrize("machine", ARCHITECTURES)
def test_listed_calls_are_allowed_and_all_others_denied(machine: str) -> None:
    audit, calls = ARCHITECTURES[machine]
    program = Filter(machine)
    listed = set(calls.values())
    verdicts = {number: program.run(audit, number) for number in range(4096)}
    assert {number for number, verdict in verdicts.items() if verdict == ALLOW} == listed
    assert set(verdicts.values()) == {ALLOW, DENY}
    assert program.run(audit, 0x40000000 | calls["read"]) == DENY  # the x32 variant


@pytest.mark.parametrize("machine", ARCHITECTURES)
def test_a_call_of_another_architecture_kills(machine: str) -> None:
    audit, calls = ARCHITECTURES[machine]
    program = Filter(machine)
    assert {program.run(other, calls["read"]) for other in (0, 0x40000003, audit ^ 1)} == {KILL}


@pytest.mark.parametrize("name", ["mmap", "mprotect"])
@pytest.mark.parametrize("machine", ARCHITECTURES)
def test_memory_is_never_made_executable(machine: str, name: str) -> None:
    audit, calls = ARCHITECTURES[machine]
    program = Filter(machine)
    verdicts = [program.run(audit, calls[name], protection) for protection in (0, 1, 3, 4, 5, 7, 8)]
    assert verdicts == [ALLOW, ALLOW, ALLOW, DENY, DENY, DENY, ALLOW]
    assert program.run(audit, calls["read"], 4) == ALLOW


@pytest.mark.parametrize(("machine", "call"), [("x86_64", 41), ("aarch64", 198)])
def test_sockets_and_rings_are_denied_and_nothing_else(machine: str, call: int) -> None:
    audit, _ = ARCHITECTURES[machine]
    program = Filter(machine, "restrict_sockets")
    verdicts = {number: program.run(audit, number) for number in range(4096)}
    assert {number for number, verdict in verdicts.items() if verdict == DENY} == {call, 425}
    assert set(verdicts.values()) == {ALLOW, DENY}
    assert program.run(audit, 0x40000000 | call) == KILL  # the x32 variant
    assert {program.run(other, 0) for other in (0, 0x40000003, audit ^ 1)} == {KILL}


@pytest.mark.parametrize("name", ["restrict_system_calls", "restrict_sockets"])
def test_on_an_unknown_machine_nothing_can_be_restricted(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "uname", lambda: SimpleNamespace(machine="abacus"))
    with pytest.raises(OSError, match="the system calls of abacus are not listed") as failure:
        getattr(module, name)()
    assert failure.value.errno == errno.ENOSYS
