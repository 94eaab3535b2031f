"""Strong cyclic strategies: a choice for each state that keeps the goal reachable under every outcome.

They are found by planning for one outcome at a time, as Kuter, Nau, Reisner and Goldman do (“Using classical
planners to solve nondeterministic planning problems”, ICAPS 2008): first a plan that counts on successes,
then a plan from each state that another outcome leads to. A state without a plan is avoided from then on, and
so is every choice that may lead to it. At the end each state that the strategy can reach has a path to the
goal, which Cimatti, Pistore, Roveri and Traverso call strong cyclic (“Weak, strong, and strong cyclic
planning via symbolic model checking”, Artificial Intelligence 147, 2003). If the start itself must be
avoided, there is no such strategy.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from aeros.spec.closed_loop.invocation import State
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.planning.domain import GroundSkill, PlanningDomain
from aeros.spec.planning.search_result import AvoidSet, PlanPath
from aeros.spec.planning.shortest import shortest_plan
from aeros.spec.planning.unreachability import unreachability_reasons

PathFinder = Callable[[PlanningDomain, State, AvoidSet], PlanPath | None]


@dataclass(frozen=True)
class DeadEnd:
    """A state from which the goal cannot be reached.

    Attributes:
        state: the state.
        trace: choices and outcomes that lead to it from the start.
        reason: reason in words.
    """

    state: State
    trace: tuple[str, ...]
    reason: str


class StrongCyclicStrategy:
    """Strong cyclic strategies of one domain, found on demand for each start.

    Attributes:
        domain: planning domain.
        chosen: choice for each state that is covered; never one that may lead to a dead end.
        dead_ends: dead ends in the order found.
    """

    def __init__(self, domain: PlanningDomain, find: PathFinder = shortest_plan) -> None:
        self.domain = domain
        self.chosen: dict[State, GroundSkill] = {}
        self.dead_ends: list[DeadEnd] = []
        self._avoided = AvoidSet()
        self._find = find
        self._solved: set[State] = set()

    def solves(self, start: State) -> bool:
        """Search for a strong cyclic strategy from a state.

        Args:
            start: first state.

        Returns:
            True if there is one; then `chosen` has it.

        Raises:
            PlanUndecidedError: the search was given up.
        """
        if start in self._solved:
            return True
        while start not in self._avoided.states:
            came_from, unprovided = self._explore(start)
            if unprovided is not None:
                self._extend(start, unprovided, came_from)
                continue
            path = self._find(self.domain, start, self._avoided)
            # What has come to be avoided since may have let a shorter way be found than was followed.
            if path is not None and len(path) < self.distance_to_goal(start):
                self.chosen.update(path)
                continue
            self._solved.update(came_from)
            return True
        return False

    def distance_to_goal(self, state: State) -> int:
        """Count the steps of `chosen` to the goal if each has the outcome that it counts on.

        Args:
            state: a covered state.

        Returns:
            The minimum number of steps.

        Raises:
            InternalError: a fault of AEROS: the strategy does not lead to the goal.
        """
        seen, pending = {state}, deque([(state, 0)])
        while pending:
            here, steps = pending.popleft()
            if self.domain.goal(here) is True:
                return steps
            for then, outcome, _ in self.domain.after(self.chosen[here], here):
                if not outcome.failure and then not in seen:
                    seen.add(then)
                    pending.append((then, steps + 1))
        raise InternalError("a strategy does not lead to the goal")

    def reachable_from(self, start: State) -> list[State]:
        """List the states that `chosen` may lead to.

        Args:
            start: first state.

        Returns:
            The states in breadth-first order.
        """
        return list(self._explore(start)[0])

    def _explore(self, start: State) -> tuple[dict[State, tuple[State, str] | None], State | None]:
        """Return the reachable states, each with its predecessor, and the first uncovered state, if any."""
        came_from: dict[State, tuple[State, str] | None] = {start: None}
        pending = deque([start])
        while pending:
            state = pending.popleft()
            if self.domain.violated_invariant(state) is None and self.domain.goal(state) is True:
                continue
            choice = self.chosen.get(state)
            if choice is None:
                return came_from, state
            for then, outcome, _ in self.domain.after(choice, state):
                if then not in came_from:
                    came_from[then] = (state, f"{choice.name} → {outcome.id}")
                    pending.append(then)
        return came_from, None

    def _extend(self, start: State, state: State, came_from: dict[State, tuple[State, str] | None]) -> None:
        path = None
        if state not in self._avoided.states and self.domain.violated_invariant(state) is None:
            path = self._find(self.domain, state, self._avoided)
        if path is not None:
            self.chosen.update(path)
            return
        if state not in self._avoided.states:
            why = unreachability_reasons(self.domain, state, risky=bool(self._avoided.pairs))
            self.dead_ends.append(DeadEnd(state, tuple(_trace(came_from, state)), why))
            self._avoided.states.add(state)
        for here, choice in list(self.chosen.items()):
            if any(then == state for then, _, _ in self.domain.after(choice, here)):
                self._avoided.pairs.add((here, choice))
                del self.chosen[here]


def _trace(came_from: dict[State, tuple[State, str] | None], state: State) -> Iterator[str]:
    step = came_from[state]
    if step is not None:
        yield from _trace(came_from, step[0])
        yield step[1]
