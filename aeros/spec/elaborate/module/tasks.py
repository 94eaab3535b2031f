"""Elaboration of a module's tasks: goals, task invariants, and planning rules over the module's skills."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from aeros.spec.declared import ecm as declared
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.expressions import elaborate_expression
from aeros.spec.elaborate.module.action_conditions import elaborate_action_condition
from aeros.spec.elaborate.module.callables import CallableNames
from aeros.spec.elaborate.names import resolve_name, resolve_need
from aeros.spec.elaborate.scopes import state_scope
from aeros.spec.elaborate.task_parameters import patterns_of, phrases_of
from aeros.spec.elaborate.values import elaborate_state_values, elaborate_value
from aeros.spec.expr import terms as t
from aeros.spec.model.ecm import ActionCondition, Alternative, PlanningRule, Task, TaskInvariant
from aeros.spec.model.site import Site
from aeros.spec.model.task_parameters import TaskParameter
from aeros.spec.text.fields import ExpressionField, MappingField, TextField

NEEDS_RETRY = "`between_tries` runs between two tries, so it needs `retry`"
"""Headline of the fault of a step that is tried once and says what runs between two tries."""


def elaborate_tasks(
    ecm: declared.Ecm,
    names: CallableNames,
    site: Site,
    parameters: Mapping[str, Mapping[str, TaskParameter]],
    diagnostics: Diagnostics,
) -> dict[str, Task]:
    """Elaborate the tasks of a module.

    Args:
        ecm: the declared module.
        names: skills and capabilities that its rules may name.
        site: site under which the module is elaborated.
        parameters: parameters of each task by name, by the task's name.
        diagnostics: receives the faults.

    Returns:
        The tasks by name, without the parts that have a fault.
    """
    elaborator = _TaskElaborator(names, site, diagnostics)
    return {name.value: elaborator.task(name, task, parameters[name.value]) for name, task in ecm.tasks}


class _TaskElaborator:
    def __init__(self, names: CallableNames, site: Site, diagnostics: Diagnostics) -> None:
        self._names = names
        self._site = site
        self._diagnostics = diagnostics

    def task(self, name: TextField, task: declared.Task, parameters: Mapping[str, TaskParameter]) -> Task:
        if not task.words:
            self._diagnostics.error("AE112", f"no word routes to the task `{name.value}`", name.span)
        if not task.rules:
            self._diagnostics.error("AE112", f"the task `{name.value}` has no planning rule", name.span)
        defaults = {one.full_name: one.default for one in parameters.values() if one.default is not None}
        goal = elaborate_action_condition(task.goal, state_scope(self._site), self._diagnostics)
        return Task(
            id=name.value,
            trigger_phrases=patterns_of(task.words, self._diagnostics),
            goal=t.FALSE if goal is None else goal.term,
            goal_text=task.goal.value,
            rules=tuple(rule for one in task.rules if (rule := self._rule(one)) is not None),
            initial=defaults | self._initial(task.initial),
            scene=None if task.scene is None else task.scene.value,
            span=name.span,
            invariants=self._invariants(task.invariants),
            goal_conjuncts=() if goal is None else goal.conjuncts,
            word_spans=tuple(word.span for word in task.words),
            object_phrases=phrases_of(task.objects, self._diagnostics),
            extra_phrases=patterns_of(task.extras, self._diagnostics),
            condition_phrases=self._conditions(task.conditions),
            parameters=parameters,
            reported=self._reported(task.report),
        )

    def _initial(self, entries: MappingField[ExpressionField]) -> dict[str, Any]:
        """Elaborate the values at the start; say of a variable of another module if it may not be named."""
        cure = "leave it out: a simulator takes its value from the task of that module"
        named = MappingField(tuple(one for one in entries if not self._refuse_hidden(one[0], cure)))
        return elaborate_state_values(named, self._site, self._diagnostics)

    def _refuse_hidden(self, name: TextField, *cures: str) -> bool:
        """Report a variable of another module that is not public, with those that are; True if it is one."""
        owner, _, _ = name.value.partition(".")
        ecm = self._names.foreign.modules.get(owner)
        if ecm is None or name.value not in ecm.state or ecm.state[name.value].is_public:
            return False
        public = ", ".join(f"`{one}`" for one, variable in ecm.state.items() if variable.is_public) or "none"
        self._diagnostics.error(
            "AE122",
            f"`{name.value}` is a state variable of `{owner}` that is not public",
            name.span,
            help=(
                *cures,
                f"public are: {public}",
                f"or declare it with `public: true` in the manifest of `{owner}`",
            ),
        )
        return True

    def _reported(self, names: tuple[TextField, ...]) -> tuple[str, ...]:
        found = [
            resolve_need(name, self._site.state, "variable", self._diagnostics)
            for name in names
            if not self._refuse_hidden(name)
        ]
        return tuple(one.name for one in found if one is not None)

    def _conditions(self, listed: tuple[declared.NamedCondition, ...]) -> dict[str, ActionCondition]:
        conditions: dict[str, ActionCondition] = {}
        for one in listed:
            condition = elaborate_action_condition(one.require, state_scope(self._site), self._diagnostics)
            spoken = ((word, text) for word in one.words for text in phrases_of((word,), self._diagnostics))
            for phrase, text in spoken:
                if text in conditions:
                    self._diagnostics.error("AE120", f"the condition `{text}` is declared twice", phrase.span)
                if condition is not None:
                    conditions[text] = condition
        return conditions

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

    def _rule(self, rule: declared.PlanningRule) -> PlanningRule | None:
        unless = elaborate_expression(rule.unless, state_scope(self._site), self._diagnostics)
        alternatives = self._names.alternatives(rule.do, self._diagnostics)
        self._check_retry(rule)
        if unless is None or not alternatives:
            return None
        inputs, *_ = [self._inputs(rule, one) for one in alternatives]
        return PlanningRule(
            satisfied_condition=unless,
            text=rule.unless.value,
            skill=rule.do.value,
            inputs=inputs,
            retry=0 if rule.retry is None else rule.retry.value,
            between_tries=None if rule.between_tries is None else rule.between_tries.value,
            on_failure=None if rule.on_failure is None else rule.on_failure.value,
            span=rule.span,
        )

    def _check_retry(self, rule: declared.PlanningRule) -> None:
        """Check the retry budget of a rule, and the skills that its failure leads to."""
        for helper in (rule.between_tries, rule.on_failure):
            if helper is not None:
                self._names.skills_for(helper, self._diagnostics)
        if rule.between_tries is not None and rule.retry is None:
            self._diagnostics.error("AE102", NEEDS_RETRY, rule.between_tries.span)
        if rule.retry is not None and rule.retry.value > self._site.limits.retries:
            self._diagnostics.error(
                "AE129",
                f"this site allows at most {self._site.limits.retries} retries of a step",
                rule.retry.span,
            )

    def _inputs(self, rule: declared.PlanningRule, alternative: Alternative) -> dict[str, Any]:
        if alternative.composition is not None:
            for name, _ in rule.inputs:
                headline = f"`{alternative.name}`, which provides `{rule.do.value}`, has no input"
                self._diagnostics.error("AE122", f"{headline} `{name.value}`", name.span)
            return {}
        skill = self._names.all_skills.get(alternative.name)
        if skill is None:
            return {}  # a composition with a fault, which is reported
        given: dict[str, Any] = {}
        for name, expression in rule.inputs:
            variable = resolve_name(name, skill.inputs, f"an input of `{skill.id}`", self._diagnostics)
            if variable is not None:
                given[name.value] = elaborate_value(expression, variable, self._site, self._diagnostics)
        for needed, variable in skill.inputs.items():
            if variable.default_value is None and needed not in given:
                self._diagnostics.error("AE102", f"`{skill.id}` needs the input `{needed}`", rule.do.span)
        return given
