"""Planners get the last values of what is unknown, and modules with the results that were remembered."""

from __future__ import annotations

from pathlib import Path
from uuid import uuid4

import pytest

from aeros.agent.execution.journal import Journal
from aeros.agent.execution.planning_memory import PlanningMemory
from aeros.agent.execution.step_attempt import StepRunner
from aeros.agent.identity import Identity
from aeros.agent.memory import evidence
from aeros.agent.memory.store import EpisodeEnd, EpisodeStart, open_memory
from aeros.runtime.ports import Obstacle
from tests.unit.agent.dumplings import DUMPLING, term
from tests.unit.agent.fake_runtime import FakeRuntime


def test_a_planner_gets_the_last_value_of_what_is_unknown_and_no_condition_reads_it(tmp_path: Path) -> None:
    with open_memory(tmp_path / "memory.sqlite3", Identity(uuid4(), "chef", "", 1)) as memory:
        runtime = FakeRuntime()
        runner = StepRunner(runtime, memory, Journal(runtime, memory, None), "dumpling.make_dumplings")
        assert runner.planning_world().remembered == {}
        del runtime.state["wrapper_aligned"]
        runner.observe()
        world = runner.planning_world()
    assert world.remembered == {"wrapper_aligned": False}
    assert world.evaluate(term("not wrapper_aligned")) is None


def test_modules_have_the_durations_that_were_remembered(tmp_path: Path) -> None:
    with open_memory(tmp_path / "memory.sqlite3", Identity(uuid4(), "chef", "", 1)) as memory:
        start = EpisodeStart("t.t", "dumpling", "boil", "step", {}, 0.0, {}, "{}", DUMPLING.code_digest)
        for seconds in (7.0, 9.0, 30.0):
            ending = EpisodeEnd("finished", "cooked", False, "", seconds, {}, counts_toward_record=True)
            memory.end_episode(memory.start_episode(start), ending)
        modules = PlanningMemory(FakeRuntime(), memory).recall({"dumpling": DUMPLING})
        boil = modules["dumpling"].skills["boil"]
    assert boil.outcomes["cooked"].duration == 9
    assert modules["dumpling"].skills["wrap"] is DUMPLING.skills["wrap"]


def test_a_planner_gets_what_hindered_a_skill_in_earlier_sessions_on_the_same_plant(tmp_path: Path) -> None:
    start = EpisodeStart("t.t", "dumpling", "boil", "step", {}, 0.0, {}, "{}", DUMPLING.code_digest)
    hindered = [{"kind": "gate", "rule": "unknown-object-1"}, {"kind": "outcome", "rule": "dumpling.boil"}]
    for plant in ("physics", "physics", "kinematic"):
        with open_memory(tmp_path / "m.sqlite3", Identity(uuid4(), "chef", "", 1), plant) as memory:
            ending = EpisodeEnd("denied", None, True, "", 7.0, {}, counts_toward_record=True, causes=hindered)
            memory.end_episode(memory.start_episode(start), ending)
    with open_memory(tmp_path / "m.sqlite3", Identity(uuid4(), "chef", "", 1), "physics") as memory:
        runtime = FakeRuntime()
        runner = StepRunner(runtime, memory, Journal(runtime, memory, None), "dumpling.make_dumplings")
        world = runner.planning_world()
    assert world.hindrances == {"dumpling.boil": [{"kind": "gate", "name": "unknown-object-1", "times": 2}]}


def test_a_planner_gets_the_hindrances_of_the_latest_steps(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(evidence, "MAX_HINDERED_STEPS", 2)
    start = EpisodeStart("t.t", "dumpling", "boil", "step", {}, 0.0, {}, "{}", DUMPLING.code_digest)
    with open_memory(tmp_path / "m.sqlite3", Identity(uuid4(), "chef", "", 1)) as memory:
        for rule in ("separation", "separation", "tool-speed"):
            causes = [{"kind": kind, "rule": rule} for kind in ("rule", "unknown-outcome")]
            ending = EpisodeEnd("denied", None, True, "", 7.0, {}, counts_toward_record=True, causes=causes)
            memory.end_episode(memory.start_episode(start), ending)
        found = memory.hindrances()
    assert found == {"dumpling.boil": [("rule", "tool-speed", 1), ("rule", "separation", 1)]}


def test_a_module_that_is_not_active_is_not_recalled(tmp_path: Path) -> None:
    with open_memory(tmp_path / "memory.sqlite3", Identity(uuid4(), "chef", "", 1)) as memory:
        modules = PlanningMemory(FakeRuntime(), memory).recall({"dumpling": DUMPLING})
        with pytest.raises(KeyError):
            modules["fetch"]


def test_obstacles_are_remembered_until_their_place_is_seen_free(tmp_path: Path) -> None:
    with open_memory(tmp_path / "memory.sqlite3", Identity(uuid4(), "chef", "", 1)) as memory:
        runtime = FakeRuntime()
        planning, runner = (
            PlanningMemory(runtime, memory),
            StepRunner(runtime, memory, Journal(runtime, memory, None), "dumpling.make_dumplings"),
        )
        box = Obstacle("unknown-object-1", (0.3, -0.1, 0.0), (0.4, 0.1, 0.25), 3.5, "overhead", "bench")
        runtime.obstructing = [box]
        planning.note(runner.observe())
        seen = memory.remembered_values()["unknown-object-1"]
        assert seen.value == "at (0.35, 0.00) m in bench, 100 x 200 x 250 mm"
        assert seen.source == "camera overhead"
        runtime.obstructing = []
        planning.note(runner.observe())
        assert memory.remembered_values()["unknown-object-1"].value == "gone: its place was seen free"
