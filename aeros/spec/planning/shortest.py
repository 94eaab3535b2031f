"""Shortest plan if each step has the outcome it counts on, or a proof that there is no plan.

If few states are reachable, all are enumerated, which finds a plan or proves that there is none. Otherwise Z3
searches plans of growing length; that there is none is proved if the delete relaxation has none.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from itertools import product
from typing import Any, Final, TypeAlias

from aeros.spec.closed_loop.invocation import State
from aeros.spec.expr.effects import Increment, value_after
from aeros.spec.planning.bounded import bounded_plan
from aeros.spec.planning.domain import GroundSkill, PartialCondition, PlanningDomain
from aeros.spec.planning.search_result import AvoidSet, PlanPath

MAX_ENUMERATED_STATES: Final = 3000
"""Number of states up to which enumeration is faster than the solver; measured in docs/planning.md."""

_MAX_VALUES: Final = 4096


class TooManyStatesError(Exception):
    """More reachable states than the limit."""


def shortest_plan(
    domain: PlanningDomain, start: State, avoided: AvoidSet, few: int = MAX_ENUMERATED_STATES
) -> PlanPath | None:
    """Find the shortest plan.

    Args:
        domain: planning domain.
        start: first state.
        avoided: states and pairs that the plan must avoid.
        few: maximum number of states to enumerate.

    Returns:
        The plan; None if it is proved that there is none.

    Raises:
        PlanUndecidedError: the solver gives up or the length limit is reached.
    """
    try:
        return breadth_first_plan(domain, start, avoided, few)
    except TooManyStatesError:
        least = DeleteRelaxation(domain, start).steps_to_goal
        return None if least is None else bounded_plan(domain, start, avoided, least)


def breadth_first_plan(
    domain: PlanningDomain, start: State, avoided: AvoidSet, max_states: int
) -> PlanPath | None:
    """Find the shortest plan by breadth-first search; of equally short plans, the most probable one.

    Args:
        domain: planning domain.
        start: first state.
        avoided: states and pairs that the plan must avoid.
        max_states: maximum number of states.

    Returns:
        The plan; None if there is none.

    Raises:
        TooManyStatesError: more than `max_states` states are reachable.
    """
    if start in avoided.states or domain.violated_invariant(start) is not None:
        return None
    came_from: _Predecessors = {start: None}
    layer = {start: Fraction(1)}
    while layer:
        reached = [state for state in layer if domain.goal(state) is True]
        if reached:
            return _path(came_from, max(reached, key=lambda state: layer[state]))
        fresh: dict[State, Fraction] = {}
        for state, chance in layer.items():
            for choice, then, share in _successes(domain, state, avoided):
                if then in came_from and fresh.get(then, chance * share) >= chance * share:
                    continue
                if len(came_from) >= max_states:
                    raise TooManyStatesError
                fresh[then] = chance * share
                came_from[then] = (state, choice)
        layer = fresh
    return None


def _successes(
    domain: PlanningDomain, state: State, avoided: AvoidSet
) -> Iterator[tuple[GroundSkill, State, Fraction]]:
    for choice in domain.choices:
        if domain.can_start(choice, state) and (state, choice) not in avoided.pairs:
            for then, outcome, share in domain.after(choice, state):
                allowed = then not in avoided.states and domain.violated_invariant(then) is None
                if allowed and not outcome.failure:
                    yield choice, then, share


_Predecessors: TypeAlias = dict[State, tuple[State, GroundSkill] | None]


def _path(came_from: _Predecessors, state: State) -> PlanPath:
    path: PlanPath = []
    while (step := came_from[state]) is not None:
        path.append(step)
        state = step[0]
    return path[::-1]


class DeleteRelaxation:
    """Reachability if no outcome ever undid anything: an over-approximation of the real one.

    Attributes:
        domain: planning domain.
        values: by name, the values that a variable could ever have.
        steps_to_goal: lower bound of the length of any plan; None if there is no plan.
    """

    def __init__(self, domain: PlanningDomain, start: State) -> None:
        self.domain = domain
        self.values: dict[str, set[Any]] = {
            name: {value} for name, value in zip(domain.names, start, strict=True)
        }
        self.steps_to_goal: int | None = None
        steps = 0
        while True:
            if self.steps_to_goal is None and self.is_possible(domain.goal):
                self.steps_to_goal = steps
            new = [
                (name, value)
                for choice in domain.choices
                if self.is_possible(choice.condition)
                for outcome in choice.skill.outcomes.values()
                if outcome.probability != 0
                for name, effect in outcome.known_effects.items()
                if name in self.values
                for value in self.reached(name, effect)
            ]
            if not new:
                return
            for name, value in new:
                self.values[name].add(value)
            steps += 1

    def reached(self, name: str, effect: Any) -> set[Any]:
        """List the values that an effect adds.

        Args:
            name: a variable.
            effect: effect on it.

        Returns:
            Values that it may leave and that the variable could not have so far.
        """
        after = {value_after(effect, value) for value in self.values[name]}
        if isinstance(effect, Increment):
            after &= {None, *self.domain.settings[name]}
        return after - self.values[name]

    def is_possible(self, condition: PartialCondition) -> bool:
        """Check if a condition is reachable in the relaxation.

        Args:
            condition: condition on states; with more than `_MAX_VALUES` combinations it counts as possible.

        Returns:
            True if some combination of possible values makes it true.
        """
        if condition.missing:
            return False
        values = [self.values[name] for name in condition.reads]
        combinations = 1
        for each in values:
            combinations *= len(each)
        if combinations > _MAX_VALUES:
            return True
        return any(condition.evaluate_on(chosen) is True for chosen in product(*values))
