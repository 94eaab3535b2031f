"""Messages of audit records: every record is an event, and a decision has a message of its own."""

from __future__ import annotations

import json
from typing import Any, Final

from aeros.runtime.audit.check import CHECKPOINT
from aeros.runtime.bus.messages import DecisionMessage, Event, LogMessage, Time, stamp

_INFORMATION: Final = 20
_WARNING: Final = 30
_ERROR: Final = 40
_LEVELS: Final = {"ALLOW": _INFORMATION, "ATTENUATE": _WARNING, "DENY": _ERROR}
"""Level of a decision in `rcl_interfaces/msg/Log`."""


def parse_record(line: bytes, last: Time) -> tuple[Event, DecisionMessage | None]:
    """Make the messages of a record.

    Args:
        line: line of the audit log.
        last: stamp for a record that has no time of its own: latest known time of the plant's clock.

    Returns:
        The event, and the decision if the record is one.
    """
    record = json.loads(line)
    number, name, details = record["sequence"], record["event"], record["details"]
    own = None if name == CHECKPOINT else details.get("time")  # a checkpoint has the time of day
    when = stamp(own) if isinstance(own, float | int) and not isinstance(own, bool) else last
    event = Event(when, number, name, _to_json(details))
    if name != "decision":
        return event, None
    action, reasons = _to_json(details["decided"]), _to_json(details["reasons"])
    decision = DecisionMessage(
        when, number, details["module"], details["skill"], details["verdict"], action, reasons
    )
    return event, decision


def log_message(line: bytes, last: Time) -> LogMessage | None:
    """Make the line of the log for a record that people want to see: a decision, a stop, the end of a step.

    Args:
        line: line of the audit log.
        last: stamp for a record that has no time of its own.

    Returns:
        The line; None for any other record.
    """
    record = json.loads(line)
    name, details = record["event"], record["details"]
    own = details.get("time")
    when = stamp(own) if isinstance(own, float | int) and not isinstance(own, bool) else last
    match name:
        case "decision":
            source, verdict = f"{details['module']}.{details['skill']}", details["verdict"]
            kind = details["asked"]["kind"]
            why = "; ".join(text for _, _, text in details["reasons"])
            return LogMessage(when, _LEVELS[verdict], source, f"{verdict} {kind}{': ' if why else ''}{why}")
        case "stopped":
            return LogMessage(when, _ERROR, "gate", f"stopped: {details.get('reason', '')}")
        case "step-ended":
            source = f"{details['module']}.{details['skill']}"
            return LogMessage(when, _INFORMATION, source, f"{details['status']} {details['reason']}".strip())
    return None


def _to_json(plain: Any) -> str:
    """Return parsed JSON in its canonical spelling."""
    return json.dumps(plain, sort_keys=True, separators=(",", ":"))
