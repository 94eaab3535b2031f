"""Decisions about several actions under way at once, each of which was allowed by itself.

No two of them may move the same actuator, and every two obey every joint rule of the site, in either order of
the roles, at the values measured now. Values that are missing, malformed or stale lead to a denial.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from aeros.runtime.gate.conditions import (
    CompiledCondition,
    ConditionValue,
    DecidableCondition,
    GateSolver,
    SolverCondition,
)
from aeros.runtime.gate.decision import Reason
from aeros.runtime.gate.request_check import unpack_reading
from aeros.runtime.gate.value_check import Scalars, ValueChecker
from aeros.runtime.ports import Readings
from aeros.skill import Action
from aeros.spec.expr import terms as t
from aeros.spec.model.rules import JointRule
from aeros.spec.model.site import Site
from aeros.spec.obligations.joint import joint_variables


@dataclass(frozen=True, eq=False)
class ActiveAction:
    """An action that was allowed, and the request it was decided on.

    Attributes:
        action: the action as it was decided, parameters in SI.
        readings: the readings of that decision.
        decided_at: the time of that decision, plant seconds.
        record_number: the sequence number of that decision in the audit log.
    """

    action: Action
    readings: Readings
    decided_at: float
    record_number: int


class JointRules:
    """The joint rules of one site, prepared for decisions about pairs of actions.

    Args:
        compiled: decide by compiled functions; otherwise Z3 decides, with `solver` or one of their own.
    """

    def __init__(self, site: Site, *, compiled: bool, solver: GateSolver | None = None) -> None:
        self._site = site
        self._rules = [
            _JointRule(rule, site, None if compiled else solver or GateSolver()) for rule in site.joint_rules
        ]

    def objections(self, action: ActiveAction, active_actions: Iterable[ActiveAction]) -> Iterator[Reason]:
        """List the reasons why an action may not begin while others are under way.

        Args:
            action: the new action, with the present readings (SI) and plant time (s).
            active_actions: the actions under way.

        Yields:
            Each objection.
        """
        for other in active_actions:
            yield from self._shared_actuators(action, other)
            yield from self._grip_conflicts(action, other)
            for rule, roles in self.rules_for_pair(action, other):
                yield from rule.objections(roles, action, other)

    def rules_for_pair(
        self, action: ActiveAction, active_action: ActiveAction
    ) -> Iterator[tuple[_JointRule, tuple[ActiveAction, ActiveAction]]]:
        """List the joint rules that apply to two actions together.

        Args:
            action: one action.
            active_action: the other.

        Yields:
            Each rule, with the actions in the order of its first and its second role.
        """
        for rule in self._rules:
            for roles in ((action, active_action), (active_action, action)):
                if rule.kinds == tuple(active.action.kind for active in roles):
                    yield rule, roles

    def _shared_actuators(self, action: ActiveAction, active_action: ActiveAction) -> Iterator[Reason]:
        moved, occupied = (self._site.kinds[one.action.kind].actuators for one in (action, active_action))
        for actuator in sorted(moved & occupied):
            text = f"`{actuator}` is being moved by the `{active_action.action.kind}` under way"
            yield Reason("AE752", actuator, text)

    def _grip_conflicts(self, action: ActiveAction, active_action: ActiveAction) -> Iterator[Reason]:
        """Report a motion while something is gripped or released: what moves depends on what is held."""
        motion = self._site.motion
        if motion is None or motion.held is None:
            return
        kind, other = action.action.kind, active_action.action.kind
        grips, moves = motion.held.gripped_by, motion.kinds
        if (kind in grips and other in moves) or (kind in moves and other in grips):
            text = f"the `{other}` under way: what is held may change, and the motion's volume with it"
            yield Reason("AE764", kind, text)


class _JointRule:
    """One joint rule, with checkers of the state variables and of each role's parameters that it reads."""

    def __init__(self, rule: JointRule, site: Site, solver: GateSolver | None) -> None:
        declared = joint_variables(site, rule, t.variables_of(rule.term))
        self.id = rule.id
        self.term = rule.term
        self.kinds = tuple(kind for _, kind in rule.roles)
        self.condition: DecidableCondition = (
            CompiledCondition(rule.term, declared)
            if solver is None
            else SolverCondition(rule.term, declared, solver)
        )
        self._says = f"breaks `{rule.text}`: {rule.rationale}"
        forms = {one.name: ValueChecker(one) for one in declared if one.name in t.variables_of(rule.term)}
        self._now = {name: form for name, form in forms.items() if name in site.observed_variables}
        self._asked: list[dict[str, ValueChecker]] = []
        for role, kind in rule.roles:
            names = site.kinds[kind].parameters
            self._asked.append({name: forms[f"{role}.{name}"] for name in names if f"{role}.{name}" in forms})

    def values(self, roles: tuple[ActiveAction, ActiveAction]) -> Scalars:
        """Return the parameters that the rule reads; they were checked when their action was decided."""
        values: Scalars = {}
        for active, forms in zip(roles, self._asked, strict=True):
            for name, form in forms.items():
                form.unpack(active.action.parameters[name], values)
        return values

    def objections(
        self, roles: tuple[ActiveAction, ActiveAction], action: ActiveAction, active_action: ActiveAction
    ) -> Iterator[Reason]:
        """List the reasons why the two may not be under way together; `action` is decided now."""
        values = self.values(roles)
        faults = list(_unpack_recorded(self._now, action, values))
        if faults:
            yield from faults
            return
        truth = self.condition.decide(values)
        if truth is ConditionValue.FAILS:
            yield Reason(
                "AE751", self.id, f"together with the `{active_action.action.kind}` under way it {self._says}"
            )
        elif truth is ConditionValue.UNDECIDED:
            yield Reason("AE790", self.id, f"the solver could not decide `{self.id}`")


def _unpack_recorded(
    checkers: dict[str, ValueChecker], active_action: ActiveAction, into: Scalars
) -> Iterator[Reason]:
    """Unpack the readings that `active_action` was decided on; report missing, malformed and stale ones."""
    for name, form in checkers.items():
        reading = active_action.readings.get(name)
        if reading is None:
            yield Reason("AE703", form.declared.name, f"`{form.declared.name}` is not measured")
            continue
        fault = unpack_reading(form, reading, active_action.decided_at, True, into)
        if fault is not None:
            yield fault
