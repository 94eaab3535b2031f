"""Elaboration of a module's skills: inputs, outputs, conditions, outcomes, envelope and timeout."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Final

from aeros.spec.declared import ecm as declared
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.elaborate.expressions import elaborate_quantity
from aeros.spec.elaborate.module.action_conditions import (
    elaborate_action_condition,
    elaborate_action_conditions,
    elaborate_hold,
)
from aeros.spec.elaborate.module.effects import elaborate_effects
from aeros.spec.elaborate.module.interfaces import elaborate_inputs, elaborate_outputs
from aeros.spec.elaborate.names import resolve_models, resolve_name, resolve_need
from aeros.spec.elaborate.scopes import state_scope
from aeros.spec.elaborate.values import elaborate_verdict
from aeros.spec.expr.units import TIME, format_number, parse_quantity
from aeros.spec.model.configured import BoundNames, site_names
from aeros.spec.model.ecm import ActionCondition, Outcome, Skill
from aeros.spec.model.hold_conditions import start_condition
from aeros.spec.model.models import ModuleModel
from aeros.spec.model.rules import Risk
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared
from aeros.spec.text.fields import ExpressionField, MappingField, TextField

ANY_RULE: Final = "any"
"""Word under `gated` for all invariants that an envelope does not imply, whatever the site calls them."""


def elaborate_skill(
    name: TextField,
    skill: declared.Skill,
    site: Site,
    names: BoundNames,
    models: Mapping[str, ModuleModel],
    diagnostics: Diagnostics,
) -> Skill:
    """Elaborate a declared skill.

    Args:
        name: name of the skill.
        skill: the declared skill.
        site: site under which the module is elaborated.
        names: the site's names for what the module needs.
        models: models of the module by name.
        diagnostics: receives the faults.

    Returns:
        The skill, without the parts that have a fault.
    """
    return _SkillElaborator(site, names, models, diagnostics).skill(name, skill)


class _SkillElaborator:
    def __init__(
        self, site: Site, names: BoundNames, models: Mapping[str, ModuleModel], diagnostics: Diagnostics
    ) -> None:
        self._site = site
        self._names = names
        self._models = models
        self._diagnostics = diagnostics

    def skill(self, name: TextField, skill: declared.Skill) -> Skill:
        inputs = elaborate_inputs(skill.inputs, self._site, self._diagnostics)
        precondition = self._state_condition(skill.precondition, inputs)
        hold = elaborate_hold(skill.hold, self._site, self._diagnostics, inputs)
        outputs = elaborate_outputs(skill.outputs, self._site, self._diagnostics)
        resources = {**self._site.resources, **dict.fromkeys(self._names.resources)}
        for resource in skill.resources:
            resolve_need(resource, resources, "resource", self._diagnostics)
        if not skill.envelope:
            self._diagnostics.error(
                "AE503",
                f"`{name.value}` has no envelope, so it may ask for no action",
                name.span,
                help=("declare its `envelope`",),
            )
        envelope = elaborate_action_conditions(skill.envelope, inputs, self._site, self._diagnostics)
        module, _, function = skill.entry.value.partition(":")
        return Skill(
            id=name.value,
            module_name=module,
            function=function,
            inputs=inputs,
            precondition=start_condition(precondition, hold),
            outcomes=self._outcomes(name, skill.outcomes),
            envelope=envelope,
            actuators=site_names((one.value for one in skill.actuators), self._names.actuators),
            resources=site_names((one.value for one in skill.resources), self._names.resources),
            risk=Risk[skill.risk.value.upper()],
            timeout=self._timeout(skill),
            runtime_checked=self._runtime_checked(skill, envelope),
            leaves_any_to_gate=any(rule.value == ANY_RULE for rule in skill.gated),
            span=name.span,
            risk_span=skill.risk.span,
            entry_span=skill.entry.span,
            outputs=outputs,
            idempotent=skill.idempotent is not None and skill.idempotent.value,
            hold_condition=hold,
            models=resolve_models(skill.models, self._models, self._diagnostics),
            wear=self._wear(skill),
        )

    def _runtime_checked(
        self, skill: declared.Skill, envelope: Mapping[str, ActionCondition]
    ) -> dict[str, SourceSpan]:
        """Return the invariants that are left to the gate; for `any`, each that governs an action."""
        checked: dict[str, SourceSpan] = {}
        rules = {rule.id: rule for rule in self._site.rules}
        for name in skill.gated:
            if name.value == ANY_RULE:
                governing = (rule for rule in rules.values() if envelope.keys() & rule.terms.keys())
                checked |= {rule.id: name.span for rule in governing}
                continue
            resolve_name(name, rules, "an invariant of this site", self._diagnostics)
            checked[name.value] = name.span
        return checked

    def _state_condition(
        self, expression: ExpressionField | None, inputs: Mapping[str, Declared]
    ) -> ActionCondition | None:
        if expression is None:
            return None
        return elaborate_action_condition(expression, state_scope(self._site, inputs), self._diagnostics)

    def _wear(self, skill: declared.Skill) -> Fraction:
        wear = None if skill.wear is None else elaborate_quantity(skill.wear, TIME, self._diagnostics)
        if wear is not None and skill.wear is not None and wear < 0:
            self._diagnostics.error("AE129", "`wear` is at least 0 s", skill.wear.span)
        return wear or Fraction(0)

    def _timeout(self, skill: declared.Skill) -> Fraction:
        timeout = elaborate_quantity(skill.timeout, TIME, self._diagnostics)
        if timeout is None:
            return Fraction(0)
        ceiling = self._site.limits.skill_timeout
        if not 0 < timeout <= ceiling:
            self._diagnostics.error(
                "AE129",
                f"a timeout must be above 0 s and at most {format_number(ceiling)} s at this site",
                skill.timeout.span,
            )
        for name, outcome in skill.outcomes:
            duration = None if outcome.duration is None else parse_quantity(outcome.duration.value)
            if duration is not None and duration[0] * duration[1].factor > timeout:
                self._diagnostics.error(
                    "AE129", f"`{name.value}` lasts longer than the skill's timeout", name.span
                )
        return timeout

    def _outcomes(self, name: TextField, entries: MappingField[declared.Outcome]) -> dict[str, Outcome]:
        outcomes = {outcome.value: self._outcome(outcome.value, one) for outcome, one in entries}
        if all(outcome.failure for outcome in outcomes.values()):
            self._diagnostics.error("AE128", f"`{name.value}` has no outcome that is a success", name.span)
        declared_probability = sum((one.probability or Fraction(0) for one in outcomes.values()), Fraction(0))
        complete = all(one.probability is not None for one in outcomes.values())
        if outcomes and (declared_probability > 1 or (complete and declared_probability != 1)):
            self._diagnostics.error(
                "AE127",
                f"the probabilities of `{name.value}` add up to {format_number(declared_probability)}, not 1",
                name.span,
            )
        return outcomes

    def _outcome(self, name: str, outcome: declared.Outcome) -> Outcome:
        effects, ranges = elaborate_effects(outcome.effects, self._site, self._diagnostics)
        failure = outcome.failure is not None and outcome.failure.value
        verdict = "" if outcome.verdict is None else self._verdict(outcome.verdict, is_failure=failure)
        probability, duration = self._probability(outcome), self._duration(outcome)
        return Outcome(name, effects, failure, probability, duration, ranges, verdict)

    def _verdict(self, text: TextField, *, is_failure: bool) -> str:
        if not is_failure:
            headline = "an outcome with a verdict ends the task, so it must be a failure"
            self._diagnostics.error("AE208", headline, text.span)
        return elaborate_verdict(text, self._site, self._diagnostics)

    def _probability(self, outcome: declared.Outcome) -> Fraction | None:
        if outcome.probability is None:
            return None
        if not 0 <= outcome.probability.value <= 1:
            self._diagnostics.error(
                "AE127", "a probability must be between 0 and 1", outcome.probability.span
            )
        return outcome.probability.value

    def _duration(self, outcome: declared.Outcome) -> Fraction | None:
        if outcome.duration is None:
            return None
        duration = elaborate_quantity(outcome.duration, TIME, self._diagnostics)
        if duration is not None and duration < 0:
            self._diagnostics.error("AE111", "a duration must not be negative", outcome.duration.span)
        return duration
