"""Replay of an audit log: decides every recorded decision again, under the same configuration.

The configuration of a session is the one that its opening record names, and after a change the one that
the change names. A decision that names another configuration does not belong to the log. Compared are
verdict, executable action and all reasons, in any order, because a record keeps state and parameters by
name and not in the order in which they arrived. If the whole motion was decided, it is decided again, after
the gate. If a request held values that a record cannot hold, only the verdict is compared.

The recorded quota usage, and the histories as far as records determine them, must equal what the earlier
decisions add up to (`recount`). Which actions were active at a decision is accepted as recorded; those
actions themselves come from earlier records of the same session.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Final

from aeros.runtime.audit.check import Record
from aeros.runtime.canonical_json import UnencodableValue, decode_value, to_canonical_json
from aeros.runtime.gate.causes import denial_causes
from aeros.runtime.gate.configuration import Configuration, FindConfiguration, UnknownConfigurationError
from aeros.runtime.gate.decision import Caller, Decision, DecisionKind
from aeros.runtime.gate.gate import CompiledGate, GateDisagreementError, GateMode
from aeros.runtime.gate.joint_rules import ActiveAction
from aeros.runtime.gate.quotas import ClockError, clock_denial
from aeros.runtime.motion.merged import ConcurrentMotion, concurrent_motions
from aeros.runtime.motion.trajectory import MotionDecider
from aeros.runtime.ports import Readings
from aeros.runtime.records.obstacle_json import obstacles_from_json
from aeros.runtime.records.records import decision_outcome, motion_from_json, session_details
from aeros.runtime.records.recount import QuotaUsage, SessionState, parse_readings
from aeros.skill import Action
from aeros.spec.model.cause import causes_to_json


@dataclass(frozen=True)
class ReplayMismatch:
    """A record whose decision comes out differently.

    Attributes:
        sequence: number of the record.
        reason: explanation; empty if comparing `recorded` and `replayed` shows it.
        recorded: verdict, action and reasons in the record.
        replayed: the same, decided again; None if it could not be decided.
    """

    sequence: int
    reason: str
    recorded: Mapping[str, Any]
    replayed: Mapping[str, Any] | None = None


_REQUIRED_KEYS: Final = ("time", "state", "usage", "module", "skill", "inputs", "asked")


class _IncompleteRecordError(Exception):
    """The record lacks data that is needed to decide again; the message says which."""


@dataclass(frozen=True)
class _ReplayDecider:
    """A configuration with the gate and the motion decider under it."""

    configuration: Configuration
    gate: CompiledGate
    motions: MotionDecider


@dataclass
class _Session:
    """State of a session that later records depend on.

    Attributes:
        decider: None if the configuration is unknown; `unusable_reason` says why.
        state: recount of the session; None once a configuration was unknown.
        active_actions: details of decisions that let an action begin, by record number.
        bodies: encoded robot bodies, by digest.
    """

    decider: _ReplayDecider | None = None
    unusable_reason: str = "no record before it says which configuration governs"
    state: SessionState | None = None
    active_actions: dict[int, Mapping[str, Any]] = field(default_factory=dict)
    bodies: dict[str, Any] = field(default_factory=dict)


@dataclass
class LogReplay:
    """Replays the records of one log, fed in order.

    Attributes:
        find_configuration: finds configurations by digest; asked once for each.
        mode: method by which the gate evaluates terms.
        matching_count: number of decisions that came out the same.
        verdict_only_count: number of those of which only the verdict could be compared.
        mismatches: decisions and sessions that came out differently.
    """

    find_configuration: FindConfiguration
    mode: GateMode = GateMode.COMPILED
    matching_count: int = 0
    verdict_only_count: int = 0
    mismatches: list[ReplayMismatch] = field(default_factory=list)
    _session: _Session = field(default_factory=_Session)
    _deciders: dict[str, _ReplayDecider | str] = field(default_factory=dict)

    def replay_record(self, record: Record) -> None:
        """Replay one record; a decision is decided again.

        Args:
            record: the next sound record of the log.
        """
        match record["event"]:
            case "session-opened":
                self._session = _Session()
                self._switch_configuration(record)
                governing = self._session.decider
                site = None if governing is None else governing.configuration.site
                self._session.state = None if site is None else SessionState(site)
            case "session-resumed":
                self._follow(record)
                self._session.active_actions.clear()
                if self._session.state is not None:
                    self._session.state.mark_gap()
            case "configuration-changed":
                self._follow(record)
            case "body":
                body = record["details"].get("body")
                self._session.bodies[_digest(body)] = body
            case "decision":
                self._replay_decision(record)

    # The configuration in force.

    def _switch_configuration(self, record: Record) -> None:
        """Switch to the configuration that `record` names, and check everything the record says of it."""
        details, session = record["details"], self._session
        digest = details.get("configuration")
        if type(digest) is not str:
            session.decider, session.unusable_reason = (
                None,
                f"record {record['sequence']} names no configuration",
            )
            return
        if digest not in self._deciders:
            self._deciders[digest] = self._decider_for(digest)
        found = self._deciders[digest]
        if isinstance(found, str):
            session.decider, session.unusable_reason = None, found
            return
        session.decider = found
        again = session_details(found.configuration)
        if _to_json(details) != to_canonical_json(again):
            self.mismatches.append(ReplayMismatch(record["sequence"], "", details, again))

    def _decider_for(self, digest: str) -> _ReplayDecider | str:
        """Return the decider for the configuration of that digest, or why there is none."""
        try:
            found = self.find_configuration(digest)
        except UnknownConfigurationError as unknown:
            return f"it was decided under the configuration {digest}, and {unknown}"
        return _ReplayDecider(found, CompiledGate(found, self.mode), MotionDecider(found.site.motion))

    def _follow(self, record: Record) -> None:
        self._switch_configuration(record)
        session = self._session
        if session.decider is None:
            session.state = None
        elif session.state is not None:
            session.state.switch_site(session.decider.configuration.site)

    # Decisions.

    def _replay_decision(self, record: Record) -> None:
        details = record["details"]
        recorded = _outcome(details)
        reason, again = "", None
        try:
            again = self._decide(details)
        except (_IncompleteRecordError, GateDisagreementError) as fault:
            reason = str(fault)
        if recorded["decided"] is not None:
            self._record_execution(record["sequence"], details)
        whole = not _has_unencodable(decode_value(details))
        same = again is not None and (
            _without_reason_order(again) == _without_reason_order(recorded)
            if whole
            else again["verdict"] == recorded["verdict"]
        )
        if same:
            self.matching_count += 1
            self.verdict_only_count += not whole
        else:
            self.mismatches.append(ReplayMismatch(record["sequence"], reason, recorded, again))

    def _decide(self, details: Mapping[str, Any]) -> dict[str, Any]:
        """Decide again.

        Raises:
            _IncompleteRecordError: the record lacks what the decision depends on.
            GateDisagreementError: two forms of the gate decide differently.
        """
        used, wrong = self._recount(details)
        governing = self._session.decider
        if governing is None:
            raise _IncompleteRecordError(self._session.unusable_reason)
        named, digest = details.get("configuration"), governing.configuration.digest
        if named != digest:
            raise _IncompleteRecordError(f"it names the configuration {named}, but {digest} was in force")
        missing = [name for name in _REQUIRED_KEYS if name not in details]
        if missing:
            raise _IncompleteRecordError(f"the record does not hold its {', '.join(missing)}")
        if details.get("state_digest") != _digest(details["state"]):
            raise _IncompleteRecordError("the state does not match its recorded digest")
        if self._session.state is None:
            raise _IncompleteRecordError("the counts before it depend on an unknown configuration")
        if wrong is not None:
            raise _IncompleteRecordError(wrong)
        try:
            return self._decide_complete(governing, details, used)
        except (AttributeError, KeyError, OverflowError, TypeError, ValueError) as fault:
            raise _IncompleteRecordError("the record is not a decision") from fault

    def _decide_complete(
        self, governing: _ReplayDecider, details: Mapping[str, Any], used: QuotaUsage | None
    ) -> dict[str, Any]:
        now, recorded = decode_value(details["time"]), decode_value(details["usage"])
        caller = Caller(details["module"], details["skill"], decode_value(details["inputs"]))
        readings, action = parse_readings(details["state"]), _parse_action(details["asked"])
        others = [self._active_action(record) for record in details.get("beside", ())]
        if used is None:
            raise ValueError("at no time")
        if isinstance(used, ClockError) != (recorded is None):
            raise _IncompleteRecordError("the use of quotas must be recorded exactly if the clock was valid")
        spell = partial(
            _new_outcome, governing.configuration, caller, readings, action, now, "causes" in details
        )
        if isinstance(used, ClockError):
            return spell(clock_denial(used))
        if recorded != used:
            sums = f"the earlier decisions give {dict(used)}, but {recorded} is recorded"
            raise _IncompleteRecordError(f"the use of quotas differs: {sums}")
        gated = governing.gate.decide(caller, readings, action, now, recorded)
        active = [_parse_active_action(number, earlier) for number, earlier in others]
        if others:
            gated = governing.gate.decide_jointly(gated, readings, now, active)
        halting = details.get("halting", ())
        companions = concurrent_motions(
            (
                (one, self._motion(earlier), one.record_number in halting)
                for one, (_, earlier) in zip(active, others, strict=True)
            ),
            now,
        )
        decision = self._decide_motion(governing.motions, gated, readings, details, companions)
        again = spell(decision)
        return again if decision is gated else {**again, "gate": decision_outcome(gated)}

    def _decide_motion(
        self,
        motions: MotionDecider,
        gated: Decision,
        readings: Readings,
        details: Mapping[str, Any],
        concurrent_motions: Sequence[ConcurrentMotion],
    ) -> Decision:
        governed = gated.action is not None and motions.covers_kind(gated.action.kind)
        if governed != ("motion" in details):
            raise _IncompleteRecordError("a motion must be recorded exactly if one was to be decided")
        return (
            motions.decide(
                gated,
                self._motion(details),
                readings,
                concurrent_motions,
                obstacles_from_json(details.get("obstacles", ())),
            )
            if governed
            else gated
        )

    def _motion(self, details: Mapping[str, Any]) -> Any:
        """Return the recorded motion; None if the record has none.

        Raises:
            _IncompleteRecordError: the motion or its body is missing or altered.
        """
        if "motion" not in details:
            return None
        motion = details["motion"]
        if details.get("motion_digest") != _digest(motion):
            raise _IncompleteRecordError("the motion does not match its recorded digest")
        if type(motion) is dict and "body" in motion and motion["body"] not in self._session.bodies:
            raise _IncompleteRecordError("no record before it holds the body that the motion names")
        return motion_from_json(motion, self._session.bodies)

    # Earlier records.

    def _active_action(self, record: int) -> tuple[int, Mapping[str, Any]]:
        """Return number and details of an earlier decision whose action began.

        Raises:
            _IncompleteRecordError: that record is not an action that began.
        """
        if record not in self._session.active_actions:
            raise _IncompleteRecordError(
                f"it was decided together with record {record}, which is not an action that began"
            )
        return record, self._session.active_actions[record]

    def _recount(self, details: Mapping[str, Any]) -> tuple[QuotaUsage | None, str | None]:
        """Return the quota usage at the record's time, and a mismatch of the histories if there is one."""
        recount = self._session.state
        if recount is None:
            return None, None
        now, readings = decode_value(details.get("time")), {}
        # A malformed state is reported by `_decide_complete`.
        with suppress(AttributeError, KeyError, TypeError, ValueError):
            readings = parse_readings(details["state"])
        return recount.usage_at(now), recount.history_mismatch(readings, now)

    def _record_execution(self, number: int, details: Mapping[str, Any]) -> None:
        """Count the executable action of a decision as begun; later decisions may name it as active."""
        self._session.active_actions[number] = details
        if self._session.state is not None:
            decided = details["decided"]
            kind = decided.get("kind") if type(decided) is dict else None
            self._session.state.count_execution(kind, decode_value(details.get("time")))


def _parse_action(encoded_action: Mapping[str, Any]) -> Action:
    return Action(encoded_action["kind"], decode_value(encoded_action["parameters"]))


def _parse_active_action(number: int, details: Mapping[str, Any]) -> ActiveAction:
    time = decode_value(details["time"])
    return ActiveAction(_parse_action(details["decided"]), parse_readings(details["state"]), time, number)


def _new_outcome(
    configuration: Configuration,
    caller: Caller,
    readings: Readings,
    requested_action: Action,
    now: float,
    with_causes: bool,
    decision: Decision,
) -> dict[str, Any]:
    """Return the outcome as recorded, with causes if the record has them; older records have none."""
    again = decision_outcome(decision)
    if with_causes and decision.kind is not DecisionKind.ALLOW:
        again["causes"] = causes_to_json(
            denial_causes(configuration, decision, caller, readings, requested_action, now)
        )
    return again


def _outcome(details: Mapping[str, Any]) -> dict[str, Any]:
    """Return the recorded outcome; if the motion was denied, with the gate's own decision."""
    found = {name: details.get(name) for name in ("verdict", "decided", "reasons")}
    found |= {"causes": details["causes"]} if "causes" in details else {}
    return {**found, "gate": details["gate"]} if "gate" in details else found


def _without_reason_order(outcome: Any) -> Any:
    """Return a value that is equal for outcomes that differ only in the order of reasons or in paths."""
    if type(outcome) is not dict:
        return _to_json(outcome)
    rest = {name: value for name, value in outcome.items() if name not in ("reasons", "causes", "gate")}
    reasons = [_reason_lists(outcome.get(name)) for name in ("reasons", "causes")]
    return _to_json(rest), reasons, _without_reason_order(outcome.get("gate"))


def _reason_lists(reasons: Any) -> Any:
    return (
        sorted(_to_json(_without_path(one)) for one in reasons)
        if type(reasons) is list
        else _to_json(reasons)
    )


def _without_path(cause: Any) -> Any:
    """Return the cause with the line number in place of its location, because files move."""
    if type(cause) is not dict or type(cause.get("at")) is not str:
        return cause
    return {**cause, "at": cause["at"].rpartition(":")[2]}


def _has_unencodable(value: Any) -> bool:
    """Return True if the value contains a placeholder for something that a record cannot hold."""
    parts = value if type(value) is list else value.values() if type(value) is dict else ()
    return type(value) is UnencodableValue or any(map(_has_unencodable, parts))


def _digest(plain: Any) -> str:
    return hashlib.sha256(_to_json(plain)).hexdigest()


def _to_json(plain: Any) -> bytes:
    """Return parsed JSON in its canonical spelling."""
    return json.dumps(plain, sort_keys=True, separators=(",", ":")).encode("ascii")
