"""Thinking beside the plant: bounded, charged by the second, gone with all it started, never in the way."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from itertools import count
from math import inf
from pathlib import Path
from typing import Any

import pytest

from aeros.agent.planning.strong_cyclic import NoPlanError
from aeros.agent.planning.time_limited import (
    MAX_ANSWER_BYTES,
    MAX_MEMORY_BYTES,
    PlannerProcess,
    PlannerProcessError,
    PlanningTimeoutError,
    planner_failure,
)
from aeros.runtime.audit.log import AuditLog
from aeros.runtime.execution.executor import Executor
from aeros.runtime.execution.governor import FixedGovernor
from aeros.runtime.gate.configuration import make_configuration
from aeros.runtime.gate.gate import CompiledGate, GateMode
from aeros.runtime.perception.open_perceiver import open_in_process
from aeros.runtime.perception.perceiving_plant import PerceivingPlant
from aeros.runtime.ports import EndedStep, Monitor, MotionCompletion, MotionHandle, StepRequest, StepStatus
from aeros.runtime.skills.in_process_run import run_in_process
from aeros.sim.kinematic.plant import KinematicPlant
from aeros.sim.kinematic.scenes.declared_scene import DeclaredScene
from aeros.spec.verification.certificate import certificate_for
from tests.differential.planning.test_prediction import Unwritten
from tests.differential.reference_cases import reference
from tests.shipped_scenes import shipped_scene
from tests.unit.agent.fake_runtime import FakeRuntime

FOREVER = 1000.0


def by_the_second() -> Callable[[], float]:
    """A clock on which a second goes by each time that somebody looks."""
    ticks = count()
    return lambda: float(next(ticks))


def test_an_answer_that_comes_at_once_costs_no_time() -> None:
    runtime, answer = FakeRuntime(), {"plan": [1, "two", None]}
    assert PlannerProcess(runtime, timeout_s=FOREVER, seconds=lambda: 0.9)(lambda: answer) == answer
    assert runtime.clock == 100.0


def test_whole_seconds_of_thinking_pass_on_the_plants_clock() -> None:
    seen: list[float] = []

    class Seen(FakeRuntime):
        def wait(self, until: float = inf) -> EndedStep | None:
            seen.append(until)
            return super().wait(until)

    with pytest.raises(PlanningTimeoutError, match=r"there was no plan within 3\.5 s"):
        PlannerProcess(Seen(), timeout_s=3.5, seconds=by_the_second())(lambda: time.sleep(FOREVER))
    assert seen == [101.0, 102.0, 103.0, 103.5]


def test_no_longer_than_the_task_may_take_is_waited() -> None:
    runtime = FakeRuntime()
    with pytest.raises(PlanningTimeoutError):
        PlannerProcess(runtime, timeout_s=FOREVER, deadline=102.0, seconds=by_the_second())(
            lambda: time.sleep(FOREVER)
        )
    assert runtime.clock == 102.0


def spins() -> None:
    while True:
        pass


def starts_another(pid_file: Path) -> None:
    with subprocess.Popen(["sleep", "1000"]) as other:
        pid_file.write_text(str(other.pid))


@pytest.mark.parametrize("thinks", [lambda _: spins(), lambda _: time.sleep(FOREVER), starts_another])
def test_a_late_planner_is_killed_with_all_its_children(
    thinks: Callable[[Path], None], tmp_path: Path
) -> None:
    pid_file = tmp_path / "pid"

    def think() -> None:
        pid_file.write_text(str(os.getpid()))
        thinks(pid_file)

    with pytest.raises(PlanningTimeoutError):
        PlannerProcess(FakeRuntime(), timeout_s=0.5)(think)
    assert is_gone(int(pid_file.read_text()))


def is_gone(pid: int) -> bool:
    """Check that the process has ended, or does not run any more, within 5 s."""
    for _ in range(250):
        try:
            state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
        except (FileNotFoundError, ProcessLookupError):
            return True
        if state == "Z":
            return True
        time.sleep(0.02)
    return False


def uses_all_memory() -> int:
    return len(bytearray(2 * MAX_MEMORY_BYTES))


def raises() -> None:
    raise LookupError("no such\nthing")


@pytest.mark.parametrize(
    ("think", "message"),
    [
        (raises, "LookupError: no such thing"),
        (lambda: sys.exit("enough"), "SystemExit: enough"),
        (lambda: os._exit(3), "its process ended without an answer"),
        (lambda: os.kill(os.getpid(), signal.SIGKILL), "its process ended without an answer"),
        (uses_all_memory, "MemoryError"),
        (lambda: "x" * MAX_ANSWER_BYTES, f"its answer is longer than {MAX_ANSWER_BYTES} bytes"),
        (object, "TypeError: Object of type object is not JSON serializable"),
    ],
)
def test_every_abort_of_planning_is_reported(think: Callable[[], Any], message: str) -> None:
    with pytest.raises(PlannerProcessError) as failure:
        PlannerProcess(FakeRuntime(), timeout_s=FOREVER)(think)
    assert str(failure.value).startswith(message)


def test_the_planner_process_has_no_terminal(capfd: pytest.CaptureFixture[str]) -> None:
    def speaks() -> str:
        os.write(1, b"said")
        os.write(2, b"said")
        return os.read(0, 10).decode()

    assert PlannerProcess(FakeRuntime(), timeout_s=FOREVER)(speaks) == ""
    assert capfd.readouterr() == ("", "")


def test_the_planner_process_ends_with_the_agent(tmp_path: Path) -> None:
    pid_file = tmp_path / "pid"
    agent = subprocess.Popen([sys.executable, "-c", AGENT, str(pid_file)])
    while not (pid_file.exists() and pid_file.read_text()):
        time.sleep(0.02)
    agent.kill()
    agent.wait()
    assert is_gone(int(pid_file.read_text()))


AGENT = """
import os, pathlib, sys, time
from aeros.agent.planning.time_limited import PlannerProcess
from tests.unit.agent.fake_runtime import FakeRuntime
from tests.shipped_scenes import shipped_scene
def think():
    pathlib.Path(sys.argv[1]).write_text(str(os.getpid()))
    time.sleep(1000)
PlannerProcess(FakeRuntime(), timeout_s=1000)(think)
"""


class Visited(KinematicPlant):
    """Somebody is 5 cm away from some time on.

    comes: when, plant seconds.
    seen: at which tick that is measured first; stopped: at which the monitor had everything stopped.
    """

    comes = 2.25
    tick = 0
    seen: int | None = None
    stopped: int | None = None

    def advance(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        def watched(now: float, measured: Mapping[str, Any]) -> str | None:
            self.tick += 1
            if now < self.comes:
                return monitor(now, measured)
            self.seen = self.seen or self.tick
            rule = monitor(now, {**measured, "human_distance": 0.05})
            if rule is not None:
                self.stopped = self.stopped or self.tick
            return rule

        return super().advance(watched, until)


@pytest.fixture
def busy() -> Iterator[tuple[Executor, Visited]]:
    """A robot that moves on behalf of somebody else."""
    case = reference("make_dumplings", 10)
    configuration = make_configuration(
        case.site, {case.ecm.id: (case.ecm, certificate_for(case.ecm, case.site, {}))}
    )
    log: AuditLog = Unwritten()
    assert case.task.scene is not None
    plant = Visited(DeclaredScene(shipped_scene(case.task.scene)), 0)
    perceiving = PerceivingPlant(plant, FixedGovernor(configuration), open_in_process, lambda *_: None)
    with Executor(
        configuration, CompiledGate(configuration, GateMode.COMPILED), perceiving, log, run_in_process
    ) as one:
        one.start(StepRequest(case.ecm.id, "prepare", {}))
        yield one, plant


def test_a_protective_stop_comes_in_the_tick_of_the_violation_while_a_planner_sleeps(
    busy: tuple[Executor, Visited],
) -> None:
    executor, plant = busy
    with pytest.raises(PlanningTimeoutError):
        PlannerProcess(executor, timeout_s=5.0, seconds=by_the_second())(lambda: time.sleep(10.0))
    assert plant.seen is not None
    assert plant.stopped == plant.seen
    assert plant.now() == 5.0


def test_without_anybody_who_thinks_it_comes_as_early(busy: tuple[Executor, Visited]) -> None:
    executor, plant = busy
    ended = executor.wait(5.0)
    assert ended is not None
    assert ended.result.status is StepStatus.STOPPED
    assert plant.stopped == plant.seen is not None


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (NoPlanError("goal out of reach"), "goal out of reach"),
        (NoPlanError(""), "NoPlanError"),
        (ValueError("bad: worse"), "ValueError: bad: worse"),
    ],
)
def test_a_failure_says_a_reason_also_if_the_planner_gives_none(error: Exception, reason: str) -> None:
    assert planner_failure(error) == reason
