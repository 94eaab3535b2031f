"""Everything that an executor decides by: gate, whole motions, quotas, histories and monitors, as one.

`decide` looks at the state once, decides the action by itself, then together with what is under way, then
the motion that it becomes, and has it all in the record, durable, before it returns.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from aeros.runtime.audit import AuditLog
from aeros.runtime.beside import Begun
from aeros.runtime.configuration import Configuration
from aeros.runtime.decision import Caller, Decision, Verdict
from aeros.runtime.gate import Gate
from aeros.runtime.history import Histories
from aeros.runtime.merging import Companion
from aeros.runtime.monitor import Monitors
from aeros.runtime.ports import Plan, Plant, Reading, Readings, Trajectory
from aeros.runtime.records import decision_details, motion_details
from aeros.runtime.step import UnderWay
from aeros.runtime.trajectory import MotionDecider, motion_digest
from aeros.runtime.usage import ClockError, Usage, denied_by_clock
from aeros.skill import Action
from aeros.spec.errors import InternalError


class Decided(NamedTuple):
    """What was decided and recorded.

    begun: the action that may be executed, as from now on it is under way; None where it was denied.
    plan: what the plant said it would be, where it was asked.
    ends_others: it is a protective stop, which is not denied for what moves but ends that.
    """

    decision: Decision
    begun: Begun | None
    plan: Plan | None
    ends_others: bool


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
        self.monitors = Monitors(configuration.site, self._histories)

    def follow(self, configuration: Configuration) -> None:
        """Decide under `configuration` from now on; nothing may be under way.

        Under the same site histories and quotas go on; under another, histories begin anew.
        """
        site = configuration.site
        if site.digest != self._configuration.site.digest:
            self._histories = Histories(site)
            self._motions = MotionDecider(site.motion)
            self._usage = self._usage.under(site.quotas)
            self.monitors = Monitors(site, self._histories)
        self._configuration = configuration
        self._gate = self._gate.under(configuration)

    def decide(self, caller: Caller, asked: Action, under_way: Sequence[UnderWay]) -> Decided:
        """Decide what `caller` asks for, on what is measured now."""
        # In this order: a reading is never younger than the time it is judged at.
        measured = self._plant.observe()
        now = self._plant.now()
        names = self._histories.names
        readings = {name: one for name, one in measured.items() if name not in names}
        known = self._histories.advance(readings, now)
        readings |= {name: Reading(value, now) for name, value in known.items()}
        gated, usage = self._decide_alone(caller, readings, asked, now)
        ends_others = self._is_protective(gated)
        others = () if ends_others else under_way
        if others:
            gated = self._gate.decide_beside(gated, readings, now, [other.begun for other in others])
        decision, plan = self._decide_motion(gated, readings, companions_of(others, now))
        digest, beside = self._configuration.digest, [other.begun.record for other in others]
        halting = [other.begun.record for other in others if other.is_halting]
        details = decision_details(decision, digest, now, readings, caller, asked, usage, beside, halting)
        details = {**motion_details(gated, decision, motion_digest(plan)), **details}
        record = self._audit.append("decision", details)
        if decision.verdict is Verdict.DENY:
            return Decided(decision, None, plan, ends_others=False)
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
        self, decision: Decision, readings: Readings, others: Sequence[Companion]
    ) -> tuple[Decision, Plan | None]:
        """What the whole motion makes of the decision, and that motion, where there is one to decide."""
        action = decision.action
        if action is None or not self._motions.governs(action.kind):
            return decision, None
        plan = self._plant.plan(action)
        return self._motions.decide(decision, plan, readings, others), plan

    def _is_protective(self, decision: Decision) -> bool:
        action = decision.action
        return action is not None and self._configuration.site.kinds[action.kind].protective


def companions_of(under_way: Sequence[UnderWay], now: float) -> list[Companion]:
    """Those that move the robot's body, as a motion beside them is decided."""
    return [
        Companion(one.begun.action, one.plan, now - one.begun.time, one.is_halting)
        for one in under_way
        if isinstance(one.plan, Trajectory)
    ]
