"""`aeros run --watchdog`: keeps an agent at its task, and restarts it where it ended without a word.

Three processes: this one, the plant, and the agent, each in a session of its own, so that a signal at the
terminal reaches this one, which passes it on, and none dies of another's end.

- The plant outlives both others, and stops whenever no agent commands it (`aeros.sim.hosting`).
- An agent that was killed, met a bug of ours, or sent no heartbeat for `silence` seconds (then it is
  killed) has crashed, and is started anew to go on with the task, or to tell how that ended.  One that ended
  in any other way has ended, and so has its task.
- After `crashes` crashes within `within` seconds it is left in quarantine until `aeros release`.
- An agent whose watchdog is gone stops, and leaves its task to be resumed.
"""

from __future__ import annotations

import argparse
import os
import select
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType
from typing import IO, Final

from aeros.agent.recovery.quarantine import Quarantine
from aeros.apps.watchdog.resumable_run import delete_run_options, end_plant
from aeros.exit_codes import Exit
from aeros.session.sd_notify import ALIVE, READY, STOPPING, Notifier
from aeros.sim.hosting.remote import RemotePlant

_START_TIMEOUT_S: Final = 300.0
"""Seconds that an agent has until it is ready: it proves its modules first."""

_POLL_INTERVAL_S: Final = 0.5
"""Seconds between looks at whether the plant is there still."""

_MAX_MESSAGE_BYTES: Final = 4096


def run_watchdog(arguments: argparse.Namespace) -> Exit:
    """Keep an agent at the task that is kept in the state folder until it has ended."""
    with Notifier() as notifier, tempfile.TemporaryDirectory(prefix="aeros-") as folder:
        return _Watchdog(arguments, notifier, Path(folder) / "notify.sock").run()


class _Watchdog:
    """Of one task."""

    def __init__(self, arguments: argparse.Namespace, notifier: Notifier, address: Path) -> None:
        self._arguments = arguments
        self._notifier = notifier
        self._address = address
        self._agent: subprocess.Popen[bytes] | None = None
        self._is_asked_to_end = False
        self._is_over = False
        """The agent has said that the task is, and tells what came of it."""

    def run(self) -> Exit:
        """See `run_watchdog`."""
        quarantine = Quarantine(self._arguments.state)
        with tempfile.TemporaryFile() as said, self._notify_socket() as heard, self._forward_signals():
            # Not at the terminal: the plant may stay behind, and would keep open what is read along there.
            plant = self._start("--serve-plant", output=said)
            while True:
                self._is_over = False
                self._agent = self._start("--resume", "--supervised")
                why = self._supervise(self._agent, heard, plant)
                if plant.poll():
                    said.seek(0)
                    told = said.read().decode("utf-8", "replace").strip()
                    print(f"aeros: the plant has ended: {told}", file=sys.stderr)
                    return Exit.REJECTED
                if why is None:
                    # Only now, so that whatever of this is killed, another agent tells how the task ended.
                    if self._is_over:
                        delete_run_options(self._arguments.state)
                    with suppress(OSError):
                        end_plant(RemotePlant(self._arguments.plant_at), self._arguments.state)
                    return _exit(self._agent.returncode)
                print(f"aeros: the agent has crashed: {why}", file=sys.stderr, flush=True)
                if self._is_asked_to_end:
                    return Exit.INTERRUPTED
                limits = (self._arguments.crashes, self._arguments.within)
                reason = quarantine.record_crash(why, time.time(), *limits)
                if reason is not None:
                    print(f"aeros: it is left in quarantine: {reason}", file=sys.stderr)
                    return Exit.REJECTED

    def _start(self, *role: str, output: IO[bytes] | None = None) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "aeros", "run", *role, "--state", str(self._arguments.state)]
        within = str(int(self._arguments.silence * 1e6))
        environment = {**os.environ, "NOTIFY_SOCKET": str(self._address), "WATCHDOG_USEC": within}
        return subprocess.Popen(  # noqa: S603  this program itself
            command,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=output,
            env=environment,
            start_new_session=True,
        )

    def _supervise(
        self, agent: subprocess.Popen[bytes], heard: socket.socket, plant: subprocess.Popen[bytes]
    ) -> str | None:
        """How it crashed; None where it ended as it should.  It is killed where the plant has failed."""
        handle = os.pidfd_open(agent.pid)
        try:
            latest = time.monotonic() + _START_TIMEOUT_S
            while True:
                left = min(max(0.0, latest - time.monotonic()), _POLL_INTERVAL_S)
                ready, _, _ = select.select([heard.fileno(), handle], [], [], left)
                if heard.fileno() in ready:
                    said = heard.recv(_MAX_MESSAGE_BYTES).decode("utf-8", "replace").split("\n")
                    if READY in said or ALIVE in said:
                        latest = time.monotonic() + self._arguments.silence
                    if STOPPING in said:
                        # It looks at its log once more, and writes a page: nobody asks it whether to go on.
                        self._is_over, latest = True, time.monotonic() + _START_TIMEOUT_S
                    self._notifier.send(*(word for word in said if word in (READY, ALIVE, STOPPING)))
                elif handle in ready:
                    break
                elif plant.poll():
                    agent.kill()
                    break
                elif time.monotonic() >= latest:
                    agent.kill()
                    agent.wait()
                    return f"it gave no sign of life for {self._arguments.silence:g} s and was killed"
        finally:
            os.close(handle)
        code = agent.wait()
        if code < 0:
            return f"killed by {signal.Signals(-code).name}"
        return f"it ended with exit code {code}" if code == Exit.INTERNAL_ERROR else None

    @contextmanager
    def _notify_socket(self) -> Iterator[socket.socket]:
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as heard:
            heard.bind(str(self._address))
            yield heard

    @contextmanager
    def _forward_signals(self) -> Iterator[None]:
        """Whoever interrupts or ends this process means the agent, which stops the robot first."""

        def pass_on(_number: int, _frame: FrameType | None) -> None:
            self._is_asked_to_end = True
            if self._agent is not None and self._agent.returncode is None:
                with suppress(ProcessLookupError):
                    os.kill(self._agent.pid, signal.SIGINT)

        former = {number: signal.signal(number, pass_on) for number in (signal.SIGINT, signal.SIGTERM)}
        try:
            yield
        finally:
            for number, handler in former.items():
                signal.signal(number, handler)


def _exit(code: int) -> Exit:
    try:
        return Exit(code)
    except ValueError:
        return Exit.INTERNAL_ERROR
