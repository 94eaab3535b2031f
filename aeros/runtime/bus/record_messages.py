"""Messages of audit records: every record is an event, and a decision has a message of its own."""

from __future__ import annotations

import json
from typing import Any

from aeros.runtime.audit.check import CHECKPOINT
from aeros.runtime.bus.messages import DecisionMessage, Event, Time, stamp


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


def _to_json(plain: Any) -> str:
    """Return parsed JSON in its canonical spelling."""
    return json.dumps(plain, sort_keys=True, separators=(",", ":"))
