"""Decides again what a log says was decided: under the same configuration it must come out the same.

Compared are verdict, the action that may be executed, and all reasons, in whatever order: a record
keeps state and parameters by name, not in the order in which they arrived.  Of a request that held
what a record cannot, the verdict alone is compared.

Where the gate allowed an action and its motion was denied, what the gate said is decided again, the
motion is not: the record holds its digest alone.  Histories and the use of quotas are taken as
recorded; that they are what the log's own past adds up to is not checked.  So is which actions were under
way beside another; what those were, earlier records of the same session say.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from aeros.runtime.audit_check import Record
from aeros.runtime.beside import Begun
from aeros.runtime.canonical import Unencodable, restored
from aeros.runtime.configuration import Configuration
from aeros.runtime.decision import Caller, Decision
from aeros.runtime.gate import Gate, GateDisagreementError
from aeros.runtime.ports import Reading
from aeros.runtime.records import outcome_details
from aeros.runtime.usage import ClockError, Usage, denied_by_clock
from aeros.skill import Action


@dataclass(frozen=True)
class Disagreement:
    """A recorded decision that does not come out the same.

    why: in words; empty where `again` shows it.
    recorded, again: verdict, action and reasons; `again` is None where nothing could be decided.
    """

    sequence: int
    why: str
    recorded: Mapping[str, Any]
    again: Mapping[str, Any] | None = None


_NEEDED: Final = ("time", "state", "usage", "module", "skill", "inputs", "asked")


class _UnheldError(Exception):
    """The record does not hold what it takes to decide again; the message says what is missing."""


@dataclass
class Replay:
    """Takes the records of one log in order.

    agreed: how many decisions came out the same; verdict_only: of how many of them no more than the
        verdict could be compared.
    """

    configuration: Configuration
    gate: Gate
    agreed: int = 0
    verdict_only: int = 0
    disagreements: list[Disagreement] = field(default_factory=list)
    _clock: Usage = field(default_factory=lambda: Usage(()))
    _allowed: dict[int, Mapping[str, Any]] = field(default_factory=dict)

    def take(self, record: Record) -> None:
        """Decide again what `record` says was decided, if it says so of anything."""
        if record["event"] == "session-opened":
            self._clock = Usage(())  # a session has a clock of its own
            self._allowed.clear()
        if record["event"] != "decision":
            return
        details = record["details"]
        if details.get("decided") is not None:
            self._allowed[record["sequence"]] = details
        # Where the motion was denied, what the gate had said stands apart; the motion is not in the record.
        outcome = details.get("gate", details)
        recorded = {name: outcome.get(name) for name in ("verdict", "decided", "reasons")}
        why, again = "", None
        try:
            again = outcome_details(self._decide(details))
        except (_UnheldError, GateDisagreementError) as fault:
            why = str(fault)
        whole = not _has_lost(restored(details))
        same = again is not None and (
            _unordered(again) == _unordered(recorded) if whole else again["verdict"] == recorded["verdict"]
        )
        if same:
            self.agreed += 1
            self.verdict_only += not whole
        else:
            self.disagreements.append(Disagreement(record["sequence"], why, recorded, again))

    def _decide(self, details: Mapping[str, Any]) -> Decision:
        governed = details.get("configuration")
        if governed != self.configuration.digest:
            raise _UnheldError(
                f"it was decided under the configuration {governed}, and the one given is "
                f"{self.configuration.digest}"
            )
        missing = [name for name in _NEEDED if name not in details]
        if missing:
            raise _UnheldError(f"the record does not hold its {', '.join(missing)}")
        state, now = details["state"], restored(details["time"])
        if details.get("state_digest") != hashlib.sha256(_spelt(state)).hexdigest():
            raise _UnheldError("the state is not the one whose digest is recorded")
        try:
            wrong = self._clock_fault(now)
            caller = Caller(details["module"], details["skill"], restored(details["inputs"]))
            readings, action = _readings(state), _action(details["asked"])
            others = [self._under_way(record) for record in details.get("beside", ())]
        except (AttributeError, KeyError, TypeError, ValueError) as fault:
            raise _UnheldError("the record is not one of a decision") from fault
        if (wrong is None) == (details["usage"] is None):
            raise _UnheldError("the use of quotas is recorded if and only if the clock was in order")
        if wrong is not None:
            return denied_by_clock(wrong)
        decision = self.gate.decide(caller, readings, action, now, restored(details["usage"]))
        return self.gate.decide_beside(decision, readings, now, others) if others else decision

    def _under_way(self, record: int) -> Begun:
        """What an earlier record says was decided and begun."""
        details = self._allowed.get(record)
        if details is None:
            raise _UnheldError(
                f"it was decided beside record {record}, which is none of an action that began"
            )
        time = restored(details["time"])
        return Begun(_action(details["decided"]), _readings(details["state"]), time, record)

    def _clock_fault(self, now: float) -> ClockError | None:
        """Why nothing could be counted at `now`, after the decisions before; as `executor` finds it."""
        try:
            self._clock.count(now)
        except ClockError as wrong:
            return wrong
        return None


def _readings(state: Mapping[str, Any]) -> dict[str, Reading]:
    return {name: Reading(restored(value), restored(at)) for name, (value, at) in state.items()}


def _action(told: Mapping[str, Any]) -> Action:
    return Action(told["kind"], restored(told["parameters"]))


def _unordered(outcome: Mapping[str, Any]) -> tuple[bytes, list[bytes]]:
    reasons = outcome["reasons"]
    listed = reasons if type(reasons) is list else [reasons]
    rest = {name: value for name, value in outcome.items() if name != "reasons"}
    return _spelt(rest), sorted(map(_spelt, listed))


def _has_lost(value: Any) -> bool:
    """Whether anything in it is not what was there, but a word for it."""
    parts = value if type(value) is list else value.values() if type(value) is dict else ()
    return type(value) is Unencodable or any(map(_has_lost, parts))


def _spelt(plain: Any) -> bytes:
    """What was read back, as it was spelt."""
    return json.dumps(plain, sort_keys=True, separators=(",", ":")).encode("ascii")
