"""Search for the conditions of an obligation that are at fault, each with its place in a file.

A claim that something can hold fails by a core: conditions that cannot hold together although all
but any one of them can.  A claim that something always holds fails by the conditions that its
witness breaks.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

from aeros.spec.backends.oracle import Oracle
from aeros.spec.diagnostics.codes import SpanLabel
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import is_true
from aeros.spec.model.variables import Declared
from aeros.spec.obligations.obligation import LabelledConjunct, Obligation
from aeros.spec.verification.queries import is_unsatisfiable
from aeros.spec.verification.witness import Witness

_T = TypeVar("_T")


@dataclass(frozen=True)
class UnsatCore:
    """Conditions and declared ranges that cannot hold together; without any one of them, the rest can.

    Where the budget ran out for a member, it is kept, so a core may be larger than necessary.

    Attributes:
        members: the conditions.
        ranges: the variables whose ranges belong to the core.
    """

    members: tuple[LabelledConjunct, ...]
    ranges: tuple[Declared, ...]


def find_unsat_core(obligation: Obligation, oracle: Oracle) -> UnsatCore | None:
    """Find the core of a failed claim that something can hold.

    Ranges are dropped first, then members from the last, so that the core rather keeps what the author of the
    first members wrote.

    Args:
        obligation: the failed claim.
        oracle: solver with its budget.

    Returns:
        The core; None if none is found within the budget.
    """
    if not obligation.labelled_conjuncts:
        return None
    declared = obligation.space.variables
    names = {name for member in obligation.labelled_conjuncts for name in t.variables_of(member.term)}
    ranged = [one for one in declared if one.range is not None and one.name in names]

    def clash(items: Sequence[LabelledConjunct | Declared]) -> bool:
        bounded = {one.name for one in items if isinstance(one, Declared)}
        space = [one if one.name in bounded else replace(one, range=None) for one in declared]
        return is_unsatisfiable(
            [one.term for one in items if isinstance(one, LabelledConjunct)], space, oracle
        )

    items: list[LabelledConjunct | Declared] = [*obligation.labelled_conjuncts, *ranged]
    if not clash(items):
        return None
    items = _minimize_core(items, clash)
    return UnsatCore(
        tuple(one for one in items if isinstance(one, LabelledConjunct)),
        tuple(one for one in items if isinstance(one, Declared)),
    )


def _minimize_core(items: list[_T], clash: Callable[[Sequence[_T]], bool]) -> list[_T]:
    """Reduce `items` to some that still clash, none of which can be left out; prefer to keep the first."""
    pending = [list(range(len(items)))]
    kept = set(range(len(items)))
    while pending:
        block = pending.pop()
        if clash([items[i] for i in sorted(kept - set(block))]):
            kept -= set(block)
        elif len(block) > 1:
            middle = len(block) // 2
            pending += [block[:middle], block[middle:]]
    return [items[i] for i in sorted(kept)]


def label_core(obligation: Obligation, core: UnsatCore) -> tuple[SpanLabel, tuple[SpanLabel, ...]]:
    """Label the members of a core in place of all that an obligation mentions.

    Args:
        obligation: the failed claim.
        core: its core.

    Returns:
        The primary label and the further labels.
    """
    labels = [member.label for member in core.members]
    ranges = [SpanLabel(one.range_span or one.span, f"range of `{one.name}`") for one in core.ranges]
    primary = obligation.primary
    inside = [label for label in labels if _span_contains(primary.span, label.span)]
    if obligation.primary_alone:
        labels = [label for label in labels if label not in inside]
        return inside[0] if len(inside) == 1 else primary, (*labels, *ranges)
    first = next(iter(inside), None)
    if first is None:
        return primary, (*labels, *ranges)
    labels.remove(first)
    if first.span != primary.span:
        text = "never true together with the other marked parts" if labels else primary.text
        primary = SpanLabel(first.span, text)
    return primary, (*labels, *ranges)


def label_violated_conjuncts(
    obligation: Obligation, witness: Witness
) -> tuple[SpanLabel, tuple[SpanLabel, ...]]:
    """Label the conjuncts that a witness breaks in place of the conclusion.

    Args:
        obligation: the failed claim.
        witness: its counterexample.

    Returns:
        The primary label and the further labels.
    """
    broken = [one.label for one in obligation.labelled_conjuncts if not is_true(one.term, witness.values)]
    if not broken:
        return obligation.primary, obligation.secondary
    if _span_contains(obligation.primary.span, broken[0].span):
        return SpanLabel(broken[0].span, obligation.primary.text), tuple(broken[1:])
    around = [
        one for one in obligation.secondary if not any(_span_contains(one.span, part.span) for part in broken)
    ]
    return obligation.primary, (*around, *broken)


def _span_contains(outer: SourceSpan, inner: SourceSpan) -> bool:
    return outer.source == inner.source and outer.start <= inner.start and inner.end <= outer.end
