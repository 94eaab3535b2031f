"""Ends of goals, from the numbers that a controller sends."""

from __future__ import annotations

import pytest

from aeros.ros2_control.controller import GoalState, end_of_goal


@pytest.mark.parametrize("state", GoalState)
def test_every_state_but_the_first_is_the_end(state: GoalState) -> None:
    assert state.is_over is (state is not GoalState.ACCEPTED)


@pytest.mark.parametrize(
    ("status", "code", "text", "end"),
    [
        (4, 0, "Goal successfully reached!", (GoalState.SUCCEEDED, "")),
        (4, -5, "", (GoalState.FAILED, "goal tolerance violated")),
        (6, -4, "Aborted", (GoalState.FAILED, "path tolerance violated: Aborted")),
        (6, 0, "", (GoalState.FAILED, "successful")),
        (6, -1, "preempted", (GoalState.PREEMPTED, "invalid goal: preempted")),
        (5, 0, "", (GoalState.PREEMPTED, "successful")),
        (6, 77, "new", (GoalState.FAILED, "error 77: new")),
    ],
)
def test_only_success_in_both_numbers_is_success(
    status: int, code: int, text: str, end: tuple[GoalState, str]
) -> None:
    assert end_of_goal(status, code, text) == end
