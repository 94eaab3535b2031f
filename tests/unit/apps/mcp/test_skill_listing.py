"""Tasks, skills and measurements as clients read them."""

from __future__ import annotations

from aeros.agent.world.world import world_from_readings
from aeros.apps.mcp.skill_listing import list_skills, list_tasks, world_to_json
from aeros.runtime.ports import Reading
from tests.unit.agent.dumplings import DUMPLING, site
from tests.unit.apps.mcp.cells import dumplings


def test_a_task_has_a_goal_words_and_parameters() -> None:
    (task,) = list_tasks(dumplings().modules)
    assert (task["name"], task["goal"]) == ("make_dumplings.make_dumplings", "dumplings_cooked >= count")
    assert task["parameters"]["count"] == {"type": "int", "unit": "1", "range": [1.0, 2.0]}
    assert task["words"][0] == "make"
    assert len(task["words"]) == 8


def test_a_skill_has_a_precondition_and_outcomes() -> None:
    found = {one["skill"]: one for one in list_skills(DUMPLING)}
    assert list(found) == [f"dumpling.{name}" for name in DUMPLING.skills]
    assert all(one["outcomes"] for one in found.values())


def test_a_measurement_has_an_age_or_a_reason_why_there_is_none() -> None:
    state = site().state
    known, *unknown = state
    found = world_to_json(world_from_readings(state, {known: Reading(True, 4.0)}, 5.0))
    assert found[known] == {"value": True, "age": 1.0}
    assert set(found[unknown[0]]) == {"value", "unknown"}
    assert set(found) == set(state)
