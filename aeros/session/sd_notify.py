"""Messages from a process to its supervisor in systemd's protocol: sd_notify(3), over a datagram socket.

`aeros run --watchdog` uses the same protocol to supervise its agent.
"""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Mapping
from typing import Final, Self

READY: Final = "READY=1"
ALIVE: Final = "WATCHDOG=1"
STOPPING: Final = "STOPPING=1"

_BEATS_PER_TIMEOUT: Final = 4
_DEFAULT_INTERVAL_S: Final = 1.0
"""Between heartbeats where `WATCHDOG_USEC` is not set."""


class Notifier:
    """Connection to the supervisor named by `NOTIFY_SOCKET`; sends nothing if that is not set.

    Args:
        environment: Environment variables; reads `NOTIFY_SOCKET` and `WATCHDOG_USEC`.

    Attributes:
        every: Seconds between heartbeats: a quarter of `WATCHDOG_USEC`.
        is_alone: There was a supervisor, and it is gone.
    """

    def __init__(self, environment: Mapping[str, str] = os.environ) -> None:
        address = environment.get("NOTIFY_SOCKET", "")
        self._address = f"\0{address[1:]}" if address.startswith("@") else address
        within = environment.get("WATCHDOG_USEC", "")
        self.every = int(within) / 1e6 / _BEATS_PER_TIMEOUT if within.isdecimal() else _DEFAULT_INTERVAL_S
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
        self._socket.setblocking(False)
        self._next_heartbeat = 0.0
        self.is_alone = False

    def send(self, *words: str) -> None:
        """Send a message without blocking; it is dropped if the supervisor does not read.

        Args:
            words: Assignments such as `READY=1`, sent as one line each.
        """
        if not self._address:
            return
        try:
            self._socket.sendto("\n".join(words).encode(), self._address)
        except (ConnectionRefusedError, FileNotFoundError):
            self.is_alone = True
        except OSError:
            pass

    def send_heartbeat(self) -> None:
        """Send `ALIVE` at most once in `every` seconds; between those it only reads a clock."""
        now = time.monotonic()
        if now >= self._next_heartbeat:
            self._next_heartbeat = now + self.every
            self.send(ALIVE)

    def close(self) -> None:
        """Close the socket; safe to call twice."""
        self._socket.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
