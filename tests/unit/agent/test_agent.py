"""An agent awake: its records, its memory, and what a session finds of the one before."""

from __future__ import annotations

import dataclasses
import json
import sqlite3
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from aeros.agent.agent import open_temporary_agent, start_agent
from aeros.agent.errors import AgentError
from aeros.agent.execution.journal import AgentEvent
from aeros.agent.execution.report import RunReport
from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.planning.base import Planner, RulePlanner
from aeros.runtime.ports import Runtime
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import EnumType
from aeros.spec.model.task_parameters import TaskParameter
from aeros.spec.model.variables import Declared
from tests.unit.agent.dumplings import DUMPLING, MAKE_DUMPLINGS, SPAN
from tests.unit.agent.fake_runtime import FakeRuntime


def run(folder: Path, runtime: Runtime, planner: Planner | None = None) -> RunReport:
    with start_agent(folder, "chef", runtime, planner) as agent:
        return agent.run("Make dumplings!")


def test_a_step_under_way_when_the_last_agent_was_killed_is_reported(tmp_path: Path) -> None:
    run(tmp_path, FakeRuntime())
    with closing(sqlite3.connect(tmp_path / "memory.sqlite3")) as database, database:
        database.execute("UPDATE episodes SET status = NULL WHERE skill = 'wrap'")
    runtime = FakeRuntime()
    with start_agent(tmp_path, "chef", runtime) as agent:
        assert agent.identity.sessions == 2
    assert runtime.notes == [("step-interrupted", {"skill": "dumpling.wrap"})]


def test_everything_is_noted_remembered_and_observed(tmp_path: Path) -> None:
    runtime = FakeRuntime(endings={"wrap": ["misaligned"] * 3})
    seen: list[AgentEvent] = []
    with start_agent(tmp_path, "chef", runtime, on_event=seen.append) as agent:
        report = agent.run("dumplings")
    assert [event.kind for event in seen] == runtime.kinds()
    assert runtime.kinds()[:3] == ["task-selected", "lifecycle", "plan-accepted"]
    assert runtime.kinds()[-2:] == ["lifecycle", "run-ended"]
    assert runtime.kinds().count("step-started") == runtime.kinds().count("step-ended") == len(report.steps)
    json.dumps(runtime.notes, allow_nan=False)
    with closing(sqlite3.connect(tmp_path / "memory.sqlite3")) as database:
        rows = database.execute(
            "SELECT skill, status, outcome, failed, before, after FROM episodes"
        ).fetchall()
        events = [kind for (kind,) in database.execute("SELECT kind FROM events")]
    assert [row[0] for row in rows] == runtime.submitted
    assert rows[0][1:4] == ("finished", "prepared", 0)
    assert json.loads(rows[0][4])["dough_on_workspace"] is False
    assert json.loads(rows[0][5])["dough_on_workspace"] is True
    assert events == [kind for kind in runtime.kinds() if kind not in ("step-started", "step-ended")]


def test_an_agent_awake_once_remembers_until_then_and_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for _ in range(2):
        seen: list[AgentEvent] = []
        runtime = FakeRuntime(endings={"wrap": ["misaligned"]})
        with open_temporary_agent("chef", runtime, on_event=seen.append) as agent:
            assert agent.run("dumplings").reached
        failures = [
            event.details["failures"]
            for event in seen
            if event.kind == "step-started" and event.details["skill"].endswith(".wrap")
        ]
        assert failures == [0, 1]
    assert not list(tmp_path.iterdir())


def test_an_unroutable_instruction_is_noted_and_raised(tmp_path: Path) -> None:
    runtime = FakeRuntime()
    with start_agent(tmp_path, "chef", runtime) as agent, pytest.raises(InstructionError):
        agent.run("fly to the moon")
    assert runtime.kinds() == ["task-not-found"]


def test_an_interrupt_leaves_memory_and_lock_whole(tmp_path: Path) -> None:
    runtime = FakeRuntime(endings={"wrap": [KeyboardInterrupt()]})
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path, runtime)
    assert runtime.kinds()[-1] == "run-interrupted"
    with closing(sqlite3.connect(tmp_path / "memory.sqlite3")) as database:
        statuses = [status for (status,) in database.execute("SELECT status FROM episodes ORDER BY id")]
        (ended,) = database.execute("SELECT ended FROM sessions").fetchone()
    assert statuses == ["finished", "finished", "interrupted"]
    assert ended is not None
    assert run(tmp_path, runtime).reached


def test_an_audit_that_cannot_be_written_ends_the_run_before_motion(tmp_path: Path) -> None:
    class NoAudit(FakeRuntime):
        def note(self, event: str, details: Mapping[str, Any]) -> None:
            if event == "step-started":
                raise OSError("disk full")

    runtime = NoAudit()
    with pytest.raises(OSError, match="disk full"):
        run(tmp_path, runtime)
    assert runtime.submitted == []


def test_a_damaged_memory_is_a_reason_and_no_agent(tmp_path: Path) -> None:
    (tmp_path / "memory.sqlite3").write_bytes(b"not a database at all" * 100)
    with pytest.raises(AgentError, match="damaged"):
        run(tmp_path, FakeRuntime())


def test_a_run_by_rules_attends_to_its_own_modules_and_then_to_all() -> None:
    runtime = FakeRuntime()
    with open_temporary_agent("chef", runtime, None) as agent:
        agent.run("Make dumplings!")
    assert runtime.attended == [frozenset({"dumpling"}), None]


def test_a_run_by_another_planner_attends_to_all_modules(tmp_path: Path) -> None:
    class Guessing:
        name = "guessing"

        def plan(self, *given: Any) -> Any:
            return RulePlanner().plan(*given)

    runtime = FakeRuntime()
    run(tmp_path, runtime, Guessing())
    assert runtime.attended == [None, None]


def test_the_parameters_of_each_request_are_set_before_it_and_cleared_at_the_end() -> None:
    side = EnumType("dumpling.side", ("left", "right"))
    declared = Declared(t.Variable("dumpling.side", side, t.VariableRole.STATE), SPAN)
    phrases = {"left": ("left side",), "right": ("right side",)}
    parameter = TaskParameter("side", declared, "left", phrases)
    task = dataclasses.replace(MAKE_DUMPLINGS, parameters={"side": parameter})
    ecm = dataclasses.replace(DUMPLING, tasks={task.id: task})
    runtime = FakeRuntime({"dumpling": ecm})
    with open_temporary_agent("chef", runtime, None) as agent:
        agent.run("make dumplings, then make dumplings right side")
    assert runtime.parameters == [{"dumpling.side": "left"}, {"dumpling.side": "right"}, {}]


def test_memories_are_set_before_each_request_and_cleared_at_the_end() -> None:
    runtime = FakeRuntime()
    with open_temporary_agent("chef", runtime, None) as agent:
        agent.run("make dumplings")
    assert runtime.memories == [{}, {}]
