"""Evidence is read from the episodes of the same plant, code and context, and weighed by age."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from aeros.agent.memory.evidence import DurationStats
from aeros.agent.memory.posterior import FORGETTING, RecentRecord, SuccessRecord
from aeros.agent.memory.store import EpisodeEnd, open_memory
from tests.unit.agent.memory.test_store import STEP, WHO, remember


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "memory.sqlite3"


def test_results_and_durations_of_another_plant_or_other_code_are_no_evidence(path: Path) -> None:
    with open_memory(path, WHO, "symbolic") as memory:
        remember(memory, seconds=3.0)
        remember(memory, failed=True)
        wrap = ("dumpling", "wrap")
        assert memory.recent_records({wrap: "here"})[wrap] == RecentRecord(FORGETTING, 1.0)
        assert memory.typical_duration(*wrap, "1") is None
    with open_memory(path, WHO, "physics") as memory:
        assert memory.success_record(*wrap) == SuccessRecord(0, 0)
        assert memory.recent_records({wrap: "here"})[wrap] == RecentRecord()
        assert memory.typical_duration(*wrap) is None
    with open_memory(path, WHO, "symbolic") as memory:
        assert memory.success_record(*wrap) == SuccessRecord(1, 1)
        assert memory.typical_duration(*wrap) is not None


def test_only_tries_of_the_skills_to_choose_from_make_a_try_older(path: Path) -> None:
    with open_memory(path, WHO) as memory:
        remember(memory)
        for context, skill in (("here", "fold"), ("there", "wrap"), ("here", "boil")):
            start = replace(STEP, context=context, skill=skill)
            memory.end_episode(
                memory.start_episode(start), EpisodeEnd("finished", None, True, "", 2.0, {}, True)
            )
        wrap, fold = ("dumpling", "wrap"), ("dumpling", "fold")
        assert memory.recent_records({wrap: "here"}) == {wrap: RecentRecord(1.0, 0.0)}
        both = memory.recent_records({wrap: "here", fold: "here"})
        assert both == {wrap: RecentRecord(FORGETTING, 0.0), fold: RecentRecord(0.0, 1.0)}


def test_a_context_in_any_state_stands_for_all_of_a_task_with_the_code(path: Path) -> None:
    with open_memory(path, WHO) as memory:
        for task, code, seen in (("t", "1", True), ("t", "1 2", False), ("t", "2", True), ("u", "1", True)):
            where = json.dumps({"task": task, "code": code, "predicates": {"seen": seen}}, sort_keys=True)
            episode = memory.start_episode(replace(STEP, context=where))
            memory.end_episode(episode, EpisodeEnd("finished", None, False, "", 2.0, {}, True))
        remember(memory)  # its context is no JSON
        wrap, any_state = ("dumpling", "wrap"), json.dumps({"task": "t", "code": "1"})
        assert memory.success_record(*wrap, any_state) == SuccessRecord(2, 0)
        assert memory.recent_records({wrap: any_state})[wrap] == RecentRecord(1 + FORGETTING, 0.0)
        assert memory.success_record(*wrap, json.dumps({"task": "t", "code": "3"})) == SuccessRecord(0, 0)


def test_results_are_counted_until_an_episode(path: Path) -> None:
    with open_memory(path, WHO) as memory:
        remember(memory, failed=True)
        before = memory.latest_episode()
        remember(memory)
        remember(memory)
        assert memory.success_record("dumpling", "wrap", None, before) == SuccessRecord(0, 1)
        assert memory.success_record("dumpling", "wrap") == SuccessRecord(2, 1)
        code = STEP.code
        assert [one.failed for one in memory.experience("dumpling", "wrap", code, before)] == [True]
        assert len(memory.experience("dumpling", "wrap", code)) == 3


def test_the_latest_successes_say_it(path: Path) -> None:
    with open_memory(path, WHO) as memory:
        for seconds in [9.0] * 20 + [2.0] * 101:
            remember(memory, seconds=seconds)
        assert memory.typical_duration("dumpling", "wrap") == DurationStats(2.0, 2.0, 2.0, 101)


def test_successes_say_how_long_a_skill_takes(path: Path) -> None:
    with open_memory(path, WHO) as memory:
        assert memory.typical_duration("dumpling", "wrap") is None
        remember(memory, seconds=3.0)
        assert str(memory.typical_duration("dumpling", "wrap")) == "3.0 s"
        for seconds in (1.0, 2.0, 4.0, 5.0):
            remember(memory, seconds=seconds)
        remember(memory, failed=True, seconds=60.0)
        remember(memory, counts=False, seconds=60.0)
        assert memory.typical_duration("dumpling", "wrap") == DurationStats(3.0, 2.0, 4.0, 5)
        assert str(memory.typical_duration("dumpling", "wrap")) == "3.0 s (half in 2.0 to 4.0 s)"


def test_a_choice_counts_with_how_long_it_takes_now_and_in_this_context(path: Path) -> None:
    asked = ("dumpling", "wrap", STEP.code)
    with open_memory(path, WHO, "symbolic") as memory:
        assert memory.recent_duration(*asked, "here") is None
        for context, seconds in [("there", 9.0)] * 10 + [("here", 2.0)] * 3:
            episode = memory.start_episode(replace(STEP, context=context, started=0.0))
            memory.end_episode(episode, EpisodeEnd("finished", None, False, "", seconds, {}, True))
        assert memory.recent_duration(*asked, "here") == 2.0
        assert memory.recent_duration(*asked, "there") == 9.0
        assert memory.recent_duration(*asked, "elsewhere") == 9.0
        assert memory.recent_duration("dumpling", "wrap", "other code", "here") is None
    with open_memory(path, WHO, "physics") as memory:
        assert memory.recent_duration(*asked, "here") is None
