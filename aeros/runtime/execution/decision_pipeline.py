"""Decision pipeline of the executor: gate, whole motions, quotas, histories and monitors behind one call.

`decide` reads the state once. It decides the action alone, then jointly with the active actions, then the
motion that the action becomes. The decision is durably recorded before `decide` returns.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from aeros.runtime.audit.log import AuditLog
from aeros.runtime.canonical_json import digest_of
from aeros.runtime.execution.detour_search import DetourSearch
from aeros.runtime.execution.step import ActiveMotion
from aeros.runtime.gate.causes import denial_causes
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import Caller, Decision, DecisionKind
from aeros.runtime.gate.gate import GateDisagreementError
from aeros.runtime.gate.joint_rules import ActiveAction
from aeros.runtime.gate.port import Gate
from aeros.runtime.gate.quotas import ClockError, QuotaUsageCounter, clock_denial
from aeros.runtime.monitor.history import HistoryTracker
from aeros.runtime.monitor.monitor import RuntimeMonitor
from aeros.runtime.motion.merged import ConcurrentMotion, concurrent_motions
from aeros.runtime.motion.trajectory import MotionDecider
from aeros.runtime.ports import PlannedMotion, Plant, Readings, Snapshot, Trajectory, known_obstacles
from aeros.runtime.records.encode_decisions import IncrementalDecisionEncoder
from aeros.runtime.records.obstacle_json import obstacles_to_json
from aeros.runtime.records.records import (
    DecisionRecord,
    body_to_json,
    caller_details,
    disagreement_details,
)
from aeros.runtime.records.recount import SessionState
from aeros.skill import Action
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.model.cause import Cause


class PipelineDecision(NamedTuple):
    """Outcome of `DecisionPipeline.decide`, recorded already.

    Attributes:
        decision: the gate's decision, after the check of the whole motion.
        active_action: the action that may be executed and counts as active from now on; None if denied.
        plan: the motion that the plant planned; None if the plant was not asked.
        is_protective_stop: the action is a protective stop. It is never denied because of other motions;
            it ends them.
        causes: why the action was denied or attenuated, as data; empty if it was allowed.
    """

    decision: Decision
    active_action: ActiveAction | None
    plan: PlannedMotion | None
    is_protective_stop: bool
    causes: tuple[Cause, ...] = ()


class DecisionPipeline:
    """Everything that one executor decides with, under one configuration at a time.

    Attributes:
        monitors: the runtime monitor; called at every control tick.
    """

    def __init__(self, configuration: Configuration, gate: Gate, plant: Plant, audit: AuditLog) -> None:
        self._configuration = configuration
        self._gate = gate
        self._plant = plant
        self._audit = audit
        self._histories = HistoryTracker(configuration.site)
        self._motions = MotionDecider(configuration.site.motion)
        self._usage = QuotaUsageCounter(configuration.site.quotas)
        self.monitors = RuntimeMonitor(gate.monitor_rules, self._histories)
        self._encoder = IncrementalDecisionEncoder()
        self._body: tuple[object, str] | None = None  # the latest recorded body, and its digest
        # Readings, plant time and use of quotas of the latest decision; None if the use was unknown.
        self._latest: tuple[Readings, float, Mapping[str, int]] | None = None

    def switch_configuration(self, configuration: Configuration) -> None:
        """Decide under another configuration from now on. No motion may be active.

        If the site is the same, histories and quota counts go on. If it is another, histories start empty.

        Args:
            configuration: the new configuration.
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
        """Go on with the quota counts and histories of an earlier session under the same site.

        Args:
            recount: counts and histories rebuilt from the audit log.
        """
        self._usage, self._histories = recount.usage, recount.histories
        self.monitors = RuntimeMonitor(self._gate.monitor_rules, self._histories)

    def decide(
        self, caller: Caller, requested_action: Action, active_motions: Sequence[ActiveMotion]
    ) -> PipelineDecision:
        """Decide a requested action on the current readings, and record the decision.

        Args:
            caller: module, skill and inputs of the request.
            requested_action: the action, with the parameters that the skill gave.
            active_motions: motions of other steps that have not come to rest.

        Returns:
            The decision, with the action to execute unless it was denied.

        Raises:
            AuditError: the decision cannot be recorded, so nothing may move.
            GateDisagreementError: the compiled gate and Z3 decide differently, which is recorded.
            InternalError: the gate allowed something and named no action.
        """
        # Readings before the clock, so that no reading is younger than `now`.
        measured = self._plant.observe()
        now = self._plant.now()
        readings = self._histories.update(measured, now) if self._histories.names else _kept(measured)
        try:
            gated, usage = self._decide_alone(caller, readings, requested_action, now)
            self._latest = None if usage is None else (readings, now, usage)
            is_protective_stop = self._is_protective(gated)
            others = () if is_protective_stop else active_motions
            active_actions = [other.active_action for other in others]
            if others:
                gated = self._gate.decide_jointly(gated, readings, now, active_actions)
        except GateDisagreementError as found:
            digest = self._configuration.digest
            record = DecisionRecord(found.compiled, digest, now, readings, caller, requested_action, None)
            self._audit.append("gate-disagreement", disagreement_details(record, found.z3))
            raise
        companions: Sequence[ConcurrentMotion] = ()
        if others:
            companions = concurrent_motions(
                ((other.active_action, other.plan, other.is_halting) for other in others), now
            )
        decision, plan, motion = self._decide_motion(gated, readings, companions)
        digest = self._configuration.digest
        concurrent_records = [one.record_number for one in active_actions]
        halting = [other.active_action.record_number for other in others if other.is_halting]
        causes: tuple[Cause, ...] = ()
        if decision.kind is not DecisionKind.ALLOW:
            causes = denial_causes(self._configuration, decision, caller, readings, requested_action, now)
        record = DecisionRecord(
            decision,
            digest,
            now,
            readings,
            caller,
            requested_action,
            usage,
            concurrent_records,
            halting,
            motion,
            causes,
        )
        details = self._encoder.encode(record)
        record_number = self._audit.append("decision", details)
        if decision.kind is DecisionKind.DENY:
            return PipelineDecision(decision, None, plan, is_protective_stop=False, causes=causes)
        if decision.action is None:
            raise InternalError(f"the gate decided {decision.kind.value} and returned no action")
        active_action = ActiveAction(decision.action, readings, now, record_number)
        return PipelineDecision(decision, active_action, plan, is_protective_stop, causes)

    def find_detour(self, caller: Caller, denied: Decision, action: Action) -> list[Action] | None:
        """Find a way round what was in the way of the motion that was decided last; nothing has moved since.

        Each leg is an action like the one that was denied, with another target. The gate and the check of
        whole motions decide it here as they will when it is its turn.

        Args:
            caller: module, skill and inputs of the request.
            denied: the decision.
            action: the action that it denied.

        Returns:
            The actions in order, the denied one last; None if obstacles are not the only reason, or no way
            was found.
        """
        if self._latest is None:
            return None
        readings, now, usage = self._latest
        search = DetourSearch(
            self._configuration.site.motion, self._gate, self._motions, self._plant, readings, now, usage
        )
        found = search.find(caller, denied, action)
        if found is not None:
            details = {
                "time": now,
                **caller_details(caller),
                "asked": {"kind": action.kind, "parameters": dict(action.parameters)},
                "round": list(dict.fromkeys(reason.rule for reason in denied.reasons)),
                "targets": found.targets,
            }
            self._audit.append("detour", details)
        return None if found is None else found.legs

    def count_execution(self, active_action: ActiveAction) -> None:
        """Count an action against its quotas, just before it begins.

        An action that fails half-way counts too.

        Args:
            active_action: the action, with the plant time (s) of its decision.
        """
        self._usage.count_execution(active_action.action.kind, active_action.decided_at)

    def _decide_alone(
        self, caller: Caller, readings: Readings, requested_action: Action, now: float
    ) -> tuple[Decision, Mapping[str, int] | None]:
        """Decide the action without regard to others; return the decision and the quota usage behind it."""
        try:
            usage = self._usage.usage_at(now)
        except ClockError as wrong:
            return clock_denial(wrong), None
        return self._gate.decide(caller, readings, requested_action, now, usage), usage

    def _decide_motion(
        self, gated: Decision, readings: Readings, concurrent_motions: Sequence[ConcurrentMotion]
    ) -> tuple[Decision, PlannedMotion | None, Mapping[str, Any]]:
        """Check the whole motion; return the decision, the planned motion and the record's details about it.

        Without a motion to check, the gate's decision is returned with None and no details.
        """
        action = gated.action
        if action is None or not self._motions.covers_kind(action.kind):
            return gated, None, {}
        plan, obstacles = self._plant.plan(action), known_obstacles(self._plant)
        decision = self._motions.decide(gated, plan, readings, concurrent_motions, obstacles)
        body = self._record_robot_body(plan.body) if type(plan) is Trajectory else ""
        details = self._encoder.encode_motion(plan, body, gated, decision)
        if obstacles:
            details = {**details, "obstacles": obstacles_to_json(obstacles)}
        return decision, plan, details

    def _record_robot_body(self, body: object) -> str:
        """Record the robot's body unless the latest recorded one is the same, and return its digest."""
        if self._body is None or body is not self._body[0]:
            encoded_body = body_to_json(body)
            digest = digest_of(encoded_body)
            if self._body is None or digest != self._body[1]:
                self._audit.append("body", {"body": encoded_body})
            self._body = (body, digest)
        return self._body[1]

    def _is_protective(self, decision: Decision) -> bool:
        action = decision.action
        return action is not None and self._configuration.site.kinds[action.kind].protective


def _kept(readings: Readings) -> Readings:
    """Return readings that do not change when the plant measures again."""
    return readings if type(readings) is Snapshot else dict(readings)
