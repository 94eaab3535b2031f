"""A zygote forks one worker at a time, sees each to its end, and ends when the runtime hangs up."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from aeros.runtime.isolation.layers import APPLY_LAYER, IsolationLayer
from aeros.runtime.isolation.protocol import CloseSkill, SkillClosed, WorkerConnection

START = "from aeros.runtime.isolation.zygote import main; main({}, ['fractions'])"


class Control:
    """The runtime's end of a zygote."""

    def __init__(self) -> None:
        self.socket, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.socket.settimeout(30.0)
        with theirs:
            descriptor = theirs.fileno()
            command = [sys.executable, "-c", START.format(descriptor)]
            self.process = subprocess.Popen(command, pass_fds=[descriptor])

    def hear(self) -> bytes:
        return self.socket.recv(1 << 16)

    def spawn(self) -> socket.socket:
        ours, theirs = socket.socketpair()
        with theirs:
            socket.send_fds(self.socket, [b"spawn 0 1.0"], [theirs.fileno()])
        return ours

    def children(self) -> list[int]:
        files = Path(f"/proc/{self.process.pid}/task").glob("*/children")
        return [int(pid) for file in files for pid in file.read_text().split()]


@pytest.fixture
def control() -> Iterator[Control]:
    made = Control()
    assert made.hear() == b"ready"
    yield made
    made.socket.close()
    assert made.process.wait(30.0) == 0


def test_a_worker_that_ends_by_itself_is_gone_with_its_exit_code(control: Control) -> None:
    for _ in range(2):
        talk = WorkerConnection(control.spawn())
        assert isinstance(talk.request(CloseSkill(talk.token()), 20.0), SkillClosed)
        assert control.hear() == b"gone 0"
        assert control.children() == []
        talk.close()


def test_a_worker_is_killed_when_that_is_asked_for(control: Control) -> None:
    channel = control.spawn()
    latest = time.monotonic() + 20.0
    while not control.children() and time.monotonic() < latest:
        time.sleep(0.005)
    assert len(control.children()) == 1
    control.socket.send(b"kill")
    assert control.hear() == b"gone -9"
    assert control.children() == []
    channel.close()


def test_a_worker_ends_with_its_zygote(control: Control) -> None:
    channel = control.spawn()
    channel.settimeout(30.0)
    control.socket.close()
    assert control.process.wait(30.0) == 0
    assert channel.recv(1) == b""
    channel.close()


def test_a_probe_says_of_each_layer_why_it_is_missing(control: Control) -> None:
    control.socket.send(f"probe {os.getpid()} /etc/hostname none".encode())
    found = json.loads(control.hear())
    assert found.keys() == {layer.value for layer in (*APPLY_LAYER, IsolationLayer.BUBBLEWRAP)}
    assert all(why is None or isinstance(why, str) for why in found.values())
    # This process is not in bubblewrap: the zygote sees what is around it.
    assert found[IsolationLayer.BUBBLEWRAP.value] is not None
