"""Heartbeats as systemd has them: who looks at its governor is alive, and who is alone stops."""

from __future__ import annotations

import socket
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from aeros.runtime.execution.governor import FixedGovernor, OperatorCommand
from aeros.session.run_governor import RunGovernor
from aeros.session.sd_notify import ALIVE, READY, Notifier
from tests.unit.runtime import bench


class Steered(FixedGovernor):
    """A governor that has a given operator command."""

    asked = OperatorCommand.RUN

    @property
    def command(self) -> OperatorCommand:
        return self.asked


@pytest.fixture
def supervisor(tmp_path: Path) -> Iterator[socket.socket]:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listening:
        listening.bind(str(tmp_path / "n.sock"))
        listening.settimeout(5.0)
        yield listening


@pytest.fixture
def notifier(tmp_path: Path, supervisor: socket.socket) -> Iterator[Notifier]:
    with Notifier({"NOTIFY_SOCKET": str(tmp_path / "n.sock"), "WATCHDOG_USEC": "400000"}) as speaking:
        yield speaking


def governor() -> Steered:
    return Steered(bench.configuration())


def test_each_look_is_a_heartbeat_and_no_more_than_a_supervisor_needs(
    notifier: Notifier, supervisor: socket.socket, monkeypatch: pytest.MonkeyPatch
) -> None:
    attending, now = RunGovernor(governor(), notifier), 100.0
    monkeypatch.setattr("aeros.session.sd_notify.time.monotonic", lambda: now)
    for _ in range(35):
        now += 0.01
        assert attending.command is OperatorCommand.RUN
    supervisor.setblocking(False)
    beats = 0
    while True:
        try:
            assert supervisor.recv(100).decode() == ALIVE
        except BlockingIOError:
            break
        beats += 1
    assert beats == 4


def test_words_arrive_as_systemd_has_them(notifier: Notifier, supervisor: socket.socket) -> None:
    notifier.send(READY, ALIVE)
    assert supervisor.recv(100) == b"READY=1\nWATCHDOG=1"


def test_an_abstract_address_is_understood() -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listening:
        listening.bind("")  # Linux gives it an abstract one
        listening.settimeout(5.0)
        name = listening.getsockname()
        with Notifier({"NOTIFY_SOCKET": "@" + name[1:].decode()}) as speaking:
            speaking.send(READY)
        assert listening.recv(100) == READY.encode()


def test_once_the_supervisor_is_gone_a_stop_is_asked_for(
    notifier: Notifier, supervisor: socket.socket
) -> None:
    attending = RunGovernor(governor(), notifier)
    attending.command  # noqa: B018  the first heartbeat
    supervisor.close()
    time.sleep(notifier.every)
    commands = [attending.command for _ in range(2)]
    assert (commands, notifier.is_alone) == ([OperatorCommand.STOP, OperatorCommand.STOP], True)


def test_a_supervisor_that_does_not_listen_is_not_waited_for(notifier: Notifier) -> None:
    began = time.monotonic()
    for _ in range(2000):
        notifier.send(ALIVE)
    assert time.monotonic() - began < 5.0
    assert not notifier.is_alone


def test_without_a_supervisor_nothing_is_reported_and_nothing_stops() -> None:
    with Notifier({}) as notifier:
        attending = RunGovernor(governor(), notifier)
        assert attending.command is OperatorCommand.RUN
        assert not notifier.is_alone


def test_a_change_of_what_is_asked_for_is_reported_once(notifier: Notifier) -> None:
    heard: list[OperatorCommand] = []
    asking = governor()
    attending = RunGovernor(asking, notifier)
    attending.on_command = heard.append
    for command in (OperatorCommand.RUN, OperatorCommand.PAUSE, OperatorCommand.PAUSE, OperatorCommand.RUN):
        asking.asked = command
        assert attending.command is command
    assert heard == [OperatorCommand.PAUSE, OperatorCommand.RUN]
