"""The ruleset gives up every right that the kernel's version knows; where the host has it, files are shut."""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.isolation import landlock
from aeros.runtime.isolation.landlock import restrict_files
from aeros.runtime.isolation.privileges import drop_privileges
from tests.host_layers import require_layers
from tests.unit.runtime.isolation.support.forked import in_child

CREATE_RULESET, RESTRICT_SELF = 444, 446


class Kernel:
    """System calls of a kernel with this version of Landlock, noted."""

    def __init__(self, version: int) -> None:
        self.version = version
        self.rights: list[tuple[int, int, int]] = []
        self.restricted: list[int] = []
        self.descriptor = -1

    def call(self, number: int, *arguments: Any) -> int:
        if number == CREATE_RULESET and arguments[0] is None:
            assert arguments == (None, 0, 1)
            return self.version
        if number == CREATE_RULESET:
            ruleset, size, flags = arguments
            words = ctypes.cast(ruleset, ctypes.POINTER(ctypes.c_uint64))
            assert (size, flags) == (24, 0)
            self.rights.append((words[0], words[1], words[2]))
            self.descriptor = os.open(os.devnull, os.O_RDONLY)
            return self.descriptor
        assert number == RESTRICT_SELF
        assert arguments == (self.descriptor, 0)
        self.restricted.append(self.descriptor)
        return 0


@pytest.mark.parametrize(
    ("version", "files", "tcp", "scopes"),
    [
        (1, 13, 0, 0),
        (2, 14, 0, 0),
        (3, 15, 0, 0),
        (4, 15, 0b11, 0),
        (5, 16, 0b11, 0),
        (6, 16, 0b11, 0b11),
        (9, 16, 0b11, 0b11),
    ],
)
def test_every_right_that_the_version_knows_is_given_up(
    version: int, files: int, tcp: int, scopes: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    kernel = Kernel(version)
    monkeypatch.setattr(landlock, "system_call", kernel.call)
    restrict_files()
    assert kernel.rights == [((1 << files) - 1, tcp, scopes)]
    assert kernel.restricted == [kernel.descriptor]
    with pytest.raises(OSError, match="Bad file descriptor"):
        os.fstat(kernel.descriptor)


def test_a_kernel_that_refuses_is_an_error_and_leaves_no_file_open(monkeypatch: pytest.MonkeyPatch) -> None:
    kernel = Kernel(6)

    def refusing(number: int, *arguments: Any) -> int:
        if number == RESTRICT_SELF:
            raise PermissionError
        return kernel.call(number, *arguments)

    monkeypatch.setattr(landlock, "system_call", refusing)
    with pytest.raises(PermissionError):
        restrict_files()
    with pytest.raises(OSError, match="Bad file descriptor"):
        os.fstat(kernel.descriptor)


@pytest.mark.layers
def test_named_paths_stay_open_and_folders_below_them(tmp_path: Path) -> None:
    require_layers("landlock")
    for name in ("read", "write", "shut"):
        (tmp_path / name / "below").mkdir(parents=True)
        (tmp_path / name / "below" / "file").write_text("x")

    def attempts(_: int) -> dict[str, list[str]]:
        drop_privileges()
        file = tmp_path / "shut" / "below" / "file"
        read, *write = (
            os.open(one, os.O_PATH | os.O_CLOEXEC) for one in (tmp_path / "read", tmp_path / "write", file)
        )
        restrict_files([read], write)
        return {name: _denied(tmp_path / name / "below") for name in ("read", "write", "shut")}

    assert in_child(attempts) == {
        "read": ["write", "make"],
        "write": [],
        "shut": ["list", "make"],  # of the file alone it has the rights
    }


def _denied(folder: Path) -> list[str]:
    acts: dict[str, Callable[[], object]] = {
        "read": (folder / "file").read_text,
        "list": lambda: list(folder.iterdir()),
        "write": lambda: (folder / "file").write_text("y"),
        "make": (folder / "new").mkdir,
    }
    found = []
    for name, act in acts.items():
        try:
            act()
        except PermissionError:
            found.append(name)
    return found


def test_with_a_network_tcp_stays_open_and_signals_do_not(monkeypatch: pytest.MonkeyPatch) -> None:
    kernel = Kernel(6)
    monkeypatch.setattr(landlock, "system_call", kernel.call)
    restrict_files(allows_network=True)
    assert kernel.rights == [((1 << 16) - 1, 0, 0b10)]


SHUT = """
from aeros.runtime.isolation.landlock import restrict_files
from aeros.runtime.isolation.privileges import drop_privileges
drop_privileges()
kept = open("/etc/hostname")
restrict_files()
kept.read()
try:
    open("/etc/hostname")
except PermissionError:
    print("shut")
"""


@pytest.mark.layers
def test_no_file_can_be_opened_any_more_on_this_host() -> None:
    require_layers("landlock")
    ran = subprocess.run([sys.executable, "-c", SHUT], capture_output=True, text=True, check=False)
    assert ran.stdout == "shut\n", ran.stderr
