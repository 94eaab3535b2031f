"""The agent's own life: its table, the reports of its changes, and the start of a session after a crash."""

from __future__ import annotations

from pathlib import Path

import networkx as nx
import pytest

from aeros.agent.agent import start_agent
from aeros.agent.errors import AgentError
from aeros.agent.recovery.lifecycle import TRANSITIONS, Lifecycle, LifecycleEvent, Phase
from aeros.spec.diagnostics.errors import InternalError
from tests.unit.agent.fake_runtime import FakeRuntime

Transitions = list[tuple[Phase, LifecycleEvent, Phase]]


def lifecycle(folder: Path) -> tuple[Lifecycle, Transitions]:
    transitions: Transitions = []
    return Lifecycle(folder, lambda *one: transitions.append(one)), transitions


def test_each_phase_is_reached_and_leads_back_to_running() -> None:
    graph = nx.DiGraph((before, after) for (before, _), after in TRANSITIONS.items())
    assert set(graph) == set(Phase)
    assert all(nx.has_path(graph, phase, Phase.RUNNING) for phase in Phase)
    assert nx.descendants(graph, Phase.CREATED) == set(Phase) - {Phase.CREATED}


def test_a_crash_is_recognised_in_every_phase_and_nothing_else_is_a_crash() -> None:
    crashes = {before for (before, change) in TRANSITIONS if change is LifecycleEvent.CRASH}
    assert crashes == {Phase.RUNNING, Phase.PAUSED, Phase.RECOVERED}
    assert all(
        after is Phase.RECOVERED
        for (_, change), after in TRANSITIONS.items()
        if change is LifecycleEvent.CRASH
    )


@pytest.mark.parametrize("phase", Phase)
@pytest.mark.parametrize("change", LifecycleEvent)
def test_a_transition_that_the_table_lacks_is_refused_and_neither_reported_nor_saved(
    tmp_path: Path, phase: Phase, change: LifecycleEvent
) -> None:
    life, transitions = lifecycle(tmp_path)
    life.phase = phase
    if (phase, change) in TRANSITIONS:
        life.apply(change)
        assert transitions == [(phase, change, TRANSITIONS[phase, change])]
    else:
        with pytest.raises(InternalError):
            life.apply(change)
        assert (transitions, life.phase) == ([], phase)
        assert not (tmp_path / "phase.json").exists()


def test_a_session_that_ended_without_a_word_is_found_by_the_next(tmp_path: Path) -> None:
    life, transitions = lifecycle(tmp_path)
    assert life.phase is Phase.CREATED
    life.apply(LifecycleEvent.BEGIN)
    again, transitions = lifecycle(tmp_path)
    assert again.phase is Phase.RECOVERED
    assert transitions == [(Phase.RUNNING, LifecycleEvent.CRASH, Phase.RECOVERED)]
    again.apply(LifecycleEvent.BEGIN)
    again.apply(LifecycleEvent.END)
    last, transitions = lifecycle(tmp_path)
    assert (last.phase, transitions) == (Phase.STOPPED, [])


@pytest.mark.parametrize("text", ["", "{", "[]", '{"phase": "asleep"}'])
def test_a_phase_that_cannot_be_read_counts_as_a_crash(tmp_path: Path, text: str) -> None:
    (tmp_path / "phase.json").write_text(text)
    life, _ = lifecycle(tmp_path)
    assert life.phase is Phase.RECOVERED


def test_a_change_that_cannot_be_reported_does_not_happen(tmp_path: Path) -> None:
    def unable(*_: object) -> None:
        raise AgentError("the record is full")

    life = Lifecycle(tmp_path, unable)
    with pytest.raises(AgentError):
        life.apply(LifecycleEvent.BEGIN)
    assert life.phase is Phase.CREATED
    assert lifecycle(tmp_path)[0].phase is Phase.CREATED


def test_every_transition_of_an_agent_is_in_the_record(tmp_path: Path) -> None:
    runtime = FakeRuntime()
    with start_agent(tmp_path, "chef", runtime) as agent:
        agent.run("dumplings")
    changes = [details["after"] for kind, details in runtime.notes if kind == "lifecycle"]
    assert changes == ["running", "stopped"]
    crashing = FakeRuntime(endings={"prepare": [MemoryError()]})
    with pytest.raises(MemoryError), start_agent(tmp_path, "chef", crashing) as agent:
        agent.run("dumplings")
    after = FakeRuntime()
    with start_agent(tmp_path, "chef", after):
        pass
    (recovered,) = [details for kind, details in after.notes if kind == "lifecycle"]
    assert (recovered["before"], recovered["change"], recovered["after"]) == ("running", "crash", "recovered")


def test_without_a_folder_every_life_is_new_and_nothing_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for _ in range(2):
        life = Lifecycle(None, lambda *_: None)
        phases = [life.phase]
        life.apply(LifecycleEvent.BEGIN)
        assert [*phases, life.phase] == [Phase.CREATED, Phase.RUNNING]
    assert list(tmp_path.iterdir()) == []


def test_a_phase_of_a_newer_version_is_not_guessed(tmp_path: Path) -> None:
    (tmp_path / "phase.json").write_text('{"schema": "aeros/phase/99", "phase": "stopped"}')
    with pytest.raises(AgentError, match="newer AEROS"):
        lifecycle(tmp_path)
