"""The port's own values: statuses of goals."""

from __future__ import annotations

import pytest

from aeros.runtime.bus.port import BusError, GoalStatus, NoServerError


@pytest.mark.parametrize(
    ("status", "number", "is_over"),
    [
        (GoalStatus.ACCEPTED, 1, False),
        (GoalStatus.EXECUTING, 2, False),
        (GoalStatus.CANCELING, 3, False),
        (GoalStatus.SUCCEEDED, 4, True),
        (GoalStatus.CANCELED, 5, True),
        (GoalStatus.ABORTED, 6, True),
    ],
)
def test_a_goal_has_the_number_of_action_msgs_and_a_result_from_succeeded_on(
    status: GoalStatus, number: int, is_over: bool
) -> None:
    assert (status.value, status.is_over) == (number, is_over)


def test_a_missing_server_is_a_bus_error_too() -> None:
    with pytest.raises(BusError):
        raise NoServerError("nobody serves `/x`")
