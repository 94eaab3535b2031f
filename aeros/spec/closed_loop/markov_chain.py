"""What a task's closed loop comes to, exactly: an absorbing Markov chain, solved without rounding.

States of the chain are a node of the transition system and the re-plans made so far.  Every move leads
on: to a later step, to a further try of the same, or to the next plan.  So the chain has no cycle, and
one pass in that order gives each state the probability that the loop ever comes to it:
reach(s) = Σ over moves r → s of reach(r) · p(r → s).  By linearity an expected count is the sum of
reach(r) · p over the moves that count.
Assumes: outcomes are independent of each other and of the past (experiments on correlated failures
measure how much that matters), and what the transition system assumes.
"""

from __future__ import annotations

import heapq
import itertools
from dataclasses import dataclass
from fractions import Fraction
from typing import Final

from aeros.spec.closed_loop.invocation import State
from aeros.spec.closed_loop.transition_system import LoopState, StateSpaceError, TransitionSystem

MAX_WORK: Final = 100_000_000
"""Bits of all probabilities that one prediction may add up; some ten seconds."""


@dataclass(frozen=True, slots=True)
class Prediction:
    """The probability that the goal is reached, and expected counts over runs that reach it or not.

    invocations: skills submitted, of which `retries` are further tries and `recoveries` are `on_failure`.
    replans: plans made after the first.
    """

    success: Fraction
    invocations: Fraction
    retries: Fraction
    recoveries: Fraction
    replans: Fraction


def predict(system: TransitionSystem, start: State, replans: int) -> Prediction:
    """The prediction for runs from `start` with at most `replans` re-plans; raises `StateSpaceError`."""
    queue = _Queue()
    queue.push(0, LoopState("plan", start), Fraction(1))
    success = replanned = Fraction(0)
    submitted = {"step": Fraction(0), "retry": Fraction(0), "recovery": Fraction(0)}
    while queue:
        made, node, probability = queue.pop()
        moves = system.transitions(node)
        if node.phase == "reached":
            success += probability
        elif node.phase == "rejected" and made < replans:
            # It is made once more, rejected for the same reason, and then the agent gives up.
            replanned += probability
        elif node.phase == "plan" and made and moves[0].target.phase != "reached":
            if made > replans:
                continue
            replanned += probability
        for move in moves:
            share = probability * move.probability
            if move.role is not None:
                submitted[move.role] += share
            queue.push(made + (move.target.phase == "plan"), move.target, share)
    return Prediction(
        success=success,
        invocations=sum(submitted.values(), Fraction(0)),
        retries=submitted["retry"],
        recoveries=submitted["recovery"],
        replans=replanned,
    )


class _Queue:
    """States of the chain with their probabilities, each taken when no move to it is left."""

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
            heapq.heappush(self._order, (_rank(made, node), next(self._tickets), state))
        self._reach[state] = self._reach.get(state, Fraction(0)) + probability

    def pop(self) -> tuple[int, LoopState, Fraction]:
        _, _, (made, node) = heapq.heappop(self._order)
        probability = self._reach.pop((made, node))
        self._work += probability.denominator.bit_length()
        if self._work > MAX_WORK:
            raise StateSpaceError("its chain of states is too large to be solved exactly")
        return made, node, probability


def _rank(made: int, node: LoopState) -> tuple[int, ...]:
    """Grows with every move: re-plans, then steps done, then tries, of each the recovery before the try."""
    if node.phase == "plan":
        return (made, 0)
    ended = node.phase in ("reached", "rejected")
    return (made, 2 if ended else 1, -len(node.remaining_rules), node.tries, node.phase == "try")
