from __future__ import annotations

import pytest

from aeros.ros2_control.controller import GoalState


@pytest.mark.parametrize("state", GoalState)
def test_every_state_but_the_first_is_the_end(state: GoalState) -> None:
    assert state.is_over is (state is not GoalState.ACCEPTED)
