"""The loop of `aeros.agent.task_loop` again, as a tree of all possible runs.

Written from that file's rules and code alone, function by function; it shares nothing with
`aeros.spec.closed_loop`.  Slow and small on purpose: a recursion that remembers what it has seen.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from functools import cache
from typing import Any, NamedTuple

from aeros.spec.expr import terms as t
from aeros.spec.expr.effects import state_after
from aeros.spec.expr.semantics import is_true
from aeros.spec.model.ecm import Ecm, Outcome, PlanningRule, Skill, Task
from aeros.spec.model.site import Site

State = frozenset[tuple[str, Any]]
Plan = tuple[int, ...]


class Expected(NamedTuple):
    """Of all runs from somewhere on: how many reach the goal, and what they add up to."""

    success: Fraction = Fraction(0)
    invocations: Fraction = Fraction(0)
    retries: Fraction = Fraction(0)
    recoveries: Fraction = Fraction(0)
    replans: Fraction = Fraction(0)

    def plus(self, **more: Fraction | int) -> Expected:
        return self._replace(**{name: getattr(self, name) + one for name, one in more.items()})


def expected(ecm: Ecm, task: Task, site: Site, start: Mapping[str, Any]) -> Expected:
    """Compute the expected counts of runs from `start`."""
    return _Tree(ecm, task, site).pursue(frozenset(start.items()), 0)


class _Tree:
    def __init__(self, ecm: Ecm, task: Task, site: Site) -> None:
        self._ecm, self._task, self._cap = ecm, task, site.limits.replans
        self._most_retries = site.limits.retries
        # Per tree, not per class: a cache on a method would keep every tree alive.
        self.pursue = cache(self._pursue)
        self._follow = cache(self._follow_the_rest)

    def _pursue(self, state: State, made: int) -> Expected:
        if self._is_goal(state):
            return Expected(success=Fraction(1))
        plan = tuple(
            n for n, rule in enumerate(self._task.rules) if not is_true(rule.satisfied_condition, dict(state))
        )
        if self._is_rejected([self._task.rules[n] for n in plan]):
            return Expected(replans=Fraction(int(made < self._cap)))
        return self._follow(state, plan, made)

    def _over(self, state: State, made: int) -> Expected:
        if self._is_goal(state) or made < self._cap:
            counted = 0 if self._is_goal(state) else 1
            return self.pursue(state, made + counted).plus(replans=counted)
        return Expected()

    def _follow_the_rest(self, state: State, plan: Plan, made: int) -> Expected:
        if self._is_goal(state) or not plan:
            return self._over(state, made)
        rule = self._task.rules[plan[0]]
        if is_true(rule.satisfied_condition, dict(state)):
            return self._follow(state, plan[1:], made)
        return self._attempt(state, plan, made, rule.retry, "invocations")

    def _attempt(self, state: State, plan: Plan, made: int, left: int, counted: str) -> Expected:
        rule = self._task.rules[plan[0]]

        def then(after: State, failed: bool) -> Expected:
            if not failed:
                return self._follow(after, plan[1:], made)
            done = self._is_goal(after) or is_true(rule.satisfied_condition, dict(after))
            if done:
                return self._follow(after, plan[1:], made)
            if not left:
                return self._reset(after, plan, made)
            return self._recover(after, plan, made, left)

        found = self._invoke(self._ecm.skills[rule.skill], rule.inputs, state, then)
        if found is None:
            return self._over(state, made) if counted == "invocations" else self._reset(state, plan, made)
        return found.plus(**dict.fromkeys({"invocations", counted}, 1))

    def _recover(self, state: State, plan: Plan, made: int, left: int) -> Expected:
        rule = self._task.rules[plan[0]]

        def then(after: State, _: bool) -> Expected:
            if self._is_goal(after) or is_true(rule.satisfied_condition, dict(after)):
                return self._follow(after, plan[1:], made)
            return self._attempt(after, plan, made, left - 1, "retries")

        recovery = rule.between_tries
        found = None if recovery is None else self._invoke(self._ecm.skills[recovery], {}, state, then)
        return then(state, False) if found is None else found.plus(invocations=1, recoveries=1)

    def _reset(self, state: State, plan: Plan, made: int) -> Expected:
        recovery = self._task.rules[plan[0]].on_failure
        if recovery is None or self._is_goal(state):
            return self._over(state, made)
        found = self._invoke(self._ecm.skills[recovery], {}, state, lambda after, _: self._over(after, made))
        return self._over(state, made) if found is None else found.plus(invocations=1, recoveries=1)

    def _invoke(
        self, skill: Skill, inputs: Mapping[str, Any], state: State, then: Callable[[State, bool], Expected]
    ) -> Expected | None:
        """The mean of `then` over the outcomes; None where the skill does not start."""
        filled = {f"inputs.{name}": inputs.get(name, one.default_value) for name, one in skill.inputs.items()}
        if skill.precondition is not None and not is_true(skill.precondition.term, {**dict(state), **filled}):
            return None
        means = [Fraction(0)] * 5
        for outcome, share in _shares(skill):
            if share:
                before = dict(state)
                after = frozenset({**before, **state_after(outcome.effects, before)}.items())
                branch = then(after, _judged_a_failure(skill, before, dict(after)))
                means = [mean + share * one for mean, one in zip(means, branch, strict=True)]
        return Expected(*means)

    def _is_goal(self, state: State) -> bool:
        return is_true(self._task.goal, dict(state))

    def _is_rejected(self, rules: list[PlanningRule]) -> bool:
        if not rules or any(rule.retry > self._most_retries for rule in rules):
            return True
        cures: dict[str, set[str]] = {}
        for rule in rules:
            for cure in filter(None, (rule.between_tries, rule.on_failure)):
                cures.setdefault(rule.skill, set()).add(cure)
                if any(one.default_value is None for one in self._ecm.skills[cure].inputs.values()):
                    return True
        return any(_comes_to(cures, cure, skill, set()) for skill in cures for cure in cures[skill])


def _comes_to(cures: Mapping[str, set[str]], here: str, there: str, seen: set[str]) -> bool:
    if here == there:
        return True
    seen.add(here)
    return any(_comes_to(cures, cure, there, seen) for cure in cures.get(here, set()) - seen)


def _shares(skill: Skill) -> list[tuple[Outcome, Fraction]]:
    outcomes = list(skill.outcomes.values())
    rest = Fraction(1) - sum(one.probability for one in outcomes if one.probability is not None)
    silent = [one for one in outcomes if one.probability is None]
    return [(one, rest / len(silent) if one.probability is None else one.probability) for one in outcomes]


def _judged_a_failure(skill: Skill, before: Mapping[str, Any], after: Mapping[str, Any]) -> bool:
    """The supervisor's judgement: the outcome measured that says most, a success before a failure."""
    measured = [
        one
        for one in skill.outcomes.values()
        if all(after[name] == value for name, value in state_after(one.effects, before).items())
    ]
    most = max(len(one.effects) for one in measured)
    return all(one.failure for one in measured if len(one.effects) == most)


def variables(ecm: Ecm, task: Task) -> set[str]:
    """The state variables that a task depends on, found anew."""
    named = {name for rule in task.rules for name in (rule.skill, rule.between_tries, rule.on_failure)}
    used = {name for name in named if name is not None}
    terms = [task.goal, *(rule.satisfied_condition for rule in task.rules)]
    found = set()
    for skill in map(ecm.skills.__getitem__, used):
        terms += [] if skill.precondition is None else [skill.precondition.term]
        found |= {name for outcome in skill.outcomes.values() for name in outcome.effects}
    found |= {name for term in terms for name in t.variables_of(term)}
    return {name for name in found if not name.startswith("inputs.")}
