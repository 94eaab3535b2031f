"""Form of the agent's loop as a program: places, and moves between them that are guarded by conditions.

A place is a point of the loop, such as "about to try the second rule's step for the third time".  The rest of
a state of the loop is values of variables: those of the task, and one truth value for each rule that tells
whether it is in the current plan and still to be run.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, Final, Literal

from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import junction
from aeros.spec.expr.types import BOOL

PlaceKind = Literal["plan", "try", "recover", "reset", "reached", "rejected", "given up", "inside"]

AFTERWARDS: Final = " afterwards"
"""End of the name of a variable's value after a move."""


@dataclass(frozen=True, slots=True)
class Place:
    """Point of the loop.

    Attributes:
        kind: phase of `LoopState`, or `inside` for a point inside a composition or between two phases.
        rule: index of the rule whose step is tried; the number of rules after the last one.
        tries: failed tries of that step.
        number: number of a point of kind `inside`.
    """

    kind: PlaceKind
    rule: int = 0
    tries: int = 0
    number: int = 0


@dataclass(frozen=True, slots=True)
class End:
    """Place to which a branch leads under a condition.

    Attributes:
        guard: condition on the values before, and on the values afterwards of variables that are open.
        target: the place.
    """

    guard: t.Term
    target: Place


@dataclass(frozen=True, slots=True)
class ProgramBranch:
    """One thing that may happen in a move.

    Attributes:
        guard: condition on the values before, under which it may happen.
        ends: where it leads; the conditions exclude each other.
        updates: value afterwards of each variable that changes, as a term over the values before.
        opened: values of variables of which nothing decides which they have afterwards.
        is_likely: False if its probability is 0: it may do harm, and is no way to the goal.
    """

    guard: t.Term
    ends: tuple[End, ...]
    updates: Mapping[str, t.Term] = field(default_factory=dict)
    opened: Mapping[str, tuple[Any, ...]] = field(default_factory=dict)
    is_likely: bool = True


@dataclass(frozen=True, slots=True)
class Move:
    """A choice of the agent, and what may happen then.

    Attributes:
        guard: condition under which the agent may choose it.
        branches: what may happen; chance decides.
    """

    guard: t.Term
    branches: tuple[ProgramBranch, ...]


@dataclass
class LoopProgram:
    """The agent's loop on one task.

    Attributes:
        values: values of each variable, by name; those of quantities stand for cells.
        variables: the variables as terms, by name.
        breakpoints: values of each quantity that are cells of their own, by name.
        moves: the moves from each place; a place without moves ends the loop.  A place comes after all to
            which its moves lead, but the first of a plan.
        first_tries: for each rule, the condition under which its step is due at its first try, and the
            conditions under which each of its alternatives can start.
        goal: the task's goal.
        invariants: the task's invariants, by name.
    """

    values: dict[str, tuple[Any, ...]]
    variables: dict[str, t.Variable]
    breakpoints: dict[str, frozenset[Fraction]]
    moves: dict[Place, tuple[Move, ...]]
    first_tries: list[tuple[t.Term, list[t.Term]]]
    goal: t.Term
    invariants: dict[str, t.Term]

    @property
    def plan_bits(self) -> tuple[str, ...]:
        """Names of the variables that tell whether a rule is in the plan, in the order of the rules."""
        return tuple(plan_bit(number).name for number in range(len(self.first_tries)))

    def branches(self, place: Place) -> Iterator[tuple[Move, ProgramBranch]]:
        """List what may happen at a place.

        Args:
            place: the place.

        Yields:
            Each branch with its move.
        """
        for move in self.moves[place]:
            for branch in move.branches:
                yield move, branch


PLAN: Final = Place("plan")
REACHED: Final = Place("reached")
REJECTED: Final = Place("rejected")


def plan_bit(rule: int) -> t.Variable:
    """Name the variable that tells whether a rule is in the current plan and still to be run.

    Args:
        rule: index of the rule.

    Returns:
        The variable.
    """
    return t.Variable(f"rule {rule} is due", BOOL, t.VariableRole.STATE)


def afterwards(variable: t.Variable) -> t.Variable:
    """Name the value of a variable after a move.

    Args:
        variable: the variable.

    Returns:
        A variable of the same type.
    """
    return t.Variable(f"{variable.name}{AFTERWARDS}", variable.type, variable.role)


def step(guard: t.Term, target: Place, updates: Mapping[str, t.Term] | None = None) -> Move:
    """Make a move in which only one thing may happen.

    Args:
        guard: condition under which it is made.
        target: where it leads.
        updates: variables that change.

    Returns:
        The move.
    """
    return Move(guard, (ProgramBranch(t.TRUE, (End(t.TRUE, target),), updates or {}),))


def all_of(*terms: t.Term) -> t.Term:
    """Join conditions by `and`.

    Args:
        terms: the conditions.

    Returns:
        True if there are none.
    """
    return junction(t.And, terms)


def any_of(terms: Sequence[t.Term]) -> t.Term:
    """Join conditions by `or`.

    Args:
        terms: the conditions.

    Returns:
        False if there are none.
    """
    return junction(t.Or, terms)
