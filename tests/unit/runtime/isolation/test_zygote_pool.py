"""Zygotes fork workers and end them; a pool replaces what died, and does without a broken bubblewrap."""

from __future__ import annotations

import os
import signal
import socket
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import pytest

from aeros.runtime.isolation import zygote_pool as module
from aeros.runtime.isolation.control_groups import ControlGroupError
from aeros.runtime.isolation.layers import IsolationLayer
from aeros.runtime.isolation.limits import ProcessLimits
from aeros.runtime.isolation.protocol import CloseSkill, SkillClosed, WorkerConnection
from aeros.runtime.isolation.zygote_pool import Zygote, ZygoteError, ZygotePool

ENDS = (0, -signal.SIGKILL)
"""Exit codes of a worker that is over: it ended by itself, or was killed just before."""


def serves(channel: socket.socket) -> bool:
    """True if a worker answers; it is over then."""
    talk = WorkerConnection(channel)
    answer = talk.request(CloseSkill(talk.token()), 20.0)
    talk.close()
    return isinstance(answer, SkillClosed)


def ended(zygote: Zygote) -> bool:
    assert zygote._process is not None
    return zygote._process.poll() is not None


def test_a_worker_is_lent_with_its_zygote_and_ended(bare: ZygotePool) -> None:
    zygote, channel = bare.spawn_worker()
    assert serves(channel)
    assert zygote.end_worker() in ENDS
    bare.release(zygote)
    again, channel = bare.spawn_worker()
    assert again is zygote
    channel.close()
    assert again.end_worker() in ENDS
    bare.release(again)


def test_a_busy_worker_is_killed_with_its_exit_code(bare: ZygotePool) -> None:
    zygote, channel = bare.spawn_worker()
    assert zygote._process is not None
    children = Path(f"/proc/{zygote._process.pid}/task/{zygote._process.pid}/children")
    deadline = time.monotonic() + 20.0
    while not children.read_text() and time.monotonic() < deadline:
        time.sleep(0.002)
    assert zygote.end_worker() == -signal.SIGKILL
    assert children.read_text() == ""
    channel.close()
    bare.release(zygote)


def test_two_workers_at_a_time_have_a_zygote_each(bare: ZygotePool) -> None:
    (one, first), (other, second) = bare.spawn_worker(), bare.spawn_worker()
    assert one is not other
    assert serves(second)
    assert serves(first)
    for zygote in (one, other):
        assert zygote.end_worker() in ENDS
        bare.release(zygote)


def test_a_zygote_that_was_killed_has_no_workers(bare: ZygotePool) -> None:
    zygote, channel = bare.spawn_worker()
    zygote.kill()
    zygote.kill()
    assert ended(zygote)
    assert channel.recv(1) == b""
    channel.close()
    with pytest.raises(ZygoteError, match="the zygote was killed, as it did not end its worker"):
        zygote.end_worker()
    with pytest.raises(ZygoteError, match="the zygote is gone"):
        zygote.spawn_worker()


def test_a_zygote_that_died_is_cleaned_up_when_its_worker_is_to_end(bare: ZygotePool) -> None:
    zygote, channel = bare.spawn_worker()
    assert zygote._process is not None
    # Before its worker ends, as it would say so at once.
    os.kill(zygote._process.pid, signal.SIGKILL)
    channel.close()
    with pytest.raises(ZygoteError, match="the zygote was killed"):
        zygote.end_worker()
    assert zygote._process.returncode == -signal.SIGKILL


def test_a_zygote_that_hangs_is_killed(bare: ZygotePool) -> None:
    zygote, channel = bare.spawn_worker()
    channel.close()
    assert zygote._process is not None
    os.kill(zygote._process.pid, signal.SIGSTOP)
    zygote.kill()
    assert zygote._process.returncode == -signal.SIGKILL


def test_an_idle_zygote_that_was_killed_is_replaced(bare: ZygotePool) -> None:
    zygote, channel = bare.spawn_worker()
    assert serves(channel)
    zygote.end_worker()
    assert zygote._process is not None
    os.kill(zygote._process.pid, signal.SIGKILL)
    zygote._process.wait()
    bare.release(zygote)
    other, channel = bare.spawn_worker()
    assert other is not zygote
    assert serves(channel)
    other.end_worker()
    bare.release(other)


def test_a_pool_probes_its_host_once_and_ends_its_zygotes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "find_bubblewrap", lambda: None)
    pool = ZygotePool(["fractions"])
    assert pool.missing.keys() == set(IsolationLayer)
    assert pool.missing[IsolationLayer.RLIMITS] is None
    assert pool.missing[IsolationLayer.BUBBLEWRAP] == "there is no program `bwrap`"
    zygote, channel = pool.spawn_worker()
    channel.close()
    zygote.end_worker()
    pool.release(zygote)
    pool.close()
    assert ended(zygote)
    assert zygote._process is not None
    assert zygote._process.returncode == 0
    pool.close()


class SmallGroup:
    """Control group within one that has half a core: the kernel refuses it more."""

    def __init__(self) -> None:
        self._periods = 0

    def set_limits(self, limits: ProcessLimits, period_us: int = 0) -> None:
        if limits.processor > 0.5:
            raise ControlGroupError("no limits can be set: Invalid argument")

    @contextmanager
    def entrances(self) -> Iterator[list[int]]:
        yield []

    def throttled_periods(self) -> int:
        self._periods += 9
        return self._periods

    def close(self) -> None:
        pass


def test_where_the_usual_limits_cannot_be_set_workers_start_without_groups(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "find_bubblewrap", lambda: None)
    monkeypatch.setattr(module, "ControlGroups", lambda: SimpleNamespace(make=SmallGroup))
    pool = ZygotePool([])
    try:
        assert pool.missing[IsolationLayer.CGROUPS] == "no limits can be set: Invalid argument"
        zygote, channel = pool.spawn_worker()
        assert serves(channel)
        zygote.end_worker()
        pool.release(zygote)
    finally:
        pool.close()


def test_a_bubblewrap_that_does_not_work_is_done_without_and_recorded() -> None:
    pool = ZygotePool([], bubblewrap="/bin/false")
    try:
        why = pool.missing[IsolationLayer.BUBBLEWRAP]
        assert why == "`/bin/false` does not work here: bubblewrap did not report the process that it started"
        zygote, channel = pool.spawn_worker()
        assert serves(channel)
        zygote.end_worker()
        pool.release(zygote)
    finally:
        pool.close()


def test_a_zygote_that_cannot_start_says_why() -> None:
    with pytest.raises(ZygoteError, match=r"No module named 'json\.absent_module'"):
        Zygote(["json.absent_module"], None)
    with pytest.raises(ZygoteError, match="`absent_package` is not installed"):
        Zygote(["absent_package.part"], None)
    with pytest.raises(ZygoteError, match="No such file or directory"):
        Zygote([], "/absent/bwrap")


WRAPPER = """#!{python} -ISE
# Like bubblewrap: says in JSON which process is the first, then runs the command after `--`.
import os, subprocess, sys
with open("{folder}/arguments", "w") as file:
    file.write("\\n".join(sys.argv))
info = int(sys.argv[sys.argv.index("--info-fd") + 1])
first = subprocess.Popen(["sleep", "600"])
os.write(info, b'{{ "child-pid": %d }}' % first.pid)
os.close(info)
command = sys.argv[sys.argv.index("--") + 1 :]
os.execv(command[0], command)
"""


def test_in_namespaces_the_first_process_is_killed_with_the_zygote(tmp_path: Path) -> None:
    wrapper = tmp_path / "bwrap"
    wrapper.write_text(WRAPPER.format(folder=tmp_path, python=sys.executable))
    wrapper.chmod(0o755)
    zygote = Zygote(["numpy"], str(wrapper))
    words = (tmp_path / "arguments").read_text().split()
    for package in ("aeros", "msgspec", "numpy"):
        assert [word for word in words if word.endswith(f"/{package}")], package
    assert [word for word in words if word.endswith("/numpy.libs")]
    first = zygote._first
    assert first is not None
    signal.pidfd_send_signal(first, 0)
    kept = os.dup(first)
    zygote.close()
    assert ended(zygote)
    assert zygote._first is None
    os.set_blocking(kept, False)
    deadline = time.monotonic() + 20.0
    while time.monotonic() < deadline:
        try:
            signal.pidfd_send_signal(kept, 0)
        except ProcessLookupError:
            break
        time.sleep(0.002)
    else:
        pytest.fail("the first process goes on")
    os.close(kept)


def test_a_zygote_without_a_worker_has_no_memory_of_one(nursery: ZygotePool) -> None:
    zygote, channel = nursery.spawn_worker()
    channel.close()
    zygote.end_worker()
    assert zygote.worker_memory() is None
    nursery.release(zygote)
    other = Zygote(("math",), None)
    other.close()
    assert other.worker_memory() is None
