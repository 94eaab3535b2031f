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
from aeros.spec.diagnostics.codes import Fix, SpanLabel
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import is_true
from aeros.spec.model.ecm import ActionCondition
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
    at_fault = [one for one in obligation.labelled_conjuncts if not is_true(one.term, witness.values)]
    broken = [one.label for one in at_fault]
    if not broken:
        return obligation.primary, obligation.secondary
    if _span_contains(obligation.primary.span, broken[0].span):
        return SpanLabel(broken[0].span, obligation.primary.text), tuple(broken[1:])
    around = [
        one for one in obligation.secondary if not any(_span_contains(one.span, part.span) for part in broken)
    ]
    primary, *others = _label_envelope(obligation, [one.term for one in at_fault])
    return primary, (*others, *around, *broken)


def _label_envelope(obligation: Obligation, broken: Sequence[t.Term]) -> list[SpanLabel]:
    """Narrow the label of an envelope to the conjuncts that bound the values of broken conditions.

    Where no conjunct does, the label says so; of an envelope on several lines it marks the last conjunct.
    """
    clause, primary = obligation.clause, obligation.primary
    if clause is None or clause.span != primary.span or len(clause.conjuncts) < 2:
        return [primary]
    asked = [name for term in broken for name, one in t.variables_of(term).items() if _is_chosen(one)]
    names = dict.fromkeys(asked)
    bounding = [one.span for one in clause.conjuncts if names.keys() & t.variables_of(one.term).keys()]
    is_one_line = primary.span.line == primary.span.end_line
    if bounding and is_one_line:
        return [SpanLabel(bounding[0].merge(bounding[-1]), primary.text)]
    if bounding:
        return [SpanLabel(span, primary.text) for span in bounding]
    unbounded = f"does not bound {', '.join(f'`{name}`' for name in names)}"
    return [SpanLabel(primary.span if is_one_line else clause.conjuncts[-1].span, unbounded)]


def label_edited_conjunct(clause: ActionCondition, fix: Fix, label: SpanLabel) -> SpanLabel:
    """Narrow the label of an envelope to the conjunct that a repair changes.

    Args:
        clause: the envelope.
        fix: a repair of it.
        label: its label.

    Returns:
        The label at the conjunct; the same label if the repair changes several conjuncts, or adds one.
    """
    old, new, first = fix.span.text, fix.text, fix.span.start
    start = _common_length(old, new)
    end = len(old) - _common_length(old[start:][::-1], new[start:][::-1])
    edited = SourceSpan(fix.span.source, first + start, first + end)
    inside = [one.span for one in clause.conjuncts if start < end and _span_contains(one.span, edited)]
    return SpanLabel(inside[0], label.text) if len(inside) == 1 else label


def _common_length(first: str, second: str) -> int:
    """Return the number of characters at the beginning of two texts that are the same."""
    pairs = enumerate(zip(first, second, strict=False))
    return next((i for i, (one, other) in pairs if one != other), min(len(first), len(second)))


def _is_chosen(variable: t.Variable) -> bool:
    """Tell if a skill chooses the value, so that its envelope can bound it."""
    return variable.role is not t.VariableRole.STATE


def _span_contains(outer: SourceSpan, inner: SourceSpan) -> bool:
    return outer.source == inner.source and outer.start <= inner.start and inner.end <= outer.end
