"""The plant's own log after kills: repeated skills, motion without an agent, and torn lines."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from aeros.experiments.trials.kill_logs import PLANTS, motion_without_agent, read_whole_lines, repeated_skills
from tests.unit.experiments.trials.plant_log import BOILED, COOKED, MODULES, WRAPPED, log_line


def test_a_skill_that_begins_while_its_success_is_measured_is_repeated() -> None:
    assert repeated_skills(BOILED, MODULES) == []
    assert repeated_skills([*BOILED, log_line("skill-began", cooked=False)], MODULES) == []
    (found,) = repeated_skills([*BOILED, log_line("skill-began", at=7.0, cooked=True)], MODULES)
    assert found.startswith("once: make_dumplings.boil at 7.00 s")


@pytest.mark.parametrize(
    ("log", "message"),
    [
        ([log_line("agent-disconnected", joint_velocity=[0.1] + [0.0] * 6)], "a joint moved at 0.1000 rad/s"),
        (
            [log_line("agent-disconnected"), log_line("agent-connected", at=1.5)],
            "time went on without an agent",
        ),
        ([log_line("agent-disconnected"), log_line("skill-began")], "time went on without an agent"),
        (
            [log_line("agent-disconnected"), log_line("agent-connected", joint_position=[0.2] + [0.0] * 6)],
            "moved by 0.2 rad",
        ),
    ],
)
def test_motion_without_an_agent_is_found(log: list[dict[str, Any]], message: str) -> None:
    (found,) = motion_without_agent(log, "symbolic")
    assert message in found
    assert (
        motion_without_agent([log_line("agent-disconnected"), log_line("agent-connected")], "symbolic") == []
    )


def test_a_skill_that_did_not_finish_or_succeed_may_begin_again() -> None:
    began, again = log_line("skill-began", cooked=False), log_line("skill-began", cooked=True)
    unfinished = {**log_line("skill-ended", cooked=True), "finished": False}
    assert repeated_skills([began, unfinished, again], MODULES) == []
    failed = log_line("skill-ended", cooked=False)
    assert repeated_skills([began, failed, again], MODULES) == []


def test_every_success_that_still_holds_is_named() -> None:
    once_more = log_line("skill-began", at=9.0, cooked=True)
    found = repeated_skills([*BOILED, once_more, once_more], MODULES)
    assert found == [f"once: make_dumplings.boil at 9.00 s, though {COOKED}"] * 2


def test_another_one_of_a_count_is_no_repetition() -> None:
    count = "make_dumplings.dumplings_cooked"
    second = log_line("skill-began", at=9.0, **{**WRAPPED, count: 1})
    boiled = log_line("skill-ended", at=10.0, **{**COOKED, count: 2})
    assert repeated_skills([*BOILED, second, boiled], MODULES) == []
    third = log_line("skill-began", at=11.0, **{**COOKED, count: 2})
    assert len(repeated_skills([*BOILED, second, boiled, third], MODULES)) == 1


def test_a_helper_may_run_again_after_a_failure() -> None:
    helper = "make_dumplings.recover"
    effects = MODULES["make_dumplings"].skills["recover"].success_outcomes[0].effects
    helped = [
        log_line("skill-began", skill=helper),
        log_line("skill-ended", skill=helper, **effects),
    ]
    again = log_line("skill-began", skill=helper, **effects)
    failed = log_line("skill-ended", skill="make_dumplings.wrap", **effects)
    assert len(repeated_skills([*helped, again], MODULES)) == 1
    assert repeated_skills([*helped, failed, again], MODULES) == []


def test_other_events_are_passed_over() -> None:
    assert repeated_skills([log_line("agent-disconnected"), log_line("agent-connected")], MODULES) == []
    assert (
        motion_without_agent([log_line("agent-connected"), log_line("skill-began", at=2.0)], "symbolic") == []
    )
    assert motion_without_agent([], "physics") == []


@pytest.mark.parametrize(
    ("plant", "speed", "way", "count"),
    [
        ("physics", 0.02, 1e-9, 0),
        ("physics", -0.021, 0.0, 1),
        ("physics", 0.0, 2e-9, 1),
        ("kinematic", 0.001, 0.0, 1),
        ("symbolic", 0.0, 1e-12, 1),
        ("symbolic", 0.1, 0.1, 2),
    ],
)
def test_physics_holds_an_arm_nearly_still_and_others_exactly(
    plant: str, speed: float, way: float, count: int
) -> None:
    gone = log_line("agent-disconnected", joint_velocity=[speed] + [0.0] * 6)
    back = log_line("agent-connected", joint_position=[way] + [0.0] * 6)
    assert len(motion_without_agent([gone, back], plant)) == count


def test_an_agent_that_does_not_come_back_leaves_nothing_to_compare() -> None:
    assert motion_without_agent([log_line("agent-disconnected")], "symbolic") == []


def test_plants_are_named() -> None:
    assert PLANTS == ("symbolic", "kinematic", "physics")


@pytest.mark.parametrize("torn", ['{"event": "b"', '{"event": "b", "measured": {}', '{"event": "b"}'])
def test_a_torn_last_line_is_left_out(tmp_path: Path, torn: str) -> None:
    (tmp_path / "log").write_text('{"event": "a"}\n' + torn)
    assert read_whole_lines(tmp_path / "log") == [{"event": "a"}]


def test_a_log_that_is_not_there_has_no_lines(tmp_path: Path) -> None:
    assert read_whole_lines(tmp_path / "log") == []
    (tmp_path / "log").touch()
    assert read_whole_lines(tmp_path / "log") == []
