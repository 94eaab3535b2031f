"""`/diagnostics` tells a paused robot from a running one, and a bus that loses messages from a sound one."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from aeros.apps.ros2.health import health_message
from aeros.runtime.bus.messages import DiagnosticStatus, Time
from aeros.runtime.execution.governor import OperatorCommand


def states(
    command: OperatorCommand = OperatorCommand.RUN,
    lost: int = 0,
    trouble: str | None = None,
    missing: Mapping[str, str] | None = None,
) -> tuple[DiagnosticStatus, DiagnosticStatus]:
    message = health_message(Time(5), "cell", command, lost=lost, trouble=trouble, missing=missing or {})
    assert message.header.stamp == Time(5)
    agent, bus = message.status
    assert {one.hardware_id for one in message.status} == {"cell"}
    return agent, bus


@pytest.mark.parametrize(
    ("command", "level"),
    [(OperatorCommand.RUN, 0), (OperatorCommand.PAUSE, 1), (OperatorCommand.STOP, 2)],
)
def test_the_level_is_that_of_the_command(command: OperatorCommand, level: int) -> None:
    agent, bus = states(command)
    assert (agent.level, bus.level) == (level, 0)
    assert agent.values[0].value == command.name.lower()


def test_lost_messages_are_a_warning_with_the_reason() -> None:
    _, bus = states(lost=3, trouble="the bus is slower than the run")
    assert (bus.level, bus.message, bus.values[0].value) == (1, "the bus is slower than the run", "3")


def test_a_missing_package_is_a_warning() -> None:
    _, bus = states(missing={"tf2_msgs": "not installed"})
    assert bus.level == 1
    assert [(one.key, one.value) for one in bus.values[1:]] == [("tf2_msgs", "not installed")]
