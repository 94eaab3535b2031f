"""Conversion of a strong cyclic strategy to a task graph: its path to the goal, assuming that steps succeed.

A step with several successes is followed by an `if` on what is measured then. Reactions to failure become the
step's retries and its `between_tries`, if the strategy covers every state that these can lead to. The graph
ends where the conversion runs into a cycle, grows too large, or cannot distinguish states by measurement:
there the agent plans again, from the state that it has reached.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

from aeros.agent.planning.task_graph import PLAN_SPAN, Part, PlanStep, TaskGraph
from aeros.spec.closed_loop.invocation import State
from aeros.spec.expr import terms as t
from aeros.spec.expr.constants import equality_condition
from aeros.spec.expr.unparse import unparse
from aeros.spec.model.step_graph import If, Seq
from aeros.spec.planning.domain import GroundSkill
from aeros.spec.planning.search_result import PlanUndecidedError
from aeros.spec.planning.strong_cyclic import StrongCyclicStrategy

_MAX_STEPS: Final = 60
_MAX_DEPTH: Final = 6


def strategy_to_graph(strategy: StrongCyclicStrategy, start: State, retries: int) -> TaskGraph:
    """Convert the part of the strategy that starts in `start`.

    Args:
        strategy: strategy that solves `start`.
        start: current state.
        retries: maximum number of retries of a step.

    Returns:
        The plan.
    """
    return TaskGraph(tuple(_GraphBuilder(strategy, retries).parts(start, frozenset(), 0)))


class _GraphBuilder:
    """Builder of one graph. `_cures` holds, by skill, the skills that run after its failure."""

    def __init__(self, strategy: StrongCyclicStrategy, retries: int) -> None:
        self._strategy = strategy
        self._domain = strategy.domain
        self._retries = retries
        self._left = _MAX_STEPS
        self._cures: dict[str, set[str]] = {}

    def parts(self, state: State, above: frozenset[State], level: int) -> list[Part]:
        """Build the parts from `state` on; `above` are the states on the path to it."""
        parts: list[Part] = []
        while self._domain.goal(state) is not True and state not in above and self._left > 0:
            self._left -= 1
            above |= {state}
            step, successes = self._step(state, self._strategy.chosen[state])
            parts.append(step)
            if len(successes) > 1:
                return parts + self._branch(successes, above, level + 1)
            (state,) = successes
        return parts

    def _step(self, state: State, choice: GroundSkill) -> tuple[PlanStep, list[State]]:
        """Return the step with the most recovery that the strategy covers, and its success states."""
        cure = self._recovery_for(state, choice)
        for retry, helper in [*([(self._retries, cure)] if cure else []), (self._retries, None), (0, None)]:
            successes, visited, is_of_use = self._attempt_states(state, choice, retry, helper)
            if retry == 0 or (is_of_use and all(self._is_covered(one) for one in visited)):
                break
        if helper is not None:
            self._cures.setdefault(choice.name, set()).add(helper.name)
        between = None if helper is None or not retry else PlanStep(helper.module, helper.skill.id)
        return PlanStep(choice.module, choice.skill.id, choice.inputs, retry, between), successes

    def _is_covered(self, state: State) -> bool:
        try:
            return self._strategy.solves(state)
        except PlanUndecidedError:
            return False

    def _recovery_for(self, state: State, choice: GroundSkill) -> GroundSkill | None:
        """Return the strategy's reaction to failure, if it is one skill that fits `between_tries`."""
        wanted: dict[GroundSkill, None] = {}
        for then, outcome, _ in self._domain.after(choice, state):
            chosen = self._strategy.chosen.get(then)
            if outcome.failure and chosen is not None and chosen is not choice:
                wanted[chosen] = None
        if len(wanted) != 1:
            return None
        (cure,) = wanted
        return cure if not cure.inputs and choice.name not in self._recovery_skills(cure.name) else None

    def _recovery_skills(self, name: str) -> set[str]:
        """Return `name` and every skill that may run after its failure, transitively."""
        found, pending = {name}, [name]
        while pending:
            fresh = self._cures.get(pending.pop(), set()) - found
            found |= fresh
            pending += fresh
        return found

    def _attempt_states(
        self, state: State, choice: GroundSkill, retry: int, cure: GroundSkill | None
    ) -> tuple[list[State], set[State], bool]:
        """Return the success states, all states that can occur, and True if every attempt can start."""
        successes: dict[State, None] = {}
        visited: set[State] = set()
        here: Iterable[State] = [state]
        is_of_use = True
        for left in range(retry, -1, -1):
            failures: dict[State, None] = {}
            is_of_use &= any(self._domain.can_start(choice, one) for one in here)
            for one in here:
                if self._domain.can_start(choice, one):
                    for then, outcome, _ in self._domain.after(choice, one):
                        (failures if outcome.failure else successes)[then] = None
            visited |= {*successes, *failures}
            here = failures
            if left and cure is not None:
                here = self._recovered_states(cure, failures)
                visited |= {*here}
        return list(successes), visited, is_of_use

    def _recovered_states(self, cure: GroundSkill, failures: Iterable[State]) -> dict[State, None]:
        found: dict[State, None] = {}
        for one in failures:
            if self._domain.can_start(cure, one):
                found |= dict.fromkeys(then for then, _, _ in self._domain.after(cure, one))
            else:
                found[one] = None
        return found

    # Several successes.

    def _branch(self, states: Sequence[State], above: frozenset[State], level: int) -> list[Part]:
        """Build the parts after several successes: an `if` for the differences, then the common end."""
        differing = [place for place, values in enumerate(zip(*states, strict=True)) if len({*values}) > 1]
        unknown = any(one[place] is None for one in states for place in differing)
        if unknown or level > _MAX_DEPTH:
            return []
        ways = {state: self.parts(state, above, level) for state in states}
        shared = _common_suffix(list(ways.values()))
        groups: list[tuple[list[Part], list[State]]] = []
        for state, way in ways.items():
            own = way[: len(way) - len(shared)]
            known = next((group for group in groups if group[0] == own), None)
            if known is None:
                groups.append((own, [state]))
            else:
                known[1].append(state)
        groups.sort(key=lambda group: -len(group[0]))
        *conditional, (rest, _) = groups
        part: Part = Seq(tuple(rest))
        for own, members in reversed(conditional):
            others = [state for state in states if state not in members]
            condition = self._distinguishing_condition(members, others)
            part = If(condition, unparse(condition), Seq(tuple(own)), part, PLAN_SPAN)
        return [part, *shared] if conditional else [*rest, *shared]

    def _distinguishing_condition(self, members: Sequence[State], others: Sequence[State]) -> t.Term:
        """Return a condition that holds in all of `members` and in none of `others`."""
        ways = [self._difference(state, others) for state in members]
        return ways[0] if len(ways) == 1 else t.Or(tuple(dict.fromkeys(ways)))

    def _difference(self, state: State, others: Sequence[State]) -> t.Term:
        places = range(len(state))
        differing = [at for at in places if all(state[at] != other[at] for other in others)][:1]
        differing = differing or [at for at in places if any(state[at] != other[at] for other in others)]
        names = self._domain.names
        terms = [equality_condition(self._domain.variables[names[at]], state[at]) for at in differing]
        return t.conjunction(*terms)


def _common_suffix(ways: Sequence[list[Part]]) -> list[Part]:
    """Return the longest list of parts that all of `ways` end with."""
    first = ways[0]
    length = 0
    while length < min(map(len, ways)) and all(way[-1 - length] == first[-1 - length] for way in ways):
        length += 1
    return first[len(first) - length :]
