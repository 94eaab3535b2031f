"""Everything that an executor decides by: gate, whole motions, quotas, histories and monitors, as one.

`decide` looks at the state once, decides the action by itself, then together with what is under way, then
the motion that it becomes, and has it all in the record, durable, before it returns.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from aeros.runtime.audit.log import AuditLog
from aeros.runtime.canonical_json import digest_of
from aeros.runtime.execution.step import ActiveMotion
from aeros.runtime.gate.causes import denial_causes
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import Caller, Decision, DecisionKind
from aeros.runtime.gate.joint_rules import ActiveAction
from aeros.runtime.gate.port import Gate
from aeros.runtime.gate.quotas import ClockError, QuotaUsageCounter, clock_denial
from aeros.runtime.monitor.history import HistoryTracker
from aeros.runtime.monitor.monitor import RuntimeMonitor
from aeros.runtime.motion.merged import ConcurrentMotion, concurrent_motions
from aeros.runtime.motion.trajectory import MotionDecider
from aeros.runtime.ports import PlannedMotion, Plant, Readings, Trajectory
from aeros.runtime.records.encode_decisions import IncrementalDecisionEncoder
from aeros.runtime.records.records import DecisionRecord, body_to_json
from aeros.runtime.records.recount import SessionState
from aeros.skill import Action
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.model.cause import Cause


class PipelineDecision(NamedTuple):
    """What was decided and recorded.

    begun: the action that may be executed, as from now on it is under way; None where it was denied.
    plan: what the plant said it would be, where it was asked.
    ends_others: it is a protective stop, which is not denied for what moves but ends that.
    causes: why it was not simply allowed, as data.
    """

    decision: Decision
    active_action: ActiveAction | None
    plan: PlannedMotion | None
    is_protective_stop: bool
    causes: tuple[Cause, ...] = ()


class DecisionPipeline:
    """Decides under one configuration, and from `switch_configuration` on under another."""

    def __init__(self, configuration: Configuration, gate: Gate, plant: Plant, audit: AuditLog) -> None:
        self._configuration = configuration
        self._gate = gate
        self._plant = plant
        self._audit = audit
        self._histories = HistoryTracker(configuration.site)
        self._motions = MotionDecider(configuration.site.motion)
        self._usage = QuotaUsageCounter(configuration.site.quotas)
        self.monitors = RuntimeMonitor(gate.monitor_rules, self._histories)
        self._teller = IncrementalDecisionEncoder()
        self._body: tuple[object, str] | None = None  # the last that was recorded, and its digest

    def switch_configuration(self, configuration: Configuration) -> None:
        """Decide under `configuration` from now on; nothing may be under way.

        Under the same site histories and quotas go on; under another, histories begin anew.
        """
        site = configuration.site
        self._gate = self._gate.with_configuration(configuration)
        if site.digest != self._configuration.site.digest:
            self._histories = HistoryTracker(site)
            self._motions = MotionDecider(site.motion)
            self._usage = self._usage.set_quotas(site.quotas)
            self.monitors = RuntimeMonitor(self._gate.monitor_rules, self._histories)
        self._configuration = configuration

    def resume_from(self, recount: SessionState) -> None:
        """Go on with what an earlier session under the same site had counted and seen."""
        self._usage, self._histories = recount.usage, recount.histories
        self.monitors = RuntimeMonitor(self._gate.monitor_rules, self._histories)

    def decide(
        self, caller: Caller, requested_action: Action, active_motions: Sequence[ActiveMotion]
    ) -> PipelineDecision:
        """Decide what `caller` asks for, on what is measured now."""
        # In this order: a reading is never younger than the time it is judged at.
        measured = self._plant.observe()
        now = self._plant.now()
        readings = self._histories.update(measured, now)
        gated, usage = self._decide_alone(caller, readings, requested_action, now)
        ends_others = self._is_protective(gated)
        others = () if ends_others else active_motions
        if others:
            gated = self._gate.decide_jointly(gated, readings, now, [other.active_action for other in others])
        companions: Sequence[ConcurrentMotion] = ()
        if others:
            companions = concurrent_motions(
                ((one.active_action, one.plan, one.is_halting) for one in others), now
            )
        decision, plan, motion = self._decide_motion(gated, readings, companions)
        digest, beside = self._configuration.digest, [other.active_action.record_number for other in others]
        halting = [other.active_action.record_number for other in others if other.is_halting]
        causes: tuple[Cause, ...] = ()
        if decision.kind is not DecisionKind.ALLOW:
            causes = denial_causes(self._configuration, decision, caller, readings, requested_action, now)
        made = DecisionRecord(
            decision, digest, now, readings, caller, requested_action, usage, beside, halting, motion, causes
        )
        details = self._teller.encode(made)
        record = self._audit.append("decision", details)
        if decision.kind is DecisionKind.DENY:
            return PipelineDecision(decision, None, plan, is_protective_stop=False, causes=causes)
        if decision.action is None:
            raise InternalError(f"the gate said {decision.kind.value} and gave no action")
        return PipelineDecision(
            decision, ActiveAction(decision.action, readings, now, record), plan, ends_others
        )

    def count_execution(self, active_action: ActiveAction) -> None:
        """Count an action that is about to begin: one that fails half-way was executed too."""
        self._usage.count_execution(active_action.action.kind, active_action.decided_at)

    def _decide_alone(
        self, caller: Caller, readings: Readings, requested_action: Action, now: float
    ) -> tuple[Decision, Mapping[str, int] | None]:
        """The decision, and the use of quotas that it was made on."""
        try:
            usage = self._usage.usage_at(now)
        except ClockError as wrong:
            return clock_denial(wrong), None
        return self._gate.decide(caller, readings, requested_action, now, usage), usage

    def _decide_motion(
        self, gated: Decision, readings: Readings, concurrent_motions: Sequence[ConcurrentMotion]
    ) -> tuple[Decision, PlannedMotion | None, Mapping[str, Any]]:
        """What the whole motion makes of the decision, that motion, and what the record is to say of it.

        None and nothing where there is no motion to decide.
        """
        action = gated.action
        if action is None or not self._motions.covers_kind(action.kind):
            return gated, None, {}
        plan = self._plant.plan(action)
        decision = self._motions.decide(gated, plan, readings, concurrent_motions)
        body = self._record_robot_body(plan.body) if type(plan) is Trajectory else ""
        return decision, plan, self._teller.encode_motion(plan, body, gated, decision)

    def _record_robot_body(self, body: object) -> str:
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
