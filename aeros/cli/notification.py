"""What a process tells whoever supervises it, as systemd has it: sd_notify(3), over a datagram socket.

`aeros run --watchdog` listens to its agent in the same words in which it speaks to systemd.
"""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Callable, Mapping
from typing import Final, Self

from aeros.cli.relay import Relay
from aeros.runtime.governor import Command, Governor

READY: Final = "READY=1"
ALIVE: Final = "WATCHDOG=1"
STOPPING: Final = "STOPPING=1"

_BEATS: Final = 4
"""Heartbeats in the time in which one must come."""

_USUAL: Final = 1.0
"""Seconds between heartbeats where nobody says how often one must come."""


class Notifier:
    """Speaks to the supervisor that `NOTIFY_SOCKET` names; to nobody where that is not set.

    every: seconds between heartbeats, from `WATCHDOG_USEC`.
    is_alone: there was a supervisor, and it is gone.
    """

    def __init__(self, environment: Mapping[str, str] = os.environ) -> None:
        address = environment.get("NOTIFY_SOCKET", "")
        self._address = f"\0{address[1:]}" if address.startswith("@") else address
        within = environment.get("WATCHDOG_USEC", "")
        self.every = int(within) / 1e6 / _BEATS if within.isdecimal() else _USUAL
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
        self._socket.setblocking(False)
        self.is_alone = False

    def tell(self, *words: str) -> None:
        """Say it; a supervisor that does not listen just now is not waited for."""
        if not self._address:
            return
        try:
            self._socket.sendto("\n".join(words).encode(), self._address)
        except (ConnectionRefusedError, FileNotFoundError):
            self.is_alone = True
        except OSError:
            pass

    def close(self) -> None:
        """Say nothing more; safe to call twice."""
        self._socket.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class Attended(Relay):
    """A governor that tells the supervisor that somebody looks at it, which is the agent's heartbeat.

    So it beats as often as somebody asks whether to go on: before every action, at every control tick, and
    while the operator pauses.  Once the supervisor is gone it asks for a stop.
    on_command: hears of each change of what the operator asks for.
    """

    def __init__(self, governor: Governor, notifier: Notifier) -> None:
        super().__init__(governor)
        self._notifier = notifier
        self._next = 0.0
        self._last = Command.RUN
        self.on_command: Callable[[Command], None] = lambda _: None

    @property
    def command(self) -> Command:
        """See `Governor`."""
        now = time.monotonic()
        if now >= self._next:
            self._next = now + self._notifier.every
            self._notifier.tell(ALIVE)
        command = Command.STOP if self._notifier.is_alone else self._governor.command
        if command is not self._last:
            self._last = command
            self.on_command(command)
        return command
