"""Which of the conditions that an obligation puts together are at fault, each with its own place.

A claim that something can hold fails by a core: conditions that cannot hold together although all
but any one of them can.  A claim that something always holds fails by the conditions that its
witness breaks.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

from aeros.spec.backends.oracle import Oracle
from aeros.spec.diagnostics.codes import Label
from aeros.spec.diagnostics.source import Span
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import holds
from aeros.spec.model.model import Declared
from aeros.spec.obligations.obligation import Member, Obligation
from aeros.spec.verification.queries import impossible
from aeros.spec.verification.witness import Witness

_T = TypeVar("_T")


@dataclass(frozen=True)
class Core:
    """Conditions and declared ranges that cannot hold together; without any one of them, the rest can.

    Where the budget ran out for a member, it is kept, so a core may be larger than it must.
    """

    members: tuple[Member, ...]
    ranges: tuple[Declared, ...]


def core_of(obligation: Obligation, oracle: Oracle) -> Core | None:
    """A core of a claim that something can hold and fails; None if none is found within the budget.

    Ranges go first, then the members from the last, so that what stays is rather what the author of
    the first members wrote.
    """
    if not obligation.members:
        return None
    declared = obligation.space.declared
    names = {name for member in obligation.members for name in t.variables_of(member.term)}
    ranged = [one for one in declared if one.range is not None and one.name in names]

    def clash(items: Sequence[Member | Declared]) -> bool:
        bounded = {one.name for one in items if isinstance(one, Declared)}
        space = [one if one.name in bounded else replace(one, range=None) for one in declared]
        return impossible([one.term for one in items if isinstance(one, Member)], space, oracle)

    items: list[Member | Declared] = [*obligation.members, *ranged]
    if not clash(items):
        return None
    items = _least(items, clash)
    return Core(
        tuple(one for one in items if isinstance(one, Member)),
        tuple(one for one in items if isinstance(one, Declared)),
    )


def _least(items: list[_T], clash: Callable[[Sequence[_T]], bool]) -> list[_T]:
    """Some of `items` that still clash, none of which can be left out; the first are kept rather."""
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


def labels_of_core(obligation: Obligation, core: Core) -> tuple[Label, tuple[Label, ...]]:
    """The obligation's labels, with the members of the core in place of all that it speaks of."""
    labels = [member.label for member in core.members]
    ranges = [Label(one.range_span or one.span, f"range of `{one.name}`") for one in core.ranges]
    primary = obligation.primary
    inside = [label for label in labels if _covers(primary.span, label.span)]
    if obligation.primary_alone:
        labels = [label for label in labels if label not in inside]
        return inside[0] if len(inside) == 1 else primary, (*labels, *ranges)
    first = next(iter(inside), None)
    if first is None:
        return primary, (*labels, *ranges)
    labels.remove(first)
    if first.span != primary.span:
        text = "never holds together with what else is marked" if labels else primary.text
        primary = Label(first.span, text)
    return primary, (*labels, *ranges)


def labels_of_breach(obligation: Obligation, witness: Witness) -> tuple[Label, tuple[Label, ...]]:
    """The obligation's labels, with the conjuncts that `witness` breaks in place of the conclusion."""
    broken = [one.label for one in obligation.members if not holds(one.term, witness.values)]
    if not broken:
        return obligation.primary, obligation.secondary
    if _covers(obligation.primary.span, broken[0].span):
        return Label(broken[0].span, obligation.primary.text), tuple(broken[1:])
    around = [one for one in obligation.secondary if not any(_covers(one.span, part.span) for part in broken)]
    return obligation.primary, (*around, *broken)


def _covers(outer: Span, inner: Span) -> bool:
    return outer.source == inner.source and outer.start <= inner.start and inner.end <= outer.end
