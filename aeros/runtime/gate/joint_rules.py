"""Decides an action together with those under way: each was allowed by itself, now they are merged.

No actuator is moved by two of them, and every two obey every joint rule of the site, in either order of
the roles, at what is measured now; what is missing, malformed or stale then denies.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from aeros.runtime.gate.conditions import (
    CompiledCondition,
    ConditionValue,
    DecidableCondition,
    SolverCondition,
)
from aeros.runtime.gate.decision import Reason
from aeros.runtime.gate.request_check import unpack_reading
from aeros.runtime.gate.value_check import Scalars, ValueChecker
from aeros.runtime.ports import Readings
from aeros.skill import Action
from aeros.spec.expr import terms as t
from aeros.spec.model.model import JointRule, Site
from aeros.spec.obligations.joint import joint_variables


@dataclass(frozen=True, eq=False)
class ActiveAction:
    """An action as it was decided, on what, and when (plant seconds).

    record: the sequence number of that decision in the audit log.
    """

    action: Action
    readings: Readings
    decided_at: float
    record_number: int


class JointRules:
    """The joint rules of one site, ready to be decided of pairs of actions."""

    def __init__(self, site: Site, *, compiled: bool) -> None:
        self._site = site
        self._rules = [_JointRule(rule, site, compiled) for rule in site.joint_rules]

    def objections(self, action: ActiveAction, active_actions: Iterable[ActiveAction]) -> Iterator[Reason]:
        """Why `one`, which is decided on what is measured now, may not go on beside `active_actions`."""
        for other in active_actions:
            yield from self._shared_actuators(action, other)
            for rule, roles in self.rules_for_pair(action, other):
                yield from rule.objections(roles, action, other)

    def rules_for_pair(
        self, action: ActiveAction, active_action: ActiveAction
    ) -> Iterator[tuple[_JointRule, tuple[ActiveAction, ActiveAction]]]:
        """Each rule on both together, and who has its first and its second role."""
        for rule in self._rules:
            for roles in ((action, active_action), (active_action, action)):
                if rule.kinds == tuple(begun.action.kind for begun in roles):
                    yield rule, roles

    def _shared_actuators(self, action: ActiveAction, active_action: ActiveAction) -> Iterator[Reason]:
        moved, taken = (self._site.kinds[begun.action.kind].actuators for begun in (action, active_action))
        for actuator in sorted(moved & taken):
            text = f"`{actuator}` is being moved by the `{active_action.action.kind}` under way"
            yield Reason("AE752", actuator, text)


class _JointRule:
    """One joint rule: its condition, and the forms of what that reads of the state and of each role."""

    def __init__(self, rule: JointRule, site: Site, compiled: bool) -> None:
        declared = joint_variables(site, rule)
        self.id = rule.id
        self.term = rule.term
        self.kinds = tuple(kind for _, kind in rule.roles)
        self.condition: DecidableCondition = (
            CompiledCondition(rule.term, declared) if compiled else SolverCondition(rule.term, declared)
        )
        self._says = f"breaks `{rule.text}`: {rule.rationale}"
        forms = {one.name: ValueChecker(one) for one in declared if one.name in t.variables_of(rule.term)}
        self._now = {name: form for name, form in forms.items() if name in site.observed_variables}
        self._asked: list[dict[str, ValueChecker]] = []
        for role, kind in rule.roles:
            names = site.kinds[kind].parameters
            self._asked.append({name: forms[f"{role}.{name}"] for name in names if f"{role}.{name}" in forms})

    def values(self, roles: tuple[ActiveAction, ActiveAction]) -> Scalars:
        """What the rule reads of each role: parameters, which were of their forms when they were decided."""
        values: Scalars = {}
        for begun, forms in zip(roles, self._asked, strict=True):
            for name, form in forms.items():
                form.unpack(begun.action.parameters[name], values)
        return values

    def objections(
        self, roles: tuple[ActiveAction, ActiveAction], action: ActiveAction, active_action: ActiveAction
    ) -> Iterator[Reason]:
        """Why the two may not be under way together, where `one` is decided now."""
        values = self.values(roles)
        faults = list(_unpack_recorded(self._now, action, values))
        if faults:
            yield from faults
            return
        truth = self.condition.decide(values)
        if truth is ConditionValue.FAILS:
            yield Reason(
                "AE751", self.id, f"beside the `{active_action.action.kind}` under way it {self._says}"
            )
        elif truth is ConditionValue.UNDECIDED:
            yield Reason("AE790", self.id, f"the solver could not decide `{self.id}`")


def _unpack_recorded(
    checkers: dict[str, ValueChecker], active_action: ActiveAction, into: Scalars
) -> Iterator[Reason]:
    """Take what was measured when the action was decided; it must be there, and fresh."""
    for name, form in checkers.items():
        reading = active_action.readings.get(name)
        if reading is None:
            yield Reason("AE703", form.declared.name, f"`{form.declared.name}` is not measured")
            continue
        fault = unpack_reading(form, reading, active_action.decided_at, True, into)
        if fault is not None:
            yield fault
