"""Causes of denials and stops as data: the condition, its place in a file, and the measured values."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import Caller, Decision, Reason
from aeros.runtime.gate.request_check import unpack_arguments, unpack_readings
from aeros.runtime.gate.value_check import Scalars, ValueChecker, value_checkers
from aeros.runtime.gate.violation import MotionDeviation, RuleViolation
from aeros.runtime.ports import Readings
from aeros.skill import Action
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower
from aeros.spec.expr.shortfall import UnmetBound, unmet_bounds
from aeros.spec.model.cause import Cause, file_and_line
from aeros.spec.model.ecm import ActionCondition, Skill
from aeros.spec.model.rules import JointRule, Rule
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared

_READING_REASON_CODES: Final = frozenset(("AE703", "AE704", "AE705", "AE706", "AE707"))


def denial_causes(
    configuration: Configuration,
    decision: Decision,
    caller: Caller,
    readings: Readings,
    requested_action: Action,
    now: float,
) -> tuple[Cause, ...]:
    """Explain each reason of a denial or attenuation as data.

    Args:
        configuration: the configuration that the gate decided under.
        decision: the gate's decision.
        caller: the skill that asked, as the gate was given it.
        readings: the readings that the gate was given.
        requested_action: the action that the skill asked for, before any attenuation.
        now: the time that the gate was given, s.

    Returns:
        One cause for each reason of the decision, in the same order; none if it is ALLOW.
    """
    return tuple(_Denial(configuration, caller, readings, requested_action, now).causes(decision))


def stop_cause(site: Site, rule: str, violation: RuleViolation | MotionDeviation | None) -> Cause:
    """Explain as data why the monitor stopped a motion.

    Args:
        site: the site whose rules the monitor watched.
        rule: the id of the violated rule, or `input:NAME` for a value that was missing or malformed.
        violation: the measured values at the violation, if the monitor has them; those of another rule are
            ignored.

    Returns:
        The cause, with the unmet bounds if they are known.
    """
    kind, _, name = rule.partition(":")
    if kind == "input":
        part = UnmetBound(name, None, "known", True, reason="is missing, old or malformed")
        at = file_and_line(site.state[name].span) if name in site.state else ""
        return Cause(
            "reading", name, "every value that a rule reads is measured", location=at, shortfalls=(part,)
        )
    parts = violation.unmet_bounds if violation is not None and violation.rule == rule else ()
    rules: tuple[Rule | JointRule, ...] = (*site.rules, *site.joint_rules)
    for one in rules:
        if one.id == rule:
            return Cause("rule", rule, one.text, one.source, file_and_line(one.require_span), parts)
    return Cause("stopped", rule, rule, shortfalls=parts)


def collect_arguments(
    checkers: Mapping[str, ValueChecker], given: Mapping[str, Any], values: Scalars
) -> None:
    """Unpack the well-formed parameters or inputs into scalars, and leave out the others.

    Args:
        checkers: the declared parameters or inputs, by name.
        given: the values, by name; a missing one takes its declared default.
        values: receives each well-formed scalar, by scalar variable.
    """
    for _ in unpack_arguments(checkers, given, "", values):
        pass  # the gate objects to them


class _Denial:
    """The request that a decision was made on, with the values of its variables."""

    def __init__(
        self,
        configuration: Configuration,
        caller: Caller,
        readings: Readings,
        requested_action: Action,
        now: float,
    ) -> None:
        self._site = configuration.site
        self._module = configuration.modules.get(caller.module)
        self._skill: Skill | None = None if self._module is None else self._module.skills.get(caller.skill)
        self._asked = requested_action
        self._values: Scalars = {}
        kind = self._site.kinds.get(requested_action.kind)
        parameters: Mapping[str, Declared] = {} if kind is None else kind.parameters
        inputs = {} if self._skill is None else self._skill.inputs
        given = {f"inputs.{name}": value for name, value in caller.inputs.items()}
        collect_arguments(value_checkers(parameters), requested_action.parameters, self._values)
        collect_arguments(value_checkers(inputs), given, self._values)
        state = value_checkers(self._site.observed_variables)
        list(unpack_readings(state, readings, now, frozenset(), self._values))  # the reasons have the faults

    def causes(self, decision: Decision) -> Iterator[Cause]:
        for reason in decision.reasons:
            yield self._rule_cause(reason) or self._envelope_cause(reason) or self._other_cause(reason)

    def _rule_cause(self, reason: Reason) -> Cause | None:
        for rule in self._site.rules if reason.code == "AE750" else ():
            if rule.id == reason.rule and self._asked.kind in rule.terms:
                parts = self._unmet_bounds(rule.terms[self._asked.kind])
                at = file_and_line(rule.require_span)
                return Cause("rule", rule.id, rule.text, rule.source, at, parts, reason.code)
        for joint in self._site.joint_rules if reason.code == "AE751" else ():
            if joint.id == reason.rule:
                at = file_and_line(joint.require_span)
                return Cause("rule", joint.id, joint.text, joint.source, at, code=reason.code)
        return None

    def _envelope_cause(self, reason: Reason) -> Cause | None:
        """Return the cause of a violated envelope or permission; None of other reasons."""
        condition: ActionCondition | None = None
        if reason.code == "AE730" and self._skill is not None:
            kind, condition = "envelope", self._skill.envelope.get(self._asked.kind)
        elif reason.code == "AE731" and self._module is not None:
            kind, condition = "permission", self._module.permitted_actions.get(self._asked.kind)
        if condition is None:
            return None
        location, parts = file_and_line(condition.span), self._unmet_bounds(condition.term)
        return Cause(kind, reason.rule, condition.text, location=location, shortfalls=parts, code=reason.code)

    def _other_cause(self, reason: Reason) -> Cause:
        if reason.code in _READING_REASON_CODES and reason.rule in self._site.observed_variables:
            declared = self._site.observed_variables[reason.rule]
            why = reason.text.partition("` ")[2] or reason.text
            part = UnmetBound(reason.rule, None, "known", True, reason=why)
            return Cause(
                "reading",
                reason.rule,
                reason.text,
                location=file_and_line(declared.span),
                shortfalls=(part,),
                code=reason.code,
            )
        block = next((override for override in self._site.blocks if override.id == reason.rule), None)
        at = (
            file_and_line(block.span)
            if reason.code == "AE710" and block is not None and block.span is not None
            else ""
        )
        return Cause("gate", reason.rule, reason.text, location=at, code=reason.code)

    def _unmet_bounds(self, term: t.Term) -> tuple[UnmetBound, ...]:
        known: Mapping[str, Any] = self._values
        return unmet_bounds(term, known) if t.variables_of(lower(term)).keys() <= known.keys() else ()
