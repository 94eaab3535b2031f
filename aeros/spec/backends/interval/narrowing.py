"""What formulas leave of a box, and which of their alternatives it leaves."""

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
    """A box, and what is not settled of it: conditions of other kinds, and alternatives."""

    box: Box
    opaque_literals: list[OpaqueLiteral]
    open_disjunctions: list[Disjunction]

    def copy(self) -> SearchState:
        """Another that can be narrowed by itself."""
        return SearchState(dict(self.box), list(self.opaque_literals), list(self.open_disjunctions))


_Status: TypeAlias = bool | None
"""Whether a formula holds in all of a box (True), in none of it (False), or neither is known."""


def narrow(open_: SearchState, pending: list[Formula]) -> bool:
    """Take in what is pending; whether it leaves each variable a value, and refutes nothing else."""
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
    """Narrow the variable that `other` compares with something bounded; whether values are left."""
    match other.term:
        case t.Compare(op="<" | "<=" as op, left=beside, right=t.Variable(name=name)):
            is_above = other.is_true
        case t.Compare(op="<" | "<=" as op, left=t.Variable(name=name), right=beside):
            is_above = not other.is_true
        case _:
            return True
    bounds = interval_of(beside, box)
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
    """What the box leaves no choice about; the choices that stay open lose what it excludes."""
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
            found = comparison_truth(term, box)
            return None if found is None else found is is_true
        case _:
            return None


def _join_statuses(parts: Sequence[Formula], box: Box, *, absorbing: bool) -> _Status:
    statuses = [_status_of(part, box) for part in parts]
    if absorbing in statuses:
        return absorbing
    return None if None in statuses else not absorbing
