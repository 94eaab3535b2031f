"""Bounds of a task's probability of success, where no exact prediction exists.

Nothing tells which branch of a `par` fails first, or which value a predicate has that an outcome leaves open.
So there the state that follows is chosen: by an opponent for the lower bound, by a helper for the upper one.
The agent's loop is then a Markov decision process without cycles, as in `markov_chain`.  The bounds are its
least and greatest probability of reaching the goal (C. Baier and J.-P. Katoen, Principles of Model Checking,
2008, section 10.6), computed backwards from the ends, in fractions.

The helper and the opponent may choose what no run does, such as a branch that overtakes itself.  So the true
probability lies within the bounds, and need not come near them.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Final

from aeros.spec.closed_loop.invocation import State
from aeros.spec.closed_loop.loop_variables import StateSpaceError
from aeros.spec.closed_loop.markov_chain import rank_of
from aeros.spec.closed_loop.transition_system import LoopState, Transition, TransitionSystem

MAX_NODES: Final = 200_000
"""Largest number of states of one chain; takes some ten seconds."""

_Node = tuple[int, LoopState]


@dataclass(frozen=True, slots=True)
class SuccessBounds:
    """Bounds of the probability that the goal is reached (0 to 1).

    Attributes:
        at_least: lower bound.
        at_most: upper bound.
    """

    at_least: Fraction
    at_most: Fraction


def bound_success(system: TransitionSystem, start: State, replans: int) -> SuccessBounds:
    """Bound the probability that a task reaches its goal from one state.

    Args:
        system: transition system of the task.
        start: values of the predicates at the start, in the order of `system.names`.
        replans: largest number of plans after the first.

    Returns:
        The bounds; they are equal where every probability is known.

    Raises:
        StateSpaceError: the chain has more than `MAX_NODES` states.
    """
    first = (0, LoopState("plan", start))
    moves: dict[_Node, list[_Cases]] = {}
    pending = [first]
    while pending:
        node = pending.pop()
        if node in moves:
            continue
        if len(moves) == MAX_NODES:
            raise StateSpaceError("its Markov chain is too large for bounds of its success")
        moves[node] = list(_cases(node, system, replans))
        pending += (target for _, targets in moves[node] for target in targets)
    order = sorted(moves, key=lambda node: rank_of(*node), reverse=True)
    return SuccessBounds(_extreme(order, moves, min), _extreme(order, moves, max))


_Cases = tuple[Fraction, tuple[_Node, ...]]
"""A probability, and the states among which nothing decides."""


def _cases(node: _Node, system: TransitionSystem, replans: int) -> Iterable[_Cases]:
    made, loop = node
    found = system.transitions(loop)
    if loop.phase == "plan" and made > replans and found[0].target.phase != "reached":
        return
    together: dict[tuple[str, str], list[Transition]] = defaultdict(list)
    undecided: dict[str, list[Transition]] = defaultdict(list)
    for move in found:
        if move.undecided:
            undecided[move.choice].append(move)
            if move.case or move.is_open:  # then its own probability means nothing
                continue
        if move.case:
            together[move.choice, move.case].append(move)
        elif move.probability:
            yield move.probability, _targets(made, [move])
    for several in together.values():
        share = sum((move.probability for move in several), Fraction(0))
        if share:
            yield share, _targets(made, several)
    for several in undecided.values():
        yield several[0].undecided, _targets(made, several)


def _targets(made: int, moves: Iterable[Transition]) -> tuple[_Node, ...]:
    return tuple(dict.fromkeys((made + (move.target.phase == "plan"), move.target) for move in moves))


def _extreme(
    order: Sequence[_Node],
    moves: dict[_Node, list[_Cases]],
    choose: Callable[[Iterable[Fraction]], Fraction],
) -> Fraction:
    """Return the probability of the last state in the order, which is the start."""
    value: dict[_Node, Fraction] = {}
    for node in order:
        if node[1].phase == "reached":
            value[node] = Fraction(1)
        else:
            cases = ((share, choose([value[one] for one in targets])) for share, targets in moves[node])
            value[node] = sum((share * best for share, best in cases), Fraction(0))
    return value[order[-1]]
