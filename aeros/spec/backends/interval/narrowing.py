"""What formulas leave of a box, and which of their alternatives it leaves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

from aeros.spec.backends.interval.box import Box, is_empty, known, meet, propagated
from aeros.spec.backends.interval.enclosure import bounds_of, comparison_holds
from aeros.spec.backends.interval.formula import Every, Formula, Other, Some, Within
from aeros.spec.backends.interval.interval import Interval
from aeros.spec.expr import terms as t


@dataclass(slots=True)
class Open:
    """A box, and what is not settled of it: conditions of other kinds, and alternatives."""

    box: Box
    others: list[Other]
    choices: list[Some]

    def copy(self) -> Open:
        """Another that can be narrowed by itself."""
        return Open(dict(self.box), list(self.others), list(self.choices))


_Status: TypeAlias = bool | None
"""Whether a formula holds in all of a box (True), in none of it (False), or neither is known."""


def narrowed(open_: Open, pending: list[Formula]) -> bool:
    """Take in what is pending; whether it leaves each variable a value, and refutes nothing else."""
    box = open_.box
    while pending:
        match pending.pop():
            case Within(of=of, values=values):
                box[of] = meet(known(of, box), values)
                if is_empty(box[of]):
                    return False
            case Every(parts=parts):
                pending.extend(parts)
            case Some() as choice:
                open_.choices.append(choice)
            case Other() as other:
                open_.others.append(other)
    if not propagated(box) or not all(_bounded(other, box) for other in open_.others):
        return False
    return not any(_status_of(other, box) is False for other in open_.others)


def _bounded(other: Other, box: Box) -> bool:
    """Narrow the variable that `other` compares with something bounded; whether values are left."""
    match other.term:
        case t.Compare(op="<" | "<=" as op, left=beside, right=t.Variable(name=name)):
            is_above = other.is_true
        case t.Compare(op="<" | "<=" as op, left=t.Variable(name=name), right=beside):
            is_above = not other.is_true
        case _:
            return True
    bounds = bounds_of(beside, box)
    if bounds is None:
        return True
    # not (left <= right) is right < left
    is_open = (op == "<") is other.is_true
    values = (
        Interval(low=bounds[0], low_open=is_open) if is_above else Interval(high=bounds[1], high_open=is_open)
    )
    box[name] = meet(box[name], values)
    return not is_empty(box[name])


def forced_by(open_: Open) -> list[Formula]:
    """What the box leaves no choice about; the choices that stay open lose what it excludes."""
    choices, open_.choices = open_.choices, []
    forced: list[Formula] = []
    for choice in choices:
        parts = [(part, _status_of(part, open_.box)) for part in choice.parts]
        if any(status is True for _, status in parts):
            continue
        possible = tuple(part for part, status in parts if status is not False)
        if len(possible) == 1:
            forced.append(possible[0])
        else:
            open_.choices.append(Some(possible))
    return forced


def _status_of(formula: Formula, box: Box) -> _Status:
    match formula:
        case Within(of=of, values=values):
            before = known(of, box)
            both = meet(before, values)
            return False if is_empty(both) else True if both == before else None
        case Every(parts=parts):
            return _joined(parts, box, absorbing=False)
        case Some(parts=parts):
            return _joined(parts, box, absorbing=True)
        case Other(term=t.Compare() as term, is_true=is_true):
            found = comparison_holds(term, box)
            return None if found is None else found is is_true
        case _:
            return None


def _joined(parts: Sequence[Formula], box: Box, *, absorbing: bool) -> _Status:
    statuses = [_status_of(part, box) for part in parts]
    if absorbing in statuses:
        return absorbing
    return None if None in statuses else not absorbing
