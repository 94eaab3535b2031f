"""A managed node follows the operator's command in steps that ROS 2 has."""

from __future__ import annotations

import pytest

from aeros.runtime.bus.ros2.lifecycle_steps import LifecycleStep, next_step
from aeros.runtime.execution.governor import OperatorCommand

_AFTER = {
    LifecycleStep.CONFIGURE: "inactive",
    LifecycleStep.ACTIVATE: "active",
    LifecycleStep.DEACTIVATE: "inactive",
    LifecycleStep.SHUTDOWN: "finalized",
}
_STATE_OF = {
    OperatorCommand.RUN: "active",
    OperatorCommand.PAUSE: "inactive",
    OperatorCommand.STOP: "finalized",
}


@pytest.mark.parametrize("command", list(OperatorCommand))
@pytest.mark.parametrize("state", ["unconfigured", "inactive", "active"])
def test_the_steps_lead_to_the_state_of_the_command(state: str, command: OperatorCommand) -> None:
    while (step := next_step(state, command)) is not None:
        assert state != _STATE_OF[command]
        state = _AFTER[step]
    assert state == _STATE_OF[command]


@pytest.mark.parametrize("state", ["finalized", "activating", "errorprocessing"])
@pytest.mark.parametrize("command", list(OperatorCommand))
def test_a_node_between_states_or_at_its_end_takes_no_step(state: str, command: OperatorCommand) -> None:
    assert next_step(state, command) is None
