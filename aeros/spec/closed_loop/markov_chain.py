"""Exact prediction of a task's closed loop: an absorbing Markov chain, solved without rounding.

A state of the chain is a node of the transition system and the number of re-plans made so far.  Every move
leads forward: to a later step, to a further try of the same step, or to the next plan.  So the chain has no
cycle, and one pass in that order gives each state the probability that the loop ever reaches it:
reach(s) = Σ over moves r → s of reach(r) · p(r → s).  By linearity, an expected count is the sum of
reach(r) · p over the moves that count.

Assumes that outcomes are independent of each other and of the past (experiments on correlated failures
measure how much that matters), and what the transition system assumes.
"""

from __future__ import annotations

import heapq
import itertools
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Final

from aeros.spec.closed_loop.composed_run import ROLES
from aeros.spec.closed_loop.invocation import State
from aeros.spec.closed_loop.loop_variables import StateSpaceError
from aeros.spec.closed_loop.transition_system import LoopState, TransitionSystem

MAX_WORK: Final = 100_000_000
"""Largest total size (bits) of the probabilities in one prediction; takes some ten seconds."""


@dataclass(frozen=True, slots=True)
class Prediction:
    """The probability that the goal is reached, and expected counts over runs that reach it or not.

    Attributes:
        success: probability that the goal is reached.
        invocations: expected number of skills submitted.
        retries: expected number of these that are further tries of a step.
        recoveries: expected number of these that are run after a failure, by `between_tries` or `on_failure`.
        replans: expected number of plans made after the first.
        seconds: expected time in skills, s; None if a composition may run, whose branches overlap.
    """

    success: Fraction
    invocations: Fraction
    retries: Fraction
    recoveries: Fraction
    replans: Fraction
    seconds: Fraction | None = field(default=None, compare=False)


class InexactError(StateSpaceError):
    """Some probability is not known, so success has bounds only."""


def predict(system: TransitionSystem, start: State, replans: int) -> Prediction:
    """Predict the runs of a task from one state.

    Args:
        system: transition system of the task.
        start: values of the predicates at the start, in the order of `system.names`.
        replans: largest number of plans after the first.

    Returns:
        The exact probability of success and the expected counts.

    Raises:
        StateSpaceError: the chain needs more than `MAX_WORK` bits of probabilities.
        InexactError: a step runs a composition whose parallel branches may fail, or an outcome leaves a
            predicate at either value.
    """
    queue = _Queue()
    queue.push(0, LoopState("plan", start), Fraction(1))
    success = replanned = Fraction(0)
    seconds: Fraction | None = Fraction(0)
    submitted = dict.fromkeys(ROLES, Fraction(0))
    while queue:
        made, node, probability = queue.pop()
        moves = system.transitions(node)
        if node.phase == "reached":
            success += probability
        elif node.phase == "rejected" and made < replans:
            # The agent plans once more, the plan is rejected for the same reason, and the agent gives up.
            replanned += probability
        elif node.phase == "plan" and made and moves[0].target.phase not in ("reached", "given up"):
            if made > replans:
                continue
            replanned += probability
        for move in moves:
            share = probability * move.probability
            if move.counts is not None:
                for role, count in zip(ROLES, move.counts, strict=True):
                    submitted[role] += share * count
            elif move.role is not None:
                submitted[move.role] += share
            if seconds is not None and share and move.role is not None:
                seconds = None if move.seconds is None else seconds + share * move.seconds
            queue.push(made + (move.target.phase == "plan"), move.target, share)
    if system.inexact_reason:
        raise InexactError(system.inexact_reason)
    return Prediction(
        success=success,
        invocations=sum(submitted.values(), Fraction(0)),
        retries=submitted["retry"],
        recoveries=submitted["recovery"],
        replans=replanned,
        seconds=seconds,
    )


class _Queue:
    """Queue of the chain's states with their probabilities; a state comes out when no move to it is left."""

    def __init__(self) -> None:
        self._reach: dict[tuple[int, LoopState], Fraction] = {}
        self._order: list[tuple[tuple[int, ...], int, tuple[int, LoopState]]] = []
        self._tickets = itertools.count()
        self._work = 0

    def __len__(self) -> int:
        return len(self._order)

    def push(self, made: int, node: LoopState, probability: Fraction) -> None:
        if not probability:
            return
        state = (made, node)
        if state not in self._reach:
            heapq.heappush(self._order, (rank_of(made, node), next(self._tickets), state))
        self._reach[state] = self._reach.get(state, Fraction(0)) + probability

    def pop(self) -> tuple[int, LoopState, Fraction]:
        _, _, (made, node) = heapq.heappop(self._order)
        probability = self._reach.pop((made, node))
        self._work += probability.denominator.bit_length()
        if self._work > MAX_WORK:
            raise StateSpaceError("its Markov chain is too large to be solved exactly")
        return made, node, probability


def rank_of(made: int, node: LoopState) -> tuple[int, ...]:
    """Rank a state so that every move leads to a higher rank.

    The order is by re-plans, then by steps done, then by tries; the recovery comes before the next try.  What
    follows the last try of a step is like a recovery after the last step.

    Args:
        made: plans made after the first.
        node: state of the loop.

    Returns:
        The rank, compared as tuples are.
    """
    if node.phase == "plan":
        return (made, 0)
    ended = node.phase in ("reached", "rejected", "given up")
    return (made, 2 if ended else 1, -len(node.remaining_rules), node.tries, node.phase == "try")
