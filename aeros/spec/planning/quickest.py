"""Plan with the least expected time if each step has a success, by Dijkstra's algorithm.

A step is tried until it succeeds, and each failure costs time (`expected_time.py`). The risk of a plan is the
probability that some step fails in each of its r + 1 tries, with failure probabilities q:

    risk = 1 - prod(1 - q^(r + 1))

A weight adds -w * log(1 - q^(r + 1)) seconds to each step, so that a larger weight prefers less risk.

Assumes: outcomes are independent. Durations and probabilities are those that the skills declare, or those
that the agent's memory has put in their place (`aeros.agent.memory.experience`).
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count
from math import log
from typing import Final

from aeros.spec.closed_loop.invocation import State
from aeros.spec.model.expected_time import LEAST_SUCCESS, expected_time
from aeros.spec.planning.domain import GroundSkill, PlanningDomain
from aeros.spec.planning.search_result import AvoidSet, PlanPath
from aeros.spec.planning.shortest import MAX_ENUMERATED_STATES, shortest_plan
from aeros.spec.planning.strong_cyclic import StrongCyclicStrategy

MAX_RISK: Final = 0.05
"""Probability that some step of a plan fails in all its tries, above which time gives way to it."""

RISK_WEIGHTS: Final = (0.0, 100.0, 1_000.0, 100_000.0)
"""Weights of the risk that are tried in turn, s."""


@dataclass(frozen=True, slots=True)
class PlanEstimate:
    """Estimate of a plan whose steps succeed in the end.

    Attributes:
        seconds: expected time, s.
        risk: probability that some step fails in all its tries.
    """

    seconds: float
    risk: float


@dataclass(frozen=True, slots=True)
class QuickestPath:
    """Path finder of a strategy.

    Attributes:
        risk_weight: weight of the risk, s.
        retries: further tries of each step after its first.
        most_states: number of states up to which all are searched; in larger domains the path is the one with
            the fewest steps.
    """

    risk_weight: float
    retries: int
    most_states: int = MAX_ENUMERATED_STATES

    def __call__(self, domain: PlanningDomain, start: State, avoided: AvoidSet) -> PlanPath | None:
        """Find the path.

        Args:
            domain: planning domain.
            start: first state.
            avoided: states and pairs that the path must avoid.

        Returns:
            The path; None if it is proved that there is none.

        Raises:
            PlanUndecidedError: the domain is large, and the solver gives up.
        """
        if start in avoided.states or domain.violated_invariant(start) is not None:
            return None
        order = count()  # so that states are never compared
        pending: list[tuple[float, int, State]] = [(0.0, next(order), start)]
        costs: dict[State, float] = {start: 0.0}
        came_from: dict[State, tuple[State, GroundSkill]] = {}
        done: set[State] = set()
        while pending:
            cost, _, state = heapq.heappop(pending)
            if state in done:
                continue
            done.add(state)
            if domain.goal(state) is True:
                return _path(came_from, state)
            if len(costs) > self.most_states:
                return shortest_plan(domain, start, avoided)
            for choice, then, step_cost in self._steps(domain, state, avoided):
                if cost + step_cost < costs.get(then, float("inf")):
                    costs[then] = cost + step_cost
                    came_from[then] = (state, choice)
                    heapq.heappush(pending, (costs[then], next(order), then))
        return None

    def _steps(
        self, domain: PlanningDomain, state: State, avoided: AvoidSet
    ) -> Iterator[tuple[GroundSkill, State, float]]:
        for choice in domain.choices:
            if (state, choice) in avoided.pairs or not domain.can_start(choice, state):
                continue
            step = estimate_step(domain, choice, state, self.retries)
            cost = step.seconds - self.risk_weight * log(max(1.0 - step.risk, LEAST_SUCCESS))
            for then, outcome, share in domain.after(choice, state):
                allowed = then not in avoided.states and domain.violated_invariant(then) is None
                if allowed and not outcome.failure:
                    # Of several successes the plan counts on one: the more probable, the better.
                    yield choice, then, cost + 1e-3 * (1.0 - float(share))


def estimate_step(domain: PlanningDomain, choice: GroundSkill, state: State, retries: int) -> PlanEstimate:
    """Estimate a step that is tried until it succeeds.

    Args:
        domain: planning domain.
        choice: skill of the step.
        state: state in which it starts.
        retries: further tries after the first, for the risk.

    Returns:
        Its expected time, with its wear as time, and the probability that all its tries fail.
    """
    seconds, failure = float(choice.skill.wear), 0.0
    for _, outcome, share in domain.after(choice, state):
        took = float(outcome.known_duration)
        seconds += float(share) * took
        failure += float(share) * outcome.failure
    return PlanEstimate(expected_time(seconds, 1.0 - failure), failure ** (retries + 1))


def estimate_strategy(strategy: StrongCyclicStrategy, start: State, retries: int) -> PlanEstimate:
    """Estimate the path of a strategy on which each step has its most probable success.

    Args:
        strategy: strategy that solves `start`.
        start: first state.
        retries: further tries of each step.

    Returns:
        Expected time and risk of the steps to the goal, or until the path comes back to a state.
    """
    domain, state, seen = strategy.domain, start, set[State]()
    seconds, success = 0.0, 1.0
    while domain.goal(state) is not True and state not in seen:
        seen.add(state)
        choice = strategy.chosen[state]
        step = estimate_step(domain, choice, state, retries)
        seconds += step.seconds
        success *= 1.0 - step.risk
        state = max(
            (way for way in domain.after(choice, state) if not way[1].failure), key=lambda way: way[2]
        )[0]
    return PlanEstimate(seconds, 1.0 - success)


def quickest_strategy(
    domain: PlanningDomain, start: State, retries: int, max_risk: float = MAX_RISK
) -> StrongCyclicStrategy:
    """Find the strategy with the least expected time whose risk is within a bound.

    Args:
        domain: planning domain.
        start: first state.
        retries: further tries of each step.
        max_risk: bound of the risk, in [0, 1].

    Returns:
        The strategy, with the least risk that was found if none is within the bound; one that does not solve
        `start` if there is none.

    Raises:
        PlanUndecidedError: the search was given up.
    """
    best: tuple[float, StrongCyclicStrategy] | None = None
    for weight in RISK_WEIGHTS:
        strategy = StrongCyclicStrategy(domain, QuickestPath(weight, retries))
        if not strategy.solves(start):
            return strategy
        risk = estimate_strategy(strategy, start, retries).risk
        if risk <= max_risk:
            return strategy
        if best is None or risk < best[0]:
            best = risk, strategy
    assert best is not None  # noqa: S101  there are weights
    return best[1]


def _path(came_from: dict[State, tuple[State, GroundSkill]], state: State) -> PlanPath:
    path: PlanPath = []
    while state in came_from:
        step = came_from[state]
        path.append(step)
        state = step[0]
    return path[::-1]
