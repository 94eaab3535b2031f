"""Diagnosis of a run, as `/diagnostics` reports it once a second."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from aeros.runtime.bus.messages import DiagnosticArray, DiagnosticStatus, Header, KeyValue, Time
from aeros.runtime.execution.governor import OperatorCommand

_OK: Final = 0
_WARNING: Final = 1
_ERROR: Final = 2

_STATES: Final = {
    OperatorCommand.RUN: (_OK, "actions may begin, as the gate decides"),
    OperatorCommand.PAUSE: (_WARNING, "paused by the operator: no action begins"),
    OperatorCommand.STOP: (_ERROR, "stopped by the operator"),
}


def health_message(
    now: Time,
    robot: str,
    command: OperatorCommand,
    *,
    lost: int,
    trouble: str | None,
    missing: Mapping[str, str],
) -> DiagnosticArray:
    """Report the state of the robot and of its bus.

    Args:
        now: Time of the report.
        robot: Name of the robot.
        command: The operator's command in force.
        lost: Number of messages that were not published.
        trouble: First reason for a loss; None if nothing was lost.
        missing: Reason for each name that the bus does not offer as documented.

    Returns:
        The report.
    """
    level, text = _STATES[command]
    agent = DiagnosticStatus(level, "aeros: agent", text, robot, (KeyValue("command", command.name.lower()),))
    values = (
        KeyValue("lost messages", str(lost)),
        *(KeyValue(name, reason) for name, reason in sorted(missing.items())),
    )
    if trouble is not None:
        bus = DiagnosticStatus(_WARNING, "aeros: bus", trouble, robot, values)
    elif missing:
        bus = DiagnosticStatus(_WARNING, "aeros: bus", "message packages are missing", robot, values)
    else:
        bus = DiagnosticStatus(_OK, "aeros: bus", "everything is published", robot, values)
    return DiagnosticArray(Header(now), (agent, bus))
