"""Two processes at one registry: one change at a time, and a reader sees each of them whole."""

from __future__ import annotations

import fcntl
import os
import sqlite3
from contextlib import suppress
from pathlib import Path
from threading import Event, Thread
from typing import Any

import pytest

from aeros.runtime.registry.lifecycle import ModuleState
from aeros.runtime.registry.registry import Registry
from aeros.runtime.registry.store import InstalledModule, RegistrySnapshot, RegistryStore

_PATIENCE = 10.0


def test_a_waiter_after_a_refused_first_change_holds_the_existing_lock(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    one, other = (Registry(tmp_path / "robot") for _ in range(2))
    waits, holds, done = Event(), Event(), Event()

    def change() -> None:
        with other._transactions.change_lock():
            holds.set()
            done.wait(_PATIENCE)

    second = Thread(target=change)
    flock = fcntl.flock

    def waiting(lock: int, how: int) -> None:
        if second.is_alive():
            waits.set()  # the file is open
        flock(lock, how)

    monkeypatch.setattr(fcntl, "flock", waiting)
    with suppress(ZeroDivisionError), one._transactions.change_lock():
        second.start()
        assert waits.wait(_PATIENCE)
        raise ZeroDivisionError
    assert holds.wait(_PATIENCE)
    third = os.open(one.folder / "change.lock", os.O_RDWR | os.O_CREAT)
    with pytest.raises(BlockingIOError):
        flock(third, fcntl.LOCK_EX | fcntl.LOCK_NB)
    os.close(third)
    done.set()
    second.join()


def test_a_change_while_somebody_reads_is_seen_whole_or_not_at_all(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = RegistrySnapshot(1, "before")
    after = RegistrySnapshot(
        2, "after", {"tidy": InstalledModule("tidy", "1.0.0", "0" * 64, ModuleState.INSTALLED)}
    )
    RegistryStore(tmp_path).replace(before)
    writer = Thread(target=lambda: RegistryStore(tmp_path).replace(after))

    class Interrupted(sqlite3.Connection):
        """Somebody changes what is kept as soon as the policy was read."""

        def execute(self, statement: str, *given: Any) -> sqlite3.Cursor:
            if "FROM modules ORDER" in statement and not writer.is_alive():
                writer.start()
                writer.join(0.5)  # so long, it may have to wait for a reader
            return super().execute(statement, *given)

    connect = sqlite3.connect
    monkeypatch.setattr(sqlite3, "connect", lambda *a, **named: connect(*a, **named, factory=Interrupted))
    assert RegistryStore(tmp_path).read() == before
    writer.join()
    monkeypatch.undo()
    assert RegistryStore(tmp_path).read() == after
