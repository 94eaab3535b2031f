"""Elaboration of a declared module under a site to the resolved model, with every fault reported."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any, TypeVar

from packaging.licenses import InvalidLicenseExpression, canonicalize_license_expression
from packaging.specifiers import InvalidSpecifier, SpecifierSet
from packaging.version import InvalidVersion, Version

from aeros.spec.declared import ecm as declared
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.composition import elaborate_compositions
from aeros.spec.elaborate.expressions import (
    elaborate_condition,
    elaborate_constant,
    elaborate_expression,
    elaborate_quantity,
)
from aeros.spec.elaborate.lookup import check_in_range, resolve_name
from aeros.spec.elaborate.scopes import action_scope, constant_scope, state_scope
from aeros.spec.elaborate.site import elaborate_access
from aeros.spec.elaborate.vocabulary import check_name_is_free, elaborate_variable
from aeros.spec.expr import terms as t
from aeros.spec.expr.scope import Scope
from aeros.spec.expr.types import FamilyType, VectorType
from aeros.spec.expr.units import TIME, format_number, parse_quantity
from aeros.spec.model.ecm import ActionCondition, Ecm, Outcome, PlanningRule, Skill, Task, TaskInvariant
from aeros.spec.model.hold_conditions import MAX_COMBINATIONS, count_combinations, start_condition
from aeros.spec.model.rules import Risk
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared
from aeros.spec.text.digests import MAX_MODELS, model_digest
from aeros.spec.text.fields import ExpressionField, MappingField, TextField

_T = TypeVar("_T")


def elaborate_ecm(
    ecm: declared.Ecm, site: Site, folder: str, digests: tuple[str, str], diagnostics: Diagnostics
) -> Ecm | None:
    """Elaborate a declared module under a site.

    Reads the files that its models name, to take their digests.

    Args:
        ecm: the declared module.
        site: site that gives names, units and limits their meaning.
        folder: path of the module's folder.
        digests: SHA-256 in hexadecimal of the manifest and of the code.
        diagnostics: receives the faults.

    Returns:
        The model of the module, or None after reporting every fault.
    """
    before = len(diagnostics)
    elaborated = _EcmElaborator(ecm, site, diagnostics).ecm(folder, digests)
    return elaborated if len(diagnostics) == before else None


class _EcmElaborator:
    def __init__(self, ecm: declared.Ecm, site: Site, diagnostics: Diagnostics) -> None:
        self._declared = ecm
        self._site = site
        self._diagnostics = diagnostics
        self._providers = {
            name.value: [one.value for one in capability.provided_by] for name, capability in ecm.capabilities
        }
        self._provider_names = {name.value: None for name, _ in (*ecm.skills, *ecm.compositions)}

    def ecm(self, folder: str, digests: tuple[str, str]) -> Ecm:
        ecm = self._declared
        self._check_metadata()
        skills = {name.value: self._skill(name, skill) for name, skill in ecm.skills}
        return Ecm(
            id=ecm.id.value,
            version=ecm.version.value,
            folder=folder,
            manifest_digest=digests[0],
            code_digest=digests[1],
            model_digests=self._model_digests(Path(folder)),
            capabilities={name.value: self._capability(one) for name, one in ecm.capabilities},
            skills=skills,
            tasks={name.value: self._task(name, task, skills) for name, task in ecm.tasks},
            requested_access=elaborate_access(ecm.permissions),
            permitted_actions=self._clauses(ecm.permissions.actions, {}),
            required_modules={name.value: specifier.value for name, specifier in ecm.dependencies.modules},
            requires_spans={name.value: name.span for name, _ in ecm.dependencies.modules},
            required_aeros_version=ecm.dependencies.aeros.value,
            runtime_span=ecm.dependencies.aeros.span,
            access_span=ecm.permissions.key_span or ecm.permissions.span,
            span=ecm.id.span,
            compositions=elaborate_compositions(ecm.compositions, self._site, skills, self._diagnostics),
        )

    def _check_metadata(self) -> None:
        ecm = self._declared
        try:
            Version(ecm.version.value)
        except InvalidVersion:
            self._diagnostics.error(
                "AE125", f"`{ecm.version.value}` is not a version", ecm.version.span, help=("as in `1.0.0`",)
            )
        try:
            canonicalize_license_expression(ecm.license.value)
        except InvalidLicenseExpression:
            self._diagnostics.error(
                "AE132",
                f"`{ecm.license.value}` is not an SPDX licence expression",
                ecm.license.span,
                help=("as in `Apache-2.0` or `LicenseRef-Proprietary`",),
            )
        for specifier in (ecm.dependencies.aeros, *(text for _, text in ecm.dependencies.modules)):
            try:
                SpecifierSet(specifier.value)
            except InvalidSpecifier:
                self._diagnostics.error(
                    "AE125",
                    f"`{specifier.value}` is not a version range",
                    specifier.span,
                    help=('as in `">=1.0,<2"`',),
                )

    def _model_digests(self, folder: Path) -> dict[str, str]:
        """Compute the digest of every file that a model or tool names, each in the module's own folder."""
        digests: dict[str, str] = {}
        left = MAX_MODELS
        for name, tool in self._declared.models:
            if tool.file is None:
                continue
            try:
                digests[tool.file.value], size = model_digest(folder, tool.file.value, left)
            except OSError as error:
                headline = f"`{name.value}`: `{tool.file.value}` is not a file of this module"
                self._diagnostics.error("AE131", headline, tool.file.span, f"{error.strerror}".lower())
            else:
                left -= size
        return digests

    def _capability(self, capability: declared.Capability) -> tuple[str, ...]:
        if not capability.provided_by:
            self._diagnostics.error(
                "AE112", "a capability is provided by at least one skill", capability.span
            )
        for name in capability.provided_by:
            self._resolve_name(name, self._provider_names, "a skill or composition of this module")
        return tuple(name.value for name in capability.provided_by)

    def _skill(self, name: TextField, skill: declared.Skill) -> Skill:
        inputs, enums = self._inputs(skill.inputs), self._site.enums
        state = state_scope(self._site, inputs)
        precondition = None if skill.precondition is None else self._clause(skill.precondition, state)
        hold = None if skill.hold is None else self._clause(skill.hold, state)
        if hold is not None and count_combinations(hold) > MAX_COMBINATIONS:
            headline = f"`hold` reads predicates with more than {MAX_COMBINATIONS} combinations of values"
            self._diagnostics.error("AE111", headline, hold.span, help=("hold to fewer of them",))
        outputs = {
            output.value: variable
            for output, quantity in skill.outputs
            if (
                variable := elaborate_variable(
                    output.value, quantity, t.VariableRole.INPUT, enums, self._diagnostics
                )
            )
        }
        for resource in skill.resources:
            self._resolve_name(resource, self._site.resources, "a resource of this site")
        rules = {rule.id: None for rule in self._site.rules}
        for rule in skill.gated:
            self._resolve_name(rule, rules, "an invariant of this site")
        if not skill.envelope:
            self._diagnostics.error(
                "AE503", f"`{name.value}` may ask for nothing", name.span, help=("declare its `envelope`",)
            )
        module, _, function = skill.entry.value.partition(":")
        return Skill(
            id=name.value,
            module_name=module,
            function=function,
            inputs=inputs,
            precondition=start_condition(precondition, hold),
            outcomes=self._outcomes(name, skill.outcomes),
            envelope=self._clauses(skill.envelope, inputs),
            actuators=frozenset(actuator.value for actuator in skill.actuators),
            resources=frozenset(resource.value for resource in skill.resources),
            risk=Risk[skill.risk.value.upper()],
            timeout=self._timeout(skill),
            runtime_checked={rule.value: rule.span for rule in skill.gated},
            span=name.span,
            risk_span=skill.risk.span,
            entry_span=skill.entry.span,
            outputs=outputs,
            idempotent=skill.idempotent is not None and skill.idempotent.value,
            hold_condition=hold,
        )

    def _inputs(self, entries: MappingField[declared.Input]) -> dict[str, Declared]:
        inputs: dict[str, Declared] = {}
        for name, one in entries:
            if not check_name_is_free(name, {}, "input", self._diagnostics):
                continue
            variable = elaborate_variable(
                f"inputs.{name.value}", one, t.VariableRole.INPUT, self._site.enums, self._diagnostics
            )
            if variable is None:
                continue
            default = None
            if one.default is not None:
                default = elaborate_constant(
                    one.default, constant_scope(self._site), self._diagnostics, variable.variable.type
                )
                self._check_range(variable, default, one.default)
            inputs[name.value] = replace(variable, default_value=default)
        return inputs

    def _check_range(self, variable: Declared, value: Any, at: ExpressionField) -> None:
        check_in_range(variable, value, at, self._diagnostics)

    def _timeout(self, skill: declared.Skill) -> Fraction:
        timeout = elaborate_quantity(skill.timeout, TIME, self._diagnostics)
        if timeout is None:
            return Fraction(0)
        ceiling = self._site.limits.skill_timeout
        if not 0 < timeout <= ceiling:
            self._diagnostics.error(
                "AE129",
                f"a time-out is longer than 0 s and at most {format_number(ceiling)} s at this site",
                skill.timeout.span,
            )
        for name, outcome in skill.outcomes:
            duration = None if outcome.duration is None else parse_quantity(outcome.duration.value)
            if duration is not None and duration[0] * duration[1].factor > timeout:
                self._diagnostics.error(
                    "AE129", f"`{name.value}` lasts longer than the skill's time-out", name.span
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
        effects = self._constant_effects(outcome.effects)
        for variable, _ in outcome.effects:
            declared_variable = self._site.state.get(variable.value)
            if declared_variable is not None and isinstance(
                declared_variable.variable.type, VectorType | FamilyType
            ):
                self._diagnostics.error(
                    "AE203",
                    f"an effect on a {declared_variable.variable.type} cannot be declared",
                    variable.span,
                )
        probability = None if outcome.probability is None else outcome.probability.value
        if probability is not None and not 0 <= probability <= 1 and outcome.probability is not None:
            self._diagnostics.error("AE127", "a probability is between 0 and 1", outcome.probability.span)
        duration = (
            None
            if outcome.duration is None
            else elaborate_quantity(outcome.duration, TIME, self._diagnostics)
        )
        if duration is not None and duration < 0 and outcome.duration is not None:
            self._diagnostics.error("AE111", "a duration is not below nothing", outcome.duration.span)
        return Outcome(
            name, effects, outcome.failure is not None and outcome.failure.value, probability, duration
        )

    def _constant_effects(self, entries: MappingField[ExpressionField]) -> dict[str, Any]:
        """Elaborate the constant value that each state variable is set to."""
        values: dict[str, Any] = {}
        for variable, expression in entries:
            declared_variable = self._resolve_name(
                variable, self._site.state, "a state variable of this site"
            )
            if declared_variable is not None:
                scope = constant_scope(self._site)
                value = elaborate_constant(
                    expression, scope, self._diagnostics, declared_variable.variable.type
                )
                self._check_range(declared_variable, value, expression)
                values[variable.value] = value
        return values

    def _clauses(
        self, entries: MappingField[ExpressionField], inputs: Mapping[str, Declared]
    ) -> dict[str, ActionCondition]:
        clauses: dict[str, ActionCondition] = {}
        for name, expression in entries:
            kind = self._resolve_name(name, self._site.kinds, "an action kind of this site")
            if kind is None:
                continue
            clause = self._clause(expression, action_scope(self._site, kind, inputs))
            if clause is not None:
                clauses[name.value] = clause
        return clauses

    def _clause(self, expression: ExpressionField, scope: Scope) -> ActionCondition | None:
        condition = elaborate_condition(expression, scope, self._diagnostics)
        return (
            None
            if condition is None
            else ActionCondition(condition.term, expression.value, expression.span, condition.conjuncts)
        )

    def _task(self, name: TextField, task: declared.Task, skills: Mapping[str, Skill]) -> Task:
        if not task.words:
            self._diagnostics.error("AE112", f"no word routes to the task `{name.value}`", name.span)
        if not task.rules:
            self._diagnostics.error("AE112", f"the task `{name.value}` has no planning rule", name.span)
        goal = self._clause(task.goal, state_scope(self._site))
        rules = tuple(rule for one in task.rules if (rule := self._planning_rule(one, skills)) is not None)
        words = tuple(word.value.casefold() for word in task.words)
        scene = None if task.scene is None else task.scene.value
        initial = self._constant_effects(task.initial)
        return Task(
            name.value,
            words,
            t.FALSE if goal is None else goal.term,
            task.goal.value,
            rules,
            initial,
            scene,
            name.span,
            self._invariants(task.invariants),
            () if goal is None else goal.conjuncts,
            tuple(word.span for word in task.words),
        )

    def _invariants(self, listed: tuple[declared.TaskInvariant, ...]) -> tuple[TaskInvariant, ...]:
        invariants: dict[str, TaskInvariant] = {}
        for one in listed:
            if one.id.value in invariants:
                self._diagnostics.error(
                    "AE120", f"the invariant `{one.id.value}` is declared twice", one.id.span
                )
            term = elaborate_expression(one.require, state_scope(self._site), self._diagnostics)
            if term is not None:
                invariants[one.id.value] = TaskInvariant(
                    one.id.value, term, one.require.value, one.require.span
                )
        return tuple(invariants.values())

    def _planning_rule(self, rule: declared.PlanningRule, skills: Mapping[str, Skill]) -> PlanningRule | None:
        unless = elaborate_expression(rule.unless, state_scope(self._site), self._diagnostics)
        run = self._skills_for(rule.do, skills)
        if rule.on_failure is not None:
            self._resolve_name(rule.on_failure, skills, "a skill of this module")
            if rule.retry is None:
                self._diagnostics.error(
                    "AE102", "`on_failure` runs between two tries, so it needs `retry`", rule.on_failure.span
                )
        retry = 0 if rule.retry is None else rule.retry.value
        if rule.retry is not None and retry > self._site.limits.retries:
            self._diagnostics.error(
                "AE129",
                f"this site allows at most {self._site.limits.retries} retries of a step",
                rule.retry.span,
            )
        if unless is None or not run:
            return None
        on_failure = None if rule.on_failure is None else rule.on_failure.value
        inputs, *_ = [self._step_inputs(rule, skill) for skill in run]
        return PlanningRule(unless, rule.unless.value, rule.do.value, inputs, retry, on_failure, rule.span)

    def _skills_for(self, do: TextField, skills: Mapping[str, Skill]) -> list[Skill]:
        """Return the skill that a rule names, or the providers of its capability; none after a report."""
        if do.value not in self._providers:
            named = {**skills, **dict.fromkeys(self._providers)}
            self._resolve_name(do, named, "a skill or capability of this module")
            return [skills[do.value]] if do.value in skills else []
        providers = self._providers[do.value]
        if do.value in skills and providers != [do.value]:
            headline = f"`{do.value}` is a skill and a capability that others provide"
            self._diagnostics.error(
                "AE121", headline, do.span, help=("rename one, so that it is said what may run",)
            )
            return []
        composed = next((name for name in providers if name not in skills), None)
        if composed is not None:
            headline = f"`{do.value}` is no step: `{composed}`, which provides it, is not a skill"
            self._diagnostics.error("AE122", headline, do.span)
            return []
        return [skills[name] for name in providers]

    def _step_inputs(self, rule: declared.PlanningRule, skill: Skill) -> dict[str, Any]:
        given: dict[str, Any] = {}
        for name, expression in rule.inputs:
            variable = self._resolve_name(name, skill.inputs, f"an input of `{skill.id}`")
            if variable is not None:
                value = elaborate_constant(
                    expression, constant_scope(self._site), self._diagnostics, variable.variable.type
                )
                self._check_range(variable, value, expression)
                given[name.value] = value
        for name_, variable in skill.inputs.items():
            if variable.default_value is None and name_ not in given:
                self._diagnostics.error("AE102", f"`{skill.id}` needs the input `{name_}`", rule.do.span)
        return given

    def _resolve_name(self, name: TextField, among: Mapping[str, _T], what: str) -> _T | None:
        return resolve_name(name, among, what, self._diagnostics)
