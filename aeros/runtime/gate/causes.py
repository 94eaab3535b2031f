"""Why something was denied or stopped, as data: the condition, where it is written, what was measured."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from typing import Any, Final

from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import Caller, Decision, Reason
from aeros.runtime.gate.request_check import take_given, take_readings
from aeros.runtime.gate.value_check import Scalars, forms_of
from aeros.runtime.gate.violation import Violation
from aeros.runtime.ports import Readings
from aeros.skill import Action
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower
from aeros.spec.expr.shortfall import Shortfall, shortfalls
from aeros.spec.model.cause import Cause, place
from aeros.spec.model.model import Clause, Declared, JointRule, Rule, Site, Skill

_READINGS: Final = frozenset(("AE703", "AE704", "AE705", "AE706", "AE707"))


def causes_of_denial(
    configuration: Configuration,
    decision: Decision,
    caller: Caller,
    readings: Readings,
    asked: Action,
    now: float,
) -> tuple[Cause, ...]:
    """The reasons of a decision that did not simply allow `asked`, on what it was made."""
    return tuple(_Denial(configuration, caller, readings, asked, now).causes(decision))


def cause_of_stop(site: Site, rule: str, violation: Violation | None) -> Cause:
    """Why the monitor stopped what moved: a rule, or `input:NAME` of what was not measured as it should be.

    violation: what was measured, where it is of that rule.
    """
    kind, _, name = rule.partition(":")
    if kind == "input":
        part = Shortfall(name, None, "known", True, why="is not measured as it should be")
        at = place(site.state[name].span) if name in site.state else ""
        return Cause("reading", name, "every value that a rule reads is measured", at=at, shortfalls=(part,))
    parts = violation.shortfalls if violation is not None and violation.rule == rule else ()
    rules: tuple[Rule | JointRule, ...] = (*site.rules, *site.joint)
    for one in rules:
        if one.id == rule:
            return Cause("rule", rule, one.text, one.source, place(one.require_span), parts)
    return Cause("stopped", rule, rule)


class _Denial:
    """What a decision was made on."""

    def __init__(
        self, configuration: Configuration, caller: Caller, readings: Readings, asked: Action, now: float
    ) -> None:
        self._site = configuration.site
        self._module = configuration.modules.get(caller.module)
        self._skill: Skill | None = None if self._module is None else self._module.skills.get(caller.skill)
        self._asked = asked
        self._values: Scalars = {}
        kind = self._site.kinds.get(asked.kind)
        parameters: Mapping[str, Declared] = {} if kind is None else kind.parameters
        inputs = {} if self._skill is None else self._skill.inputs
        given = {f"inputs.{name}": value for name, value in caller.inputs.items()}
        for faults in (
            take_given(forms_of(parameters), asked.parameters, "", self._values),
            take_given(forms_of(inputs), given, "", self._values),
            take_readings(forms_of(self._site.observed), readings, now, frozenset(), self._values),
        ):
            deque(faults, maxlen=0)  # they are among the reasons

    def causes(self, decision: Decision) -> Iterator[Cause]:
        for reason in decision.reasons:
            yield self._of_rule(reason) or self._of_clause(reason) or self._other(reason)

    def _of_rule(self, reason: Reason) -> Cause | None:
        for one in self._site.rules if reason.code == "AE750" else ():
            if one.id == reason.rule and self._asked.kind in one.terms:
                parts = self._parts(one.terms[self._asked.kind])
                at = place(one.require_span)
                return Cause("rule", one.id, one.text, one.source, at, parts, reason.code)
        for joint in self._site.joint if reason.code == "AE751" else ():
            if joint.id == reason.rule:
                at = place(joint.require_span)
                return Cause("rule", joint.id, joint.text, joint.source, at, code=reason.code)
        return None

    def _of_clause(self, reason: Reason) -> Cause | None:
        """Envelope or permission."""
        found: Clause | None = None
        if reason.code == "AE730" and self._skill is not None:
            kind, found = "envelope", self._skill.envelope.get(self._asked.kind)
        elif reason.code == "AE731" and self._module is not None:
            kind, found = "permission", self._module.permission.get(self._asked.kind)
        if found is None:
            return None
        at, parts = place(found.span), self._parts(found.term)
        return Cause(kind, reason.rule, found.text, at=at, shortfalls=parts, code=reason.code)

    def _other(self, reason: Reason) -> Cause:
        if reason.code in _READINGS and reason.rule in self._site.observed:
            declared = self._site.observed[reason.rule]
            why = reason.text.partition("` ")[2] or reason.text
            part = Shortfall(reason.rule, None, "known", True, why=why)
            return Cause(
                "reading",
                reason.rule,
                reason.text,
                at=place(declared.span),
                shortfalls=(part,),
                code=reason.code,
            )
        block = next((one for one in self._site.blocks if one.id == reason.rule), None)
        at = (
            place(block.span)
            if reason.code == "AE710" and block is not None and block.span is not None
            else ""
        )
        return Cause("gate", reason.rule, reason.text, at=at, code=reason.code)

    def _parts(self, term: t.Term) -> tuple[Shortfall, ...]:
        known: Mapping[str, Any] = self._values
        return shortfalls(term, known) if t.variables_of(lower(term)).keys() <= known.keys() else ()
