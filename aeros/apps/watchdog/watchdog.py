"""`aeros run --watchdog`: run an agent and restart it after a crash.

Three processes: the watchdog, the plant, and the agent.  Each is in a session of its own, so a signal at the
terminal reaches only the watchdog, which forwards it, and no process dies with another.

- The plant outlives both others, and stops whenever no agent commands it (`aeros.sim.hosting`).
- An agent has crashed if it was killed, raised an internal error, or sent no heartbeat for `silence` seconds
  (then it is killed).  It is restarted to resume the task, or to report how the task ended.  Any other exit
  ends the task.
- After `crashes` crashes within `within` seconds the agent is quarantined until `aeros release`.
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
from aeros.files import temporary_folder
from aeros.session.sd_notify import ALIVE, READY, STOPPING, Notifier
from aeros.sim.hosting.remote import RemotePlant

_START_TIMEOUT_S: Final = 300.0
"""Seconds within which an agent must be ready: it proves its modules first."""

_POLL_INTERVAL_S: Final = 0.5
"""Seconds between checks that the plant still runs."""

_MAX_MESSAGE_BYTES: Final = 4096


def run_watchdog(arguments: argparse.Namespace) -> Exit:
    """Run the saved task of the state folder under a watchdog until it has ended.

    Args:
        arguments: The options of the run, with `plant_at`, the socket of the plant.

    Returns:
        The exit code of the agent, or of the failure.
    """
    with Notifier() as notifier, temporary_folder() as folder:
        return _Watchdog(arguments, notifier, folder / "notify.sock").run()


class _Watchdog:
    """Watchdog of one task."""

    def __init__(self, arguments: argparse.Namespace, notifier: Notifier, address: Path) -> None:
        self._arguments = arguments
        self._notifier = notifier
        self._address = address
        self._agent: subprocess.Popen[bytes] | None = None
        self._is_asked_to_end = False
        self._is_over = False
        """The agent has announced the end of the task and prints its report."""

    def run(self) -> Exit:
        """Implement `run_watchdog`."""
        quarantine = Quarantine(self._arguments.state)
        with (
            tempfile.TemporaryFile() as plant_output,
            self._notify_socket() as messages,
            self._forward_signals(),
        ):
            # Not to the terminal: the plant may outlive this process and would keep the terminal's pipe open.
            plant = self._start("--serve-plant", output=plant_output)
            while True:
                self._is_over = False
                self._agent = self._start("--resume", "--supervised")
                why = self._supervise(self._agent, messages, plant)
                if plant.poll():
                    plant_output.seek(0)
                    error_text = plant_output.read().decode("utf-8", "replace").strip()
                    print(f"aeros: the plant has ended: {error_text}", file=sys.stderr)
                    return Exit.REJECTED
                if why is None:
                    # Only now: if a process is killed before, another agent can still report the end.
                    if self._is_over:
                        delete_run_options(self._arguments.state)
                    with suppress(OSError):
                        end_plant(RemotePlant(self._arguments.plant_at), self._arguments.state)
                    return _exit(self._agent.returncode)
                print(f"aeros: the agent has crashed: {why}", file=sys.stderr, flush=True)
                if self._is_asked_to_end:
                    return Exit.INTERRUPTED
                limits = (self._arguments.max_crashes, self._arguments.crash_window)
                reason = quarantine.record_crash(why, time.time(), *limits)
                if reason is not None:
                    print(f"aeros: agent quarantined: {reason}", file=sys.stderr)
                    return Exit.REJECTED

    def _start(self, *role: str, output: IO[bytes] | None = None) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "aeros", "run", *role, "--state", str(self._arguments.state)]
        within = str(int(self._arguments.heartbeat_timeout * 1e6))
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
        self, agent: subprocess.Popen[bytes], messages: socket.socket, plant: subprocess.Popen[bytes]
    ) -> str | None:
        """Wait for the end of the agent; kill it if it is silent or the plant has failed.

        Returns a description of the crash; None if the agent ended normally or the plant has failed.
        """
        handle = os.pidfd_open(agent.pid)
        try:
            latest = time.monotonic() + _START_TIMEOUT_S
            while True:
                left = min(max(0.0, latest - time.monotonic()), _POLL_INTERVAL_S)
                ready, _, _ = select.select([messages.fileno(), handle], [], [], left)
                if messages.fileno() in ready:
                    lines = messages.recv(_MAX_MESSAGE_BYTES).decode("utf-8", "replace").split("\n")
                    if READY in lines or ALIVE in lines:
                        latest = time.monotonic() + self._arguments.heartbeat_timeout
                    if STOPPING in lines:
                        # It checks its log and may write a report: no heartbeats are expected meanwhile.
                        self._is_over, latest = True, time.monotonic() + _START_TIMEOUT_S
                    self._notifier.send(*(line for line in lines if line in (READY, ALIVE, STOPPING)))
                elif handle in ready:
                    break
                elif plant.poll():
                    agent.kill()
                    break
                elif time.monotonic() >= latest:
                    agent.kill()
                    agent.wait()
                    return f"no heartbeat for {self._arguments.heartbeat_timeout:g} s; killed"
        finally:
            os.close(handle)
        code = agent.wait()
        if code < 0:
            return f"killed by {signal.Signals(-code).name}"
        return f"it ended with exit code {code}" if code == Exit.INTERNAL_ERROR else None

    @contextmanager
    def _notify_socket(self) -> Iterator[socket.socket]:
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as messages:
            messages.bind(str(self._address))
            yield messages

    @contextmanager
    def _forward_signals(self) -> Iterator[None]:
        """Forward SIGINT and SIGTERM to the agent, which stops the robot first."""

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
