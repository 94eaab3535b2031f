"""Narrowing of boxes by formulas, and elimination of alternatives that a box excludes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

from aeros.spec.backends.interval.box import Box, intersect, is_empty, propagate_sums, values_in_box
from aeros.spec.backends.interval.enclosure import comparison_truth, interval_of
from aeros.spec.backends.interval.formula import (
    Conjunction,
    Disjunction,
    Formula,
    OpaqueLiteral,
    ValueConstraint,
)
from aeros.spec.backends.interval.interval import Interval
from aeros.spec.expr import terms as t


@dataclass(slots=True)
class SearchState:
    """Box with the conditions that are not settled in it.

    Attributes:
        box: values that variables and sums may still have.
        opaque_literals: conditions that are no value constraints.
        open_disjunctions: disjunctions that are not decided.
    """

    box: Box
    opaque_literals: list[OpaqueLiteral]
    open_disjunctions: list[Disjunction]

    def copy(self) -> SearchState:
        """Copy the state, so that it can be narrowed independently.

        Returns:
            The copy.
        """
        return SearchState(dict(self.box), list(self.opaque_literals), list(self.open_disjunctions))


_Status: TypeAlias = bool | None
"""Truth of a formula over a box: True everywhere, False nowhere, None if neither is known."""


def narrow(open_: SearchState, pending: list[Formula]) -> bool:
    """Narrow a state by formulas.

    Args:
        open_: state to narrow, in place.
        pending: formulas that must hold; used up.

    Returns:
        False if a variable has no value left or a condition is refuted.
    """
    box = open_.box
    while pending:
        match pending.pop():
            case ValueConstraint(subject=of, values=values):
                box[of] = intersect(values_in_box(of, box), values)
                if is_empty(box[of]):
                    return False
            case Conjunction(parts=parts):
                pending.extend(parts)
            case Disjunction() as choice:
                open_.open_disjunctions.append(choice)
            case OpaqueLiteral() as other:
                open_.opaque_literals.append(other)
    if not propagate_sums(box) or not all(
        _narrow_by_comparison(other, box) for other in open_.opaque_literals
    ):
        return False
    return not any(_status_of(other, box) is False for other in open_.opaque_literals)


def _narrow_by_comparison(other: OpaqueLiteral, box: Box) -> bool:
    """Narrow the variable that `other` compares with a bounded term; return False if no values are left."""
    match other.term:
        case t.Compare(op="<" | "<=" as op, left=bound, right=t.Variable(name=name)):
            is_above = other.is_true
        case t.Compare(op="<" | "<=" as op, left=t.Variable(name=name), right=bound):
            is_above = not other.is_true
        case _:
            return True
    bounds = interval_of(bound, box)
    if bounds is None:
        return True
    # not (left <= right) is right < left
    is_open = (op == "<") is other.is_true
    values = (
        Interval(low=bounds[0], low_open=is_open) if is_above else Interval(high=bounds[1], high_open=is_open)
    )
    box[name] = intersect(box[name], values)
    return not is_empty(box[name])


def propagate_disjunctions(open_: SearchState) -> list[Formula]:
    """Remove the alternatives that the box excludes.

    Args:
        open_: state whose open disjunctions are reduced, in place.

    Returns:
        The formulas that are the only alternative left of their disjunction.
    """
    choices, open_.open_disjunctions = open_.open_disjunctions, []
    forced: list[Formula] = []
    for choice in choices:
        parts = [(part, _status_of(part, open_.box)) for part in choice.parts]
        if any(status is True for _, status in parts):
            continue
        possible = tuple(part for part, status in parts if status is not False)
        if len(possible) == 1:
            forced.append(possible[0])
        else:
            open_.open_disjunctions.append(Disjunction(possible))
    return forced


def _status_of(formula: Formula, box: Box) -> _Status:
    match formula:
        case ValueConstraint(subject=of, values=values):
            before = values_in_box(of, box)
            both = intersect(before, values)
            return False if is_empty(both) else True if both == before else None
        case Conjunction(parts=parts):
            return _join_statuses(parts, box, absorbing=False)
        case Disjunction(parts=parts):
            return _join_statuses(parts, box, absorbing=True)
        case OpaqueLiteral(term=t.Compare() as term, is_true=is_true):
            truth = comparison_truth(term, box)
            return None if truth is None else truth is is_true
        case _:
            return None


def _join_statuses(parts: Sequence[Formula], box: Box, *, absorbing: bool) -> _Status:
    statuses = [_status_of(part, box) for part in parts]
    if absorbing in statuses:
        return absorbing
    return None if None in statuses else not absorbing
