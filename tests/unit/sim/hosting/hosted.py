"""A plant hosted in a thread of this process, for tests that look at both ends."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from threading import Thread
from typing import Any, TypeVar

from aeros.runtime.ports import Plant
from aeros.sim.hosting.host import AGENT_TIMEOUT_S, PlantHost
from aeros.sim.hosting.remote import RemotePlant

_Made = TypeVar("_Made")


def once_it_listens(connect: Callable[[], _Made]) -> _Made:
    """Call `connect` until a host takes the connection: the path of its socket is there before it listens."""
    latest = time.monotonic() + 20.0
    while True:
        try:
            return connect()
        except (FileNotFoundError, ConnectionRefusedError):
            assert time.monotonic() < latest
            time.sleep(0.001)


Notes = list[Mapping[str, Any]]


class Hosting:
    """A running host of `plant`; `notes` holds its reports."""

    def __init__(self, plant: Plant, patience: float = AGENT_TIMEOUT_S, linger: float = 60.0) -> None:
        self._folder = tempfile.TemporaryDirectory()
        self.path = Path(self._folder.name) / "plant.sock"
        self.plant = plant
        self.notes: Notes = []
        self.thread = Thread(target=self._serve, args=(patience, linger), daemon=True)
        self.thread.start()

    def join(self) -> RemotePlant:
        """Connect to the host, once it listens."""
        return once_it_listens(lambda: RemotePlant(self.path))

    def events(self) -> list[str]:
        return [one["event"] for one in self.notes]

    def until(self, event: str) -> Mapping[str, Any]:
        """Wait for the first such event, and return its report."""
        latest = time.monotonic() + 20.0
        while event not in self.events():
            assert time.monotonic() < latest
            time.sleep(0.001)
        return self.notes[self.events().index(event)]

    def _serve(self, patience: float, linger: float) -> None:
        PlantHost(self.plant, self.notes.append, patience, linger).serve(self.path)
        self.plant.close()
        self._folder.cleanup()


class Hosted(RemotePlant):
    """A hosted plant that ends with its user."""

    def __init__(self, make: Callable[[], Plant]) -> None:
        self._hosting = Hosting(make())
        once_it_listens(partial(super().__init__, self._hosting.path))
        self._is_over = False

    def close(self) -> None:
        if not self._is_over:
            self._is_over = True
            self._call("end")
            super().close()
            self._hosting.thread.join(20.0)
