"""Targets of attacks around a worker, and checks that they are unharmed."""

from __future__ import annotations

import ctypes
import os
import socket
import subprocess
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

CONTENT = "the canary is well"
_MEMORY = b"mine alone"


class Surroundings:
    """A canary, a folder, listeners of every kind, a bystander, and a piece of this process's memory."""

    def __init__(self, folder: Path, leaving: ExitStack) -> None:
        self.folder = folder
        self.canary = folder / "canary"
        self.canary.write_text(CONTENT)
        self.canary.chmod(0o600)
        (folder / "neighbour.py").write_text("VALUE = 'imported'\n")
        self.memory = ctypes.create_string_buffer(_MEMORY, 16)
        self.tcp = leaving.enter_context(socket.create_server(("127.0.0.1", 0)))
        self.udp = leaving.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
        self.udp.bind(("127.0.0.1", 0))
        self.unix = leaving.enter_context(socket.socket(socket.AF_UNIX))
        self.unix.bind(str(folder / "unix"))
        self.abstract = leaving.enter_context(socket.socket(socket.AF_UNIX))
        self._name = f"aeros-probe-{os.getpid()}-{os.urandom(4).hex()}"
        self.abstract.bind(f"\0{self._name}")
        for listening in (self.tcp, self.unix, self.abstract):
            listening.listen()
        for one in (self.tcp, self.udp, self.unix, self.abstract):
            one.setblocking(False)
        self.bystander = leaving.enter_context(subprocess.Popen(["sleep", "600"]))
        leaving.callback(self.bystander.kill)
        self._nice = os.getpriority(os.PRIO_PROCESS, self.bystander.pid)
        self._limits = self._limits_of_bystander()
        self._files = self._listing()

    @property
    def inputs(self) -> dict[str, Any]:
        return {
            "canary": str(self.canary),
            "folder": str(self.folder),
            "tcp": self.tcp.getsockname()[1],
            "udp": self.udp.getsockname()[1],
            "unix": str(self.folder / "unix"),
            "abstract": self._name,
            "victim": self.bystander.pid,
            "runtime": os.getpid(),
            "address": ctypes.addressof(self.memory),
        }

    def harm(self) -> list[str]:
        """Everything that is not as it was."""
        found = []
        if not self.canary.exists() or self.canary.read_text() != CONTENT:
            found.append("the canary was changed")
        elif self.canary.stat().st_mode & 0o777 != 0o600:
            found.append("the canary's mode was changed")
        if self._listing() != self._files:
            found.append(f"files changed: {self._listing() ^ self._files}")
        listening = {"tcp": self.tcp, "unix": self.unix, "abstract": self.abstract}
        found += [f"{name} was connected to" for name, one in listening.items() if _is_connected_to(one)]
        if _happens(lambda: self.udp.recv(100)):
            found.append("a datagram arrived")
        if self.bystander.poll() is not None:
            found.append("the bystander was killed")
        elif os.getpriority(os.PRIO_PROCESS, self.bystander.pid) != self._nice:
            found.append("the bystander was slowed down")
        elif self._limits_of_bystander() != self._limits:
            found.append("the bystander was limited")
        if self.memory.value != _MEMORY:
            found.append("memory was overwritten")
        return found

    def _listing(self) -> set[str]:
        return {path.name for path in self.folder.iterdir() if path.name != "__pycache__"}

    def _limits_of_bystander(self) -> str:
        return Path(f"/proc/{self.bystander.pid}/limits").read_text()


@contextmanager
def surroundings(folder: Path) -> Iterator[Surroundings]:
    with ExitStack() as leaving:
        yield Surroundings(folder, leaving)


def below(pid: int) -> set[int]:
    """Every process below `pid`."""
    parents: dict[int, int] = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / "stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue
            parents[int(entry.name)] = int(fields[1])
    found = {pid}
    while more := {child for child, parent in parents.items() if parent in found} - found:
        found |= more
    return found - {pid}


def _is_connected_to(listening: socket.socket) -> bool:
    return _happens(lambda: listening.accept()[0].close())


def _happens(attempt: Any) -> bool:
    try:
        attempt()
    except BlockingIOError:
        return False
    return True
