"""Privileges of a process are gone for good; tried in children."""

from __future__ import annotations

import ctypes
import os
from functools import partial
from types import SimpleNamespace
from typing import Any

import pytest

from aeros.runtime.isolation import privileges
from aeros.runtime.isolation.kernel import process_control
from aeros.runtime.isolation.privileges import become_subreaper, drop_privileges
from tests.unit.runtime.isolation.support.forked import in_child

PR_GET_CHILD_SUBREAPER = 37


def status(_: int = 0) -> dict[str, str]:
    with open("/proc/self/status") as file:
        lines = dict(line.rstrip("\n").split(":\t", 1) for line in file)
    return {name: lines[name] for name in ("CapInh", "CapPrm", "CapEff", "NoNewPrivs")}


def dropped(_: int) -> dict[str, str]:
    drop_privileges()
    return status()


def test_no_capability_is_left_and_none_can_be_gained() -> None:
    zeros = "0" * 16
    assert in_child(dropped) == {"CapInh": zeros, "CapPrm": zeros, "CapEff": zeros, "NoNewPrivs": "1"}


def test_on_an_unknown_machine_no_new_ones_can_be_gained_at_least(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "uname", lambda: SimpleNamespace(machine="abacus"))
    assert in_child(dropped) == {**in_child(status), "NoNewPrivs": "1"}


def test_every_set_of_capabilities_is_emptied_in_one_call(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where this process has none to lose, as an ordinary user has none."""
    calls: list[tuple[int, list[int], list[int]]] = []

    def take(number: int, header: Any, data: Any) -> int:
        calls.append((number, list(header._obj), list(data._obj)))
        return 0

    monkeypatch.setattr(privileges, "system_call", take)
    monkeypatch.setattr(privileges, "process_control", lambda *_: 0)
    for machine in ("x86_64", "aarch64"):
        monkeypatch.setattr(os, "uname", partial(SimpleNamespace, machine=machine))
        drop_privileges()
    # linux/capability.h: version 3 has two words for each of effective, permitted, inheritable.
    assert calls == [(126, [0x20080522, 0], [0] * 6), (91, [0x20080522, 0], [0] * 6)]


def test_a_process_becomes_the_parent_of_its_orphans() -> None:
    def adopts(_: int) -> list[int]:
        value, found = ctypes.c_int(-1), []
        for adopts_them in (False, True):
            if adopts_them:
                become_subreaper()
            process_control(PR_GET_CHILD_SUBREAPER, ctypes.byref(value))
            found.append(value.value)
        return found

    assert in_child(adopts) == [0, 1]
