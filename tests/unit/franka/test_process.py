import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from aeros.franka.plant import PROCESS
from aeros.franka.process import run
from aeros.wired_arm.link import event
from aeros.wired_arm.process import Process, ProcessError
from tests.unit.franka.stub.arms import SETTINGS, Ends, import_stub, use_stub

ARM = {
    "address": "stub",
    "real_time": False,
    "torques": SETTINGS.torques,
    "forces": SETTINGS.forces,
    "acceleration": [10.0] * 7,
    "jerk": [5000.0] * 7,
    "patience": 0.5,
    "start_tolerance": 0.003,
}


@contextmanager
def opened(part: str) -> Iterator[Process]:
    process = Process(part, ARM, PROCESS)
    try:
        yield process
    finally:
        process.close()


def test_a_process_reads_the_robot_and_ends_when_it_is_closed(monkeypatch: pytest.MonkeyPatch) -> None:
    use_stub(monkeypatch)
    with opened("arm") as process:
        process.link.send(event("read"))
        assert process.link.receive(5.0) is not None
        assert process.pid > 0
    process.close()


@pytest.mark.parametrize("part", ["arm", "hand"])
def test_requests_to_end_are_ignored(monkeypatch: pytest.MonkeyPatch, part: str) -> None:
    use_stub(monkeypatch)
    with opened(part) as process:
        assert os.getsid(process.pid) == process.pid  # Ctrl-C goes to the process group of the terminal
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            os.kill(process.pid, number)
        process.link.send(event("read"))
        assert process.link.receive(5.0) is not None


def test_a_robot_that_cannot_be_reached_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    use_stub(monkeypatch, refuses="libfranka: Connection timeout")
    with pytest.raises(
        ProcessError, match="the hand at `stub` cannot be reached: libfranka: Connection timeout"
    ):
        Process("hand", ARM, PROCESS)


def test_an_arm_without_the_library_is_reported(monkeypatch: pytest.MonkeyPatch, ends: Ends) -> None:
    monkeypatch.setitem(sys.modules, "pylibfranka", None)
    run({"part": "arm", **ARM}, ends[1])
    message = ends[0].receive()
    assert isinstance(message, dict)
    assert message["is"] == "failed"
    assert "pip install '.[franka]'" in message["reason"]


def test_a_computer_without_real_time_is_answered_with_a_cure(
    monkeypatch: pytest.MonkeyPatch, ends: Ends
) -> None:
    import_stub(monkeypatch)

    def refuse(*_: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr("os.sched_setscheduler", refuse)
    run({"part": "arm", **ARM, "real_time": True}, ends[1])
    message = ends[0].receive()
    assert isinstance(message, dict)
    assert "real-time priority 80: Operation not permitted" in message["reason"]
    assert "docs/how-to/real-franka.md" in message["reason"]


def test_the_processes_that_drive_the_robot_decide_nothing() -> None:
    loaded = "print('\\n'.join(name for name in sys.modules if name.startswith(('aeros.', 'numpy', 'z3'))))"
    code = f"import sys, aeros.franka.process; {loaded}"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    others = {one for one in done.stdout.split() if not one.startswith(("aeros.franka", "aeros.wired_arm"))}
    assert others == {"aeros.distribution"}
    assert not any(one in done.stdout for one in ("plant", "planner", "measurements"))
