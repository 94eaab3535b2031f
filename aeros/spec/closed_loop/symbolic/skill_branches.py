"""Outcomes of a skill as branches of a program: what changes, and whether it counts as a failure."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

from aeros.spec.closed_loop.loop_variables import LoopVariables, bound_inputs
from aeros.spec.closed_loop.outcome_probabilities import outcome_probabilities
from aeros.spec.closed_loop.symbolic.program import afterwards, all_of, any_of
from aeros.spec.expr import terms as t
from aeros.spec.expr.constants import constant_term
from aeros.spec.expr.effects import Increment
from aeros.spec.expr.lower import lower, negate, with_constants
from aeros.spec.expr.types import BoolType, IntegerType, RealType
from aeros.spec.model.ecm import Outcome, Skill
from aeros.spec.model.hold_conditions import hold_loss_outcomes, stop_outcomes


@dataclass(frozen=True, slots=True)
class SkillBranch:
    """One outcome of a skill.

    Attributes:
        guard: condition under which no number leaves its range; the claims about increments prove it.
        updates: value afterwards of each variable that changes, as a term over the values before.
        opened: values of variables of which nothing decides which they have afterwards.
        agrees: condition, on the values before and those afterwards of opened variables, under which these
            agree with all definitions.
        is_success: the same, and the outcome that is measured then is a success.
        is_failure: the same for a failure.
        is_likely: False if its probability is 0.
    """

    guard: t.Term
    updates: Mapping[str, t.Term]
    opened: Mapping[str, tuple[Any, ...]]
    agrees: t.Term
    is_success: t.Term
    is_failure: t.Term
    is_likely: bool


@dataclass(frozen=True, slots=True)
class SymbolicSkill:
    """A skill with constant inputs.

    Attributes:
        can_start: its precondition.
        branches: its outcomes.
        stops: the ways in which it may be stopped with a part of a composition around it.
    """

    can_start: t.Term
    branches: tuple[SkillBranch, ...]
    stops: tuple[SkillBranch, ...]

    @property
    def is_settled(self) -> bool:
        """True if no outcome leaves a variable open."""
        return not any(len(values) > 1 for one in self.branches for values in one.opened.values())


def symbolic_skill(
    skill: Skill, inputs: Mapping[str, Any], variables: LoopVariables, settable: Collection[str]
) -> SymbolicSkill:
    """Describe a skill that is run with constant inputs.

    Args:
        skill: the skill, with the consequences of its outcomes.
        inputs: constant inputs by name; an input that is left out has its default value.
        variables: state variables of the loop.
        settable: variables that some skill of the loop can set.

    Returns:
        Its precondition and its branches, as `Invocation` has them.
    """
    can_start: t.Term = t.TRUE
    if skill.precondition is not None:
        can_start = lower(with_constants(skill.precondition.term, bound_inputs(skill, inputs)))
        if any(one.role is t.VariableRole.INPUT for one in t.variables_of(can_start).values()):
            can_start = t.FALSE  # an input has no value; the agent rejects such plans
    listed = [
        (_Ending(outcome, skill, variables), share != 0)
        for outcome, share in outcome_probabilities(skill.outcomes.values())
    ]
    endings = [one for one, _ in listed]
    branches = [
        one.branch(_failure_condition(one, endings), is_likely)
        for one, is_likely in listed
        if one.outcome.probability != 0
    ]
    branches += [
        _Ending(outcome, skill, variables).branch(t.TRUE, is_likely=False)
        for outcome in hold_loss_outcomes(skill, settable)
    ]
    stops = [
        _Ending(outcome, skill, variables).branch(t.TRUE, is_likely=False) for outcome in stop_outcomes(skill)
    ]
    return SymbolicSkill(can_start, tuple(branches), tuple(stops))


class _Ending:
    """An outcome with what it changes of the variables of a loop."""

    def __init__(self, outcome: Outcome, skill: Skill, variables: LoopVariables) -> None:
        self.outcome = outcome
        self._variables = variables.variables
        self._numbers = {
            name: (
                constant_term(variables.values[name][0], one.type),
                constant_term(variables.values[name][-1], one.type),
            )
            for name, one in self._variables.items()
            if isinstance(one.type, IntegerType)
        }
        self.updates = {name: self.effect(name, value) for name, value in outcome.effects.items()}
        values = variables.after(skill, outcome)
        self.opened: dict[str, tuple[Any, ...]] = dict(values.opened)
        for name, value in outcome.consequences.items():
            if name in self._variables and value is not None:
                self.updates[name] = self.effect(name, value)
            elif name in self._variables and name not in values.computed:
                self.opened[name] = (False, True)
        self.updates |= {name: self._afterwards(one) for name, one in values.computed.items()}
        self._agrees = all_of(*map(self._afterwards, values.constraints))

    def branch(self, is_failure: t.Term, is_likely: bool) -> SkillBranch:
        """Make the branch of this outcome.

        Args:
            is_failure: condition under which the outcome that is measured then is a failure.
            is_likely: False if its probability is 0.

        Returns:
            The branch.
        """
        agrees = self._agrees
        succeeds, fails = (all_of(agrees, one) for one in (negate(is_failure), is_failure))
        return SkillBranch(self.guard, self.updates, self.opened, agrees, succeeds, fails, is_likely)

    def _afterwards(self, condition: t.Term) -> t.Term:
        """Write a condition on the state afterwards on the values before, and on opened variables."""
        after = {name: self.value_after(name) for name in t.variables_of(condition)}
        return lower(t.substitute(condition, after))

    @property
    def guard(self) -> t.Term:
        """The condition under which no number leaves its range."""
        parts: list[t.Term] = []
        for name, effect in self.outcome.effects.items():
            if isinstance(effect, Increment):
                low, high = self._numbers[name]
                after = self.updates[name]
                parts += [t.Compare("<=", low, after), t.Compare("<=", after, high)]
        return all_of(*parts)

    def effect(self, name: str, effect: Any) -> t.Term:
        """Make the term of the value that an effect leaves."""
        variable = self._variables[name]
        if isinstance(effect, Increment):
            type_ = variable.type
            assert isinstance(type_, RealType)  # noqa: S101  elaboration admits no other increment
            return t.Add(variable, t.Literal(effect.amount, RealType(type_.dimension)))
        return constant_term(effect, variable.type)

    def value_after(self, name: str) -> t.Term:
        """Make the term of a variable's value after this outcome."""
        if name in self.opened:
            return afterwards(self._variables[name])
        return self.updates.get(name, self._variables[name])

    def measures(self, other: _Ending) -> t.Term:
        """Make the condition that all that another outcome declares holds after this one."""
        parts = [
            _equal(self.value_after(name), other.effect(name, effect), self._variables[name])
            for name, effect in other.outcome.effects.items()
        ]
        for one in other.outcome.ranges:
            if one.name in self._variables:
                value = self.value_after(one.name)
                type_ = self._variables[one.name].type
                low, high = (constant_term(bound, type_) for bound in (one.low, one.high))
                parts += [t.Compare("<=", low, value), t.Compare("<=", value, high)]
        return lower(all_of(*parts))


def _failure_condition(ending: _Ending, every: list[_Ending]) -> t.Term:
    """Make the condition that the outcome measured after an ending is a failure.

    Of all outcomes that are measured, the one with the most effects counts; of several, a success.
    """
    ranked = sorted(every, key=lambda one: (one.outcome.effect_count, not one.outcome.failure), reverse=True)
    failing: list[t.Term] = []
    better: list[t.Term] = []
    for one in ranked:
        measured = ending.measures(one)
        if one.outcome.failure:
            failing.append(all_of(measured, *map(negate, better)))
        if measured == t.TRUE:
            break
        better += [] if measured == t.FALSE else [measured]
    return any_of(failing)


def _equal(left: t.Term, right: t.Term, variable: t.Variable) -> t.Term:
    if left == right:
        return t.TRUE
    if isinstance(variable.type, BoolType):
        wanted = right == t.TRUE
        return left if wanted else negate(left)
    if _is_same_number_apart(left, right):
        return t.FALSE
    return t.Compare("==", left, right)


def _is_same_number_apart(left: t.Term, right: t.Term) -> bool:
    """Tell whether two terms are one variable with different amounts added."""
    bases = [one.left if isinstance(one, t.Add) else one for one in (left, right)]
    return bases[0] == bases[1] and isinstance(bases[0], t.Variable)
