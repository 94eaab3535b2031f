"""Once a change returns, nothing that it revokes acts any more, not even actions that were under way.

The plant is slow in real time and shows the monitor a tick every millisecond, as a motion would.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.audit.log import AuditLog
from aeros.runtime.execution.executor import Executor
from aeros.runtime.execution.governor import OperatorCommand
from aeros.runtime.gate.gate import CompiledGate
from aeros.runtime.ports import Monitor, MotionCompletion, MotionHandle, StepRequest, StepResult, StepStatus
from aeros.runtime.registry.control_page import ControlPage
from aeros.runtime.registry.operator_block import OperatorBlock
from aeros.runtime.registry.registry import Registry
from aeros.runtime.registry.registry_governor import RegistryGovernor
from aeros.runtime.registry.store import RegistryStore
from aeros.runtime.skills.in_process_run import run_in_process
from aeros.sim.fake import FakePlant
from aeros.sim.symbolic.state import initial_values
from aeros.spec.diagnostics.errors import UserError
from tests.unit.runtime.registry.conftest import BASE, Author

_PATIENCE = 60.0  # s


class SlowPlant(FakePlant):
    """Moves until it is stopped, or may end, and notes when each tick was."""

    ticked = 0.0
    may_end = False
    moving = threading.Event()

    def advance(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        self._call("advance", until)
        latest = time.monotonic() + _PATIENCE
        self.moving.set()
        while not self.may_end and time.monotonic() < latest:
            rule = monitor(self.time, {})
            if rule is not None or self._halted:
                self._halted.clear()
                return self._end_motions(list(self._ends), MotionCompletion(False, f"monitor:{rule}"))
            self.ticked = time.monotonic()
            time.sleep(0.001)
        return self._end_motions(list(self._ends), MotionCompletion(True))


class Robot:
    """An executor under a registry, with one skill that waits."""

    def __init__(self, registry: Registry, log: Path) -> None:
        self.registry = registry
        configuration, _ = registry.configuration()
        self.governing = RegistryGovernor(registry)
        self.plant = SlowPlant(initial_values(configuration.site, {}))
        self.plant.moving = threading.Event()
        self.audit = AuditLog(log)
        gate = CompiledGate(configuration)
        self.executor = Executor(configuration, gate, self.plant, self.audit, run_in_process, self.governing)
        self.results: list[StepResult] = []

    def begin(self) -> threading.Thread:
        def run() -> None:
            self.results.append(self.executor.run_step(StepRequest("tidy", "rest", {})))

        thread = threading.Thread(target=run)
        thread.start()
        return thread


@pytest.fixture
def robot(registry: Registry, write: Author, tmp_path: Path) -> Iterator[Robot]:
    registry.install(write())
    registry.configure("tidy")
    registry.activate("tidy")
    made = Robot(registry, tmp_path / "audit.jsonl")
    yield made
    made.governing.close()
    made.audit.close()


def _under_way(robot: Robot) -> threading.Thread:
    thread = robot.begin()
    assert robot.plant.moving.wait(_PATIENCE)
    return thread


def _let_ticks_pass(robot: Robot) -> None:
    latest = time.monotonic() + _PATIENCE
    for _ in range(3):
        was = robot.plant.ticked
        while robot.plant.ticked == was and time.monotonic() < latest:
            time.sleep(0.001)


CHANGES = {
    "deactivate": lambda registry: registry.deactivate("tidy"),
    "block the skill": lambda registry: registry.add_block(OperatorBlock("one", "why", "tidy", "rest", None)),
    "block the action": lambda registry: registry.add_block(OperatorBlock("one", "why", None, None, "wait")),
    "another policy": lambda registry: registry.set_policy(_other_policy(registry)),
}


def _other_policy(registry: Registry) -> Path:
    path = registry.folder.parent / "other.yaml"
    path.write_text((BASE / "site.yaml").read_text() + "# another\n")
    return path


@pytest.mark.parametrize("change", CHANGES)
def test_nothing_revoked_moves_after_the_change_returns(robot: Robot, change: str) -> None:
    thread = _under_way(robot)
    CHANGES[change](robot.registry)
    returned = time.monotonic()
    thread.join(_PATIENCE)
    assert robot.plant.ticked < returned
    (result,) = robot.results
    assert result.status is StepStatus.STOPPED
    assert "revoked" in result.reason
    assert [call[0] for call in robot.plant.calls].count("stop") == 1
    assert [call[0] for call in robot.plant.calls].count("skill_ended") == 1
    robot.plant.may_end = True
    again = robot.executor.run_step(StepRequest("tidy", "rest", {}))
    assert (again.status in (StepStatus.REFUSED, StepStatus.DENIED)) == (change != "another policy")


def test_a_change_waits_for_what_an_unfinished_one_left_moving(
    registry: Registry, write: Author, monkeypatch: pytest.MonkeyPatch
) -> None:
    def killed(*_: Any) -> None:
        raise SystemExit

    registry.install(write())
    monkeypatch.setattr("aeros.runtime.registry.transaction._WAIT_TIMEOUT_S", 0.01)
    with ControlPage(registry.folder) as live, live.hold_generation(live.generation):
        with monkeypatch.context() as patched:
            patched.setattr(ControlPage, "wait_until_idle", killed)
            with pytest.raises(SystemExit):
                registry.configure("tidy")
        with pytest.raises(UserError, match="still moves"):
            registry.activate("tidy")


def test_a_change_between_loading_and_the_first_look_is_followed(
    registry: Registry, write: Author, tmp_path: Path
) -> None:
    registry.install(write())
    registry.configure("tidy")
    registry.activate("tidy")
    stale, _ = registry.configuration()
    registry.deactivate("tidy")
    with RegistryGovernor(registry) as governing, AuditLog(tmp_path / "audit.jsonl") as log:
        plant = FakePlant(initial_values(stale.site, {}))
        executor = Executor(stale, CompiledGate(stale), plant, log, run_in_process, governing)
        assert executor.run_step(StepRequest("tidy", "rest", {})).status is StepStatus.REFUSED
        assert executor.active_modules() == {}


def test_unrelated_changes_stop_no_motion(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    """As `aeros run` opens it: nobody asks for the configuration but the executor."""
    thread = _under_way(robot)
    wait = ControlPage.wait_until_idle

    def going_on(live: ControlPage, *given: Any) -> Any:
        _let_ticks_pass(robot)
        robot.plant.may_end = True
        return wait(live, *given)

    # The change waits for what moves, which it may not stop.
    monkeypatch.setattr(ControlPage, "wait_until_idle", going_on)
    robot.registry.add_block(OperatorBlock("one", "why", None, None, "grip"))
    thread.join(_PATIENCE)
    assert robot.results[0].status is StepStatus.FINISHED


def test_a_change_announced_by_one_who_was_killed_before_keeping_it_is_no_change(robot: Robot) -> None:
    before = robot.registry.snapshot()
    with ControlPage(robot.registry.folder) as live:
        live.publish(before.generation + 1)
        thread = _under_way(robot)
        _let_ticks_pass(robot)
        robot.plant.may_end = True
        thread.join(_PATIENCE)
        assert live.generation == before.generation
    assert robot.results[0].status is StepStatus.FINISHED
    robot.registry.deactivate("tidy")
    assert robot.executor.active_modules() == {}


def test_nothing_begins_between_reporting_a_change_and_storing_it(
    robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    replace = RegistryStore.replace
    began: list[bool] = []

    def slow(records: RegistryStore, *given: Any) -> None:
        thread = robot.begin()
        began.append(robot.plant.moving.wait(0.2))
        replace(records, *given)
        thread.join(_PATIENCE)

    monkeypatch.setattr(RegistryStore, "replace", slow)
    robot.registry.deactivate("tidy")
    assert began == [False]
    assert robot.results[0].status is StepStatus.REFUSED


def test_a_recorded_change_that_cannot_be_stored_is_stored_by_a_run(
    robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = RegistryStore.replace

    def full(records: RegistryStore, *_: Any) -> None:
        monkeypatch.setattr(RegistryStore, "replace", store)
        raise records._damaged("no space left")

    thread = _under_way(robot)
    monkeypatch.setattr(RegistryStore, "replace", full)
    with pytest.raises(UserError, match="no space left"):
        robot.registry.deactivate("tidy")
    thread.join(_PATIENCE)
    assert robot.results[0].status is StepStatus.STOPPED
    assert "tidy" not in robot.executor.active_modules()


def test_a_pause_holds_what_would_begin_and_a_stop_ends_what_moves(robot: Robot) -> None:
    with ControlPage(robot.registry.folder) as live:
        live.request_command(OperatorCommand.PAUSE)
        thread = robot.begin()
        assert not robot.plant.moving.wait(0.2)
        live.request_command(OperatorCommand.RUN)
        assert robot.plant.moving.wait(_PATIENCE)
        live.request_command(OperatorCommand.STOP)
        live.wait_until_idle(live.generation, _PATIENCE)
        stopped = time.monotonic()
        thread.join(_PATIENCE)
    assert robot.plant.ticked < stopped
    assert robot.results[0].status is StepStatus.HALTED


def test_a_stop_of_an_earlier_run_is_forgotten_and_a_pause_is_not(registry: Registry) -> None:
    with ControlPage(registry.folder) as live:
        for asked, found in (
            (OperatorCommand.STOP, OperatorCommand.RUN),
            (OperatorCommand.PAUSE, OperatorCommand.PAUSE),
        ):
            live.request_command(asked)
            with RegistryGovernor(registry) as governing:
                assert governing.command is found
