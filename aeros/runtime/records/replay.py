"""Decides again what a log says was decided: under the same configuration it must come out the same.

Of a session the configuration is the one that its opening names, and after a change the one that this
names; a decision that names another is not one of this log.  Compared are verdict, the action that may be
executed, and all reasons, in whatever order: a record keeps state and parameters by name, not in the order
in which they arrived.  Where the whole motion was decided, it is decided again, after the gate.  Of a
request that held what a record cannot, the verdict alone is compared.

The use of quotas, and as far as they say it the histories, must be what the decisions before add up to
(`recounting`).  Taken as recorded is which actions were under way beside another; what those were, earlier
records of the same session say.
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
from aeros.runtime.canonical_json import Unencodable, canonical, restored
from aeros.runtime.gate.causes import causes_of_denial
from aeros.runtime.gate.configuration import Configuration, Configurations, UnknownConfigurationError
from aeros.runtime.gate.decision import Caller, Decision, Verdict
from aeros.runtime.gate.gate import CompiledGate, GateDisagreementError, GateMode
from aeros.runtime.gate.joint_rules import Begun
from aeros.runtime.gate.quotas import ClockError, denied_by_clock
from aeros.runtime.motion.merged import Companion, companions_of
from aeros.runtime.motion.trajectory import MotionDecider
from aeros.runtime.ports import Readings
from aeros.runtime.records.records import motion_from_json, outcome_details, session_details
from aeros.runtime.records.recount import Recount, Used, readings_of
from aeros.skill import Action
from aeros.spec.model.cause import told as told_causes


@dataclass(frozen=True)
class Disagreement:
    """A record that does not come out the same.

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


@dataclass(frozen=True)
class _Governing:
    """A configuration, and what decides under it."""

    configuration: Configuration
    gate: CompiledGate
    motions: MotionDecider


@dataclass
class _Session:
    """What the records of a session so far say that a later one depends on.

    governing: None where it is not known, and `why` says so.
    recount: None where a configuration was not known, so nobody knows what was counted under it.
    begun: the decisions that let something begin, by number; bodies: by digest.
    """

    governing: _Governing | None = None
    why: str = "no record before it says which configuration governs"
    recount: Recount | None = None
    begun: dict[int, Mapping[str, Any]] = field(default_factory=dict)
    bodies: dict[str, Any] = field(default_factory=dict)


@dataclass
class Replay:
    """Takes the records of one log in order.

    known: where configurations are to be had; each is asked for once.
    agreed: how many decisions came out the same; verdict_only: of how many of them no more than the
        verdict could be compared.
    """

    known: Configurations
    mode: GateMode = GateMode.COMPILED
    agreed: int = 0
    verdict_only: int = 0
    disagreements: list[Disagreement] = field(default_factory=list)
    _session: _Session = field(default_factory=_Session)
    _found: dict[str, _Governing | str] = field(default_factory=dict)

    def take(self, record: Record) -> None:
        """Decide again what `record` says was decided, if it says so of anything."""
        match record["event"]:
            case "session-opened":
                self._session = _Session()
                self._govern(record)
                governing = self._session.governing
                site = None if governing is None else governing.configuration.site
                self._session.recount = None if site is None else Recount(site)
            case "session-resumed":
                self._follow(record)
                self._session.begun.clear()
                if self._session.recount is not None:
                    self._session.recount.interrupt()
            case "configuration-changed":
                self._follow(record)
            case "body":
                told = record["details"].get("body")
                self._session.bodies[_digest(told)] = told
            case "decision":
                self._take_decision(record)

    # Who governs.

    def _govern(self, record: Record) -> None:
        """From now on the configuration that `record` names governs; all it says of that must be so."""
        details, session = record["details"], self._session
        digest = details.get("configuration")
        if type(digest) is not str:
            session.governing, session.why = None, f"record {record['sequence']} names no configuration"
            return
        if digest not in self._found:
            self._found[digest] = self._find(digest)
        found = self._found[digest]
        if isinstance(found, str):
            session.governing, session.why = None, found
            return
        session.governing = found
        again = session_details(found.configuration)
        if _spelt(details) != canonical(again):
            self.disagreements.append(Disagreement(record["sequence"], "", details, again))

    def _find(self, digest: str) -> _Governing | str:
        """What decides under the configuration of that digest, or why nothing does."""
        try:
            found = self.known(digest)
        except UnknownConfigurationError as unknown:
            return f"it was decided under the configuration {digest}, and {unknown}"
        return _Governing(found, CompiledGate(found, self.mode), MotionDecider(found.site.motion))

    def _follow(self, record: Record) -> None:
        self._govern(record)
        session = self._session
        if session.governing is None:
            session.recount = None
        elif session.recount is not None:
            session.recount.follow(session.governing.configuration.site)

    # Decisions.

    def _take_decision(self, record: Record) -> None:
        details = record["details"]
        recorded = _outcome(details)
        why, again = "", None
        try:
            again = self._decide(details)
        except (_UnheldError, GateDisagreementError) as fault:
            why = str(fault)
        if recorded["decided"] is not None:
            self._begin(record["sequence"], details)
        whole = not _has_lost(restored(details))
        same = again is not None and (
            _unordered(again) == _unordered(recorded) if whole else again["verdict"] == recorded["verdict"]
        )
        if same:
            self.agreed += 1
            self.verdict_only += not whole
        else:
            self.disagreements.append(Disagreement(record["sequence"], why, recorded, again))

    def _decide(self, details: Mapping[str, Any]) -> dict[str, Any]:
        """What comes out now; raises `_UnheldError` and `GateDisagreementError`."""
        used, wrong = self._recount(details)
        governing = self._session.governing
        if governing is None:
            raise _UnheldError(self._session.why)
        named, digest = details.get("configuration"), governing.configuration.digest
        if named != digest:
            raise _UnheldError(f"it names the configuration {named} where {digest} governs")
        missing = [name for name in _NEEDED if name not in details]
        if missing:
            raise _UnheldError(f"the record does not hold its {', '.join(missing)}")
        if details.get("state_digest") != _digest(details["state"]):
            raise _UnheldError("the state is not the one whose digest is recorded")
        if self._session.recount is None:
            raise _UnheldError("what was counted before it depends on a configuration that is not known")
        if wrong is not None:
            raise _UnheldError(wrong)
        try:
            return self._decide_held(governing, details, used)
        except (AttributeError, KeyError, OverflowError, TypeError, ValueError) as fault:
            raise _UnheldError("the record is not one of a decision") from fault

    def _decide_held(
        self, governing: _Governing, details: Mapping[str, Any], used: Used | None
    ) -> dict[str, Any]:
        now, recorded = restored(details["time"]), restored(details["usage"])
        caller = Caller(details["module"], details["skill"], restored(details["inputs"]))
        readings, action = readings_of(details["state"]), _action(details["asked"])
        others = [self._earlier(record) for record in details.get("beside", ())]
        if used is None:
            raise ValueError("at no time")
        if isinstance(used, ClockError) != (recorded is None):
            raise _UnheldError("the use of quotas is recorded if and only if the clock was in order")
        spell = partial(
            self._spelt, governing.configuration, caller, readings, action, now, "causes" in details
        )
        if isinstance(used, ClockError):
            return spell(denied_by_clock(used))
        if recorded != used:
            told = f"what was decided before it adds up to {dict(used)}, and recorded is {recorded}"
            raise _UnheldError(f"the use of quotas is another: {told}")
        gated = governing.gate.decide(caller, readings, action, now, recorded)
        begun = [_begun(number, earlier) for number, earlier in others]
        if others:
            gated = governing.gate.decide_beside(gated, readings, now, begun)
        halting = details.get("halting", ())
        companions = companions_of(
            (
                (one, self._motion(earlier), one.record in halting)
                for one, (_, earlier) in zip(begun, others, strict=True)
            ),
            now,
        )
        decision = self._decide_motion(governing.motions, gated, readings, details, companions)
        again = spell(decision)
        return again if decision is gated else {**again, "gate": outcome_details(gated)}

    @staticmethod
    def _spelt(
        configuration: Configuration,
        caller: Caller,
        readings: Readings,
        asked: Action,
        now: float,
        with_causes: bool,
        decision: Decision,
    ) -> dict[str, Any]:
        """What came out, with the causes where the record has them: older ones have none."""
        again = outcome_details(decision)
        if with_causes and decision.verdict is not Verdict.ALLOW:
            again["causes"] = told_causes(
                causes_of_denial(configuration, decision, caller, readings, asked, now)
            )
        return again

    def _decide_motion(
        self,
        motions: MotionDecider,
        gated: Decision,
        readings: Readings,
        details: Mapping[str, Any],
        others: Sequence[Companion],
    ) -> Decision:
        governed = gated.action is not None and motions.governs(gated.action.kind)
        if governed != ("motion" in details):
            raise _UnheldError("a motion is recorded if and only if one was to be decided")
        return motions.decide(gated, self._motion(details), readings, others) if governed else gated

    def _motion(self, details: Mapping[str, Any]) -> Any:
        """What the plant said it would do, where it was asked."""
        if "motion" not in details:
            return None
        told = details["motion"]
        if details.get("motion_digest") != _digest(told):
            raise _UnheldError("the motion is not the one whose digest is recorded")
        if type(told) is dict and "body" in told and told["body"] not in self._session.bodies:
            raise _UnheldError("no record before it holds the body that the motion names")
        return motion_from_json(told, self._session.bodies)

    # What was before.

    def _earlier(self, record: int) -> tuple[int, Mapping[str, Any]]:
        """What an earlier record says was decided and begun."""
        if record not in self._session.begun:
            raise _UnheldError(
                f"it was decided beside record {record}, which is none of an action that began"
            )
        return record, self._session.begun[record]

    def _recount(self, details: Mapping[str, Any]) -> tuple[Used | None, str | None]:
        """How much of each quota is used up by then, and what is wrong with the histories."""
        recount = self._session.recount
        if recount is None:
            return None, None
        now, readings = restored(details.get("time")), {}
        # A state that is malformed is a disagreement by itself.
        with suppress(AttributeError, KeyError, TypeError, ValueError):
            readings = readings_of(details["state"])
        return recount.used(now), recount.objection(readings, now)

    def _begin(self, number: int, details: Mapping[str, Any]) -> None:
        """What may be executed, is: it counts, and others may be decided beside it."""
        self._session.begun[number] = details
        if self._session.recount is not None:
            decided = details["decided"]
            kind = decided.get("kind") if type(decided) is dict else None
            self._session.recount.executed(kind, restored(details.get("time")))


def _action(told: Mapping[str, Any]) -> Action:
    return Action(told["kind"], restored(told["parameters"]))


def _begun(number: int, details: Mapping[str, Any]) -> Begun:
    time = restored(details["time"])
    return Begun(_action(details["decided"]), readings_of(details["state"]), time, number)


def _outcome(details: Mapping[str, Any]) -> dict[str, Any]:
    """What a record says came out; where a motion was denied, also what the gate had said."""
    found = {name: details.get(name) for name in ("verdict", "decided", "reasons")}
    found |= {"causes": details["causes"]} if "causes" in details else {}
    return {**found, "gate": details["gate"]} if "gate" in details else found


def _unordered(outcome: Any) -> Any:
    """The same for outcomes that differ in nothing but the order of their reasons, and the file's path."""
    if type(outcome) is not dict:
        return _spelt(outcome)
    rest = {name: value for name, value in outcome.items() if name not in ("reasons", "causes", "gate")}
    reasons = [_listed(outcome.get(name)) for name in ("reasons", "causes")]
    return _spelt(rest), reasons, _unordered(outcome.get("gate"))


def _listed(reasons: Any) -> Any:
    return sorted(_spelt(_unplaced(one)) for one in reasons) if type(reasons) is list else _spelt(reasons)


def _unplaced(cause: Any) -> Any:
    """The same for a cause whose condition is in a file of the same lines, wherever that is."""
    if type(cause) is not dict or type(cause.get("at")) is not str:
        return cause
    return {**cause, "at": cause["at"].rpartition(":")[2]}


def _has_lost(value: Any) -> bool:
    """Whether anything in it is not what was there, but a word for it."""
    parts = value if type(value) is list else value.values() if type(value) is dict else ()
    return type(value) is Unencodable or any(map(_has_lost, parts))


def _digest(plain: Any) -> str:
    return hashlib.sha256(_spelt(plain)).hexdigest()


def _spelt(plain: Any) -> bytes:
    """What was read back, as it was spelt."""
    return json.dumps(plain, sort_keys=True, separators=(",", ":")).encode("ascii")
