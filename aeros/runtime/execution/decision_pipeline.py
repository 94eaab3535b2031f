"""Everything that an executor decides by: gate, whole motions, quotas, histories and monitors, as one.

`decide` looks at the state once, decides the action by itself, then together with what is under way, then
the motion that it becomes, and has it all in the record, durable, before it returns.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from aeros.runtime.audit.log import AuditLog
from aeros.runtime.canonical_json import digest_of
from aeros.runtime.execution.step import UnderWay
from aeros.runtime.gate.causes import causes_of_denial
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import Caller, Decision, Verdict
from aeros.runtime.gate.joint_rules import Begun
from aeros.runtime.gate.port import Gate
from aeros.runtime.gate.quotas import ClockError, Usage, denied_by_clock
from aeros.runtime.monitor.history import Histories
from aeros.runtime.monitor.monitor import Monitors
from aeros.runtime.motion.merged import Companion, companions_of
from aeros.runtime.motion.trajectory import MotionDecider
from aeros.runtime.ports import Plan, Plant, Readings, Trajectory
from aeros.runtime.records.encode_decisions import DecisionTeller
from aeros.runtime.records.records import DecisionRecord, body_to_json
from aeros.runtime.records.recount import Recount
from aeros.skill import Action
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.model.cause import Cause


class Decided(NamedTuple):
    """What was decided and recorded.

    begun: the action that may be executed, as from now on it is under way; None where it was denied.
    plan: what the plant said it would be, where it was asked.
    ends_others: it is a protective stop, which is not denied for what moves but ends that.
    causes: why it was not simply allowed, as data.
    """

    decision: Decision
    begun: Begun | None
    plan: Plan | None
    ends_others: bool
    causes: tuple[Cause, ...] = ()


class Deciding:
    """Decides under one configuration, and from `follow` on under another."""

    def __init__(self, configuration: Configuration, gate: Gate, plant: Plant, audit: AuditLog) -> None:
        self._configuration = configuration
        self._gate = gate
        self._plant = plant
        self._audit = audit
        self._histories = Histories(configuration.site)
        self._motions = MotionDecider(configuration.site.motion)
        self._usage = Usage(configuration.site.quotas)
        self.monitors = Monitors(gate.watched, self._histories)
        self._teller = DecisionTeller()
        self._body: tuple[object, str] | None = None  # the last that was recorded, and its digest

    def follow(self, configuration: Configuration) -> None:
        """Decide under `configuration` from now on; nothing may be under way.

        Under the same site histories and quotas go on; under another, histories begin anew.
        """
        site = configuration.site
        self._gate = self._gate.under(configuration)
        if site.digest != self._configuration.site.digest:
            self._histories = Histories(site)
            self._motions = MotionDecider(site.motion)
            self._usage = self._usage.under(site.quotas)
            self.monitors = Monitors(self._gate.watched, self._histories)
        self._configuration = configuration

    def take_over(self, recount: Recount) -> None:
        """Go on with what an earlier session under the same site had counted and seen."""
        self._usage, self._histories = recount.usage, recount.histories
        self.monitors = Monitors(self._gate.watched, self._histories)

    def decide(self, caller: Caller, asked: Action, under_way: Sequence[UnderWay]) -> Decided:
        """Decide what `caller` asks for, on what is measured now."""
        # In this order: a reading is never younger than the time it is judged at.
        measured = self._plant.observe()
        now = self._plant.now()
        readings = self._histories.look(measured, now)
        gated, usage = self._decide_alone(caller, readings, asked, now)
        ends_others = self._is_protective(gated)
        others = () if ends_others else under_way
        if others:
            gated = self._gate.decide_beside(gated, readings, now, [other.begun for other in others])
        companions: Sequence[Companion] = ()
        if others:
            companions = companions_of(((one.begun, one.plan, one.is_halting) for one in others), now)
        decision, plan, motion = self._decide_motion(gated, readings, companions)
        digest, beside = self._configuration.digest, [other.begun.record for other in others]
        halting = [other.begun.record for other in others if other.is_halting]
        causes: tuple[Cause, ...] = ()
        if decision.verdict is not Verdict.ALLOW:
            causes = causes_of_denial(self._configuration, decision, caller, readings, asked, now)
        made = DecisionRecord(
            decision, digest, now, readings, caller, asked, usage, beside, halting, motion, causes
        )
        details = self._teller.tell(made)
        record = self._audit.append("decision", details)
        if decision.verdict is Verdict.DENY:
            return Decided(decision, None, plan, ends_others=False, causes=causes)
        if decision.action is None:
            raise InternalError(f"the gate said {decision.verdict.value} and gave no action")
        return Decided(decision, Begun(decision.action, readings, now, record), plan, ends_others)

    def executed(self, begun: Begun) -> None:
        """Count an action that is about to begin: one that fails half-way was executed too."""
        self._usage.executed(begun.action.kind, begun.time)

    def _decide_alone(
        self, caller: Caller, readings: Readings, asked: Action, now: float
    ) -> tuple[Decision, Mapping[str, int] | None]:
        """The decision, and the use of quotas that it was made on."""
        try:
            usage = self._usage.count(now)
        except ClockError as wrong:
            return denied_by_clock(wrong), None
        return self._gate.decide(caller, readings, asked, now, usage), usage

    def _decide_motion(
        self, gated: Decision, readings: Readings, others: Sequence[Companion]
    ) -> tuple[Decision, Plan | None, Mapping[str, Any]]:
        """What the whole motion makes of the decision, that motion, and what the record is to say of it.

        None and nothing where there is no motion to decide.
        """
        action = gated.action
        if action is None or not self._motions.governs(action.kind):
            return gated, None, {}
        plan = self._plant.plan(action)
        decision = self._motions.decide(gated, plan, readings, others)
        body = self._record_body(plan.body) if type(plan) is Trajectory else ""
        return decision, plan, self._teller.motion(plan, body, gated, decision)

    def _record_body(self, body: object) -> str:
        """The digest by which records name the body, which is in the record from then on."""
        if self._body is None or body is not self._body[0]:
            told = body_to_json(body)
            digest = digest_of(told)
            if self._body is None or digest != self._body[1]:
                self._audit.append("body", {"body": told})
            self._body = (body, digest)
        return self._body[1]

    def _is_protective(self, decision: Decision) -> bool:
        action = decision.action
        return action is not None and self._configuration.site.kinds[action.kind].protective
