"""Records of the audit log as messages."""

from __future__ import annotations

import json
from typing import Any

from aeros.runtime.bus.messages import Decision, Event, Time, stamp


def parse_record(line: bytes, last: Time) -> tuple[Event, Decision | None]:
    """The record in `line`, and where it is a decision of the gate, that.

    last: stamps a record that names no time of its own; the plant's clock when it was last heard of.
    """
    record = json.loads(line)
    number, name, details = record["sequence"], record["event"], record["details"]
    own = details.get("time")
    when = stamp(own) if type(own) in (float, int) else last
    event = Event(when, number, name, _to_json(details))
    if name != "decision":
        return event, None
    action, reasons = _to_json(details["decided"]), _to_json(details["reasons"])
    decision = Decision(
        when, number, details["module"], details["skill"], details["verdict"], action, reasons
    )
    return event, decision


def _to_json(plain: Any) -> str:
    """As the record has it."""
    return json.dumps(plain, sort_keys=True, separators=(",", ":"))
