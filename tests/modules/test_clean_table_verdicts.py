"""Verdicts of clean_table: what the floor shows decides how a skill ends, and the words name the place."""

from __future__ import annotations

from typing import Any

import pytest

from aeros.agent.execution.supervisor import StepAssessment, assess_step
from aeros.agent.world.world import world_from_readings
from aeros.runtime.ports import Reading, StepResult, StepStatus
from tests.modules.robot import configuration_of

NOTHING_FOUND = {
    "table_wiped": False,
    "table_organized": False,
    "clutter_on_table": False,
    "wiping_area_clear": True,
    "sponge_seen": False,
    "sponge_overturned": False,
    "sponge_missing": False,
    "rest_blocked": False,
    "clutter_missing": False,
    "clutter_ungraspable": False,
}
SPONGE_FOUND: dict[str, Any] = {"sponge_missing": True, "sponge_floor_position": (0.13, -2.17, -0.3)}
UNGRASPABLE: dict[str, Any] = {"clutter_ungraspable": True, "clutter_ungraspable_position": (0.6, -1.2, 0.06)}
PIECE_FOUND: dict[str, Any] = {"clutter_missing": True, "piece_floor_position": (0.2, -2.0, -0.3)}


def assess(skill: str, status: StepStatus = StepStatus.FINISHED, **measured: Any) -> StepAssessment:
    """Assess a step of clean_table after which this was measured, and otherwise nothing was found."""
    site, module = (
        (configuration := configuration_of("clean_table")).site,
        configuration.modules["clean_table"],
    )
    values = {**NOTHING_FOUND, **measured}
    readings = {f"clean_table.{name}": Reading(value, 1.0) for name, value in values.items()}
    result = StepResult(status, "" if status is StepStatus.FINISHED else "contact")
    return assess_step(
        "clean_table", module.skills[skill], result, world_from_readings(site.state, readings, 1.0)
    )


@pytest.mark.parametrize("skill", ["wipe", "organize", "recover"])
def test_a_sponge_on_the_floor_ends_the_skill_with_its_place(skill: str) -> None:
    found = assess(skill, **SPONGE_FOUND)
    assert (found.outcome, found.failed, found.is_verdict) == ("missing", True, True)
    assert found.reason.startswith("out of reach: the sponge is neither on the table,")
    assert found.reason.endswith("where pictures show it on the floor: (0.13, -2.17, -0.30) m")
    found = assess(skill, sponge_missing=True)
    assert found.is_verdict
    assert found.reason.endswith("where pictures show it on the floor: unknown")


def test_a_piece_on_the_floor_ends_organizing_with_its_place() -> None:
    found = assess("organize", **PIECE_FOUND)
    assert (found.outcome, found.is_verdict) == ("piece_missing", True)
    assert "where it was last seen: unknown; " in found.reason
    assert found.reason.endswith("where pictures show it on the floor: (0.20, -2, -0.30) m")


def test_a_thing_on_the_sponges_rest_that_is_not_tidied_ends_organizing_with_its_place() -> None:
    found = assess("organize", rest_blocked=True, sponge_rest_position=(0.476, -0.88, 0.015))
    assert (found.outcome, found.is_verdict) == ("blocked", True)
    assert "its rest at (0.48, -0.88, 0.01" in found.reason


def test_a_table_on_which_all_clutter_fits_no_hand_ends_organizing_with_its_place() -> None:
    found = assess("organize", clutter_on_table=True, **UNGRASPABLE)
    assert (found.outcome, found.is_verdict) == ("ungraspable", True)
    assert found.reason.startswith("the hand cannot grip what is at (0.60, -1.20, 0.06) m:")


@pytest.mark.parametrize(
    ("skill", "outcome"), [("wipe", "streaky"), ("organize", "left_over"), ("recover", "lost")]
)
def test_a_table_that_lacks_nothing_gives_no_verdict(skill: str, outcome: str) -> None:
    found = assess(skill)
    assert (found.outcome, found.failed, found.is_verdict) == (outcome, True, False)


def test_a_table_of_which_pictures_do_not_show_all_gives_no_verdict() -> None:
    found = assess("wipe", sponge_missing=None)
    assert (found.failed, found.is_verdict) == (True, False)


def test_a_step_that_was_stopped_gives_no_verdict() -> None:
    found = assess("organize", StepStatus.STOPPED, **PIECE_FOUND)
    assert (found.failed, found.is_verdict) == (True, False)


def test_success_counts_although_a_piece_was_on_the_floor_before() -> None:
    assert assess("wipe", table_wiped=True, **PIECE_FOUND).outcome == "wiped"
