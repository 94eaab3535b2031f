"""Kill -9 at any instant leaves the old configuration or the new, whole, and the registry usable."""

from __future__ import annotations

import os
import random
import signal
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

from aeros.runtime.registry.lifecycle import ModuleState
from aeros.runtime.registry.registry import Registry
from aeros.runtime.registry.store import RegistrySnapshot
from tests.unit.runtime.registry.conftest import Author

KILLS = int(os.environ.get("AEROS_KILLS", "25"))


def _killed(change: Callable[[], object], after: float) -> bool:
    """Check that a process that makes `change` was killed before it was done."""
    child = os.fork()
    if child == 0:
        os.close(1)
        try:
            change()
        finally:
            os._exit(0)
    time.sleep(after)
    os.kill(child, signal.SIGKILL)
    return os.WIFSIGNALED(os.waitpid(child, 0)[1])


@pytest.mark.skipif(sys.platform != "linux", reason="needs fork and kill -9")
def test_a_killed_change_is_made_or_not_made(registry: Registry, write: Author) -> None:
    versions = [write(f"v{number}", version=f"1.{number}.0") for number in range(2)]
    registry.install(versions[0])
    registry.configure("tidy")
    chance = random.Random(20261121)  # noqa: S311
    usual = min(_seconds(registry.activate if turn % 2 else registry.deactivate) for turn in range(1, 7))
    outcomes = {True: 0, False: 0}
    for round_ in range(KILLS):
        old = registry.snapshot()
        if round_ % 2:
            change = partial(registry.install, versions[(round_ // 2 + 1) % 2])
        else:
            active = old.modules["tidy"].state is ModuleState.ACTIVE
            change = partial(registry.deactivate if active else registry.activate, "tidy")
        killed = _killed(change, chance.uniform(0.0, 1.3 * usual))
        new = registry.snapshot()
        assert _is_old_or_next(old, new)
        configuration, _ = registry.configuration()  # proves it, and that its files are whole
        assert ("tidy" in configuration.modules) == (new.modules["tidy"].state is ModuleState.ACTIVE)
        outcomes[killed] += 1
    assert outcomes[True] > KILLS // 5


def _seconds(change: Callable[[str], object]) -> float:
    began = time.monotonic()
    change("tidy")
    return time.monotonic() - began


def _is_old_or_next(old: RegistrySnapshot, new: RegistrySnapshot) -> bool:
    return new == old or new.generation == old.generation + 1


def test_the_next_change_removes_the_leftovers_of_a_killed_install(registry: Registry, write: Author) -> None:
    registry.install(write())
    rubbish: Path = registry.folder / "modules" / ("f" * 64) / "tidy"
    rubbish.mkdir(parents=True)
    (registry.folder / "modules" / f".{'e' * 64}.123").mkdir()
    registry.configure("tidy")
    assert len(list((registry.folder / "modules").iterdir())) == 1
