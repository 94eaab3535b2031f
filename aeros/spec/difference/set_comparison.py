"""Comparison of two sets of states, inputs and parameters, with a member of each difference.

Something is newly allowed iff `new and not old` is satisfiable over the variables that either side declares,
and newly denied iff `old and not new` is. Both questions go through `discharge_obligations`, so every witness
is replayed. A state variable that one side does not declare may have any value on that side.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from typing import Final

from aeros.spec.backends.oracle import Oracle
from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.difference.double_witness import witness_of_doubles
from aeros.spec.difference.policy_change import PolicyChange, Relation, bounds_relation, diagnostic_for
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import Value, is_true
from aeros.spec.expr.types import FamilyType, RealType, VectorType
from aeros.spec.model.variables import Declared
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.obligation import ClaimMode, Obligation, VariableSpace
from aeros.spec.obligations.verdicts import Verdict
from aeros.spec.verification.discharge import ObligationResult, discharge_obligations
from aeros.spec.verification.witness import Witness

_BETWEEN_DOUBLES: Final = (
    "these values lie between doubles, and the doubles next to them show no difference; the gate gets doubles"
)


@dataclass(frozen=True)
class SetCondition:
    """A condition that every member of a set meets.

    Attributes:
        term: the condition.
        span: its place in a file; None if it is not written in one.
    """

    term: t.Term
    span: SourceSpan | None


@dataclass(frozen=True)
class ComparedSet:
    """One of the two sets: all values of its variables that meet all `conditions`.

    Attributes:
        variables: every variable that a condition may read; all parameters of the action.
        conditions: conditions of membership.
        span: place to show if no condition of this side causes a difference.
    """

    variables: tuple[Declared, ...]
    conditions: tuple[SetCondition, ...]
    span: SourceSpan | None

    def labels(self, word: str, conditions: Iterable[SetCondition] = ()) -> tuple[SpanLabel, ...]:
        """Label the places of conditions; without any, the place of this side.

        Args:
            word: label, `old` or `new`.
            conditions: conditions to show.

        Returns:
            A label for each place.
        """
        spans = [one.span for one in conditions if one.span is not None]
        spans = spans or ([] if self.span is None else [self.span])
        return tuple(SpanLabel(span, word) for span in dict.fromkeys(spans))


def compare_sets(subject: str, what: str, old: ComparedSet, new: ComparedSet, oracle: Oracle) -> PolicyChange:
    """Compare two sets.

    Args:
        subject: name of the subject.
        what: name of a member for people, as in ``a `grip` of `wrap` ``.
        old: set before.
        new: set now.
        oracle: answers the questions.

    Returns:
        The relation of new to old, with diagnostics and witnesses.
    """
    old, new = _align_empty_side(old, new), _align_empty_side(new, old)
    clash = _variable_mismatch(old, new)
    if clash is not None:
        headline = f"cannot compare {what}: {clash}"
        diagnostic = diagnostic_for(Relation.NOT_COMPARABLE, headline, old.labels("old"), new.labels("new"))
        return PolicyChange(subject, Relation.NOT_COMPARABLE, (diagnostic,))
    declared = _merge_variables(old, new)
    before, after = _add_range_conditions(old, declared), _add_range_conditions(new, declared)
    found = {
        Relation.NEWLY_ALLOWED: _subset_check(
            subject, Relation.NEWLY_ALLOWED, declared, after, before, oracle
        ),
        Relation.NEWLY_DENIED: _subset_check(subject, Relation.NEWLY_DENIED, declared, before, after, oracle),
    }
    shown = {
        relation: one.witness
        for relation, one in found.items()
        if one is not None and one.verdict is Verdict.REFUTED and one.witness is not None
    }
    sides = {Relation.NEWLY_ALLOWED: (after, before), Relation.NEWLY_DENIED: (before, after)}
    diagnostics: list[Diagnostic] = []
    witnesses: dict[str, Witness] = {}
    for relation, witness in shown.items():
        of_doubles = witness_of_doubles(witness, partial(_shows, *sides[relation]))
        witnesses[relation.value] = of_doubles or witness
        notes = () if of_doubles else (_BETWEEN_DOUBLES,)
        diagnostics.append(_diagnostic(relation, what, witnesses[relation.value], old, new, notes))
    relation = bounds_relation(Relation.NEWLY_ALLOWED in shown, Relation.NEWLY_DENIED in shown)
    unknown = [one for one in found.values() if one is not None and one.verdict is Verdict.UNKNOWN]
    if unknown:
        relation = Relation.UNDECIDED
        headline = f"undecided: the solver could not compare {what}"
        note = f"the solver said: {unknown[0].reason}"
        diagnostics.append(diagnostic_for(relation, headline, old.labels("old"), new.labels("new"), (note,)))
    return PolicyChange(subject, relation, tuple(diagnostics), witnesses)


def _shows(more: Iterable[SetCondition], less: Iterable[SetCondition], values: Mapping[str, Value]) -> bool:
    """Tell if values are a member of `more` and not of `less`."""
    return all(is_true(one.term, values) for one in more) and not all(
        is_true(one.term, values) for one in less
    )


def _align_empty_side(side: ComparedSet, other: ComparedSet) -> ComparedSet:
    """Return `side`; if it has no members, with the variables of `other`, so that they can be compared."""
    never = tuple(one for one in side.conditions if one.term == t.FALSE)
    return replace(side, variables=other.variables, conditions=never) if never else side


def _subset_check(
    subject: str,
    relation: Relation,
    declared: tuple[Declared, ...],
    more: tuple[SetCondition, ...],
    less: tuple[SetCondition, ...],
    oracle: Oracle,
) -> ObligationResult | None:
    """Decide if every member of `more` is one of `less`; None if `less` has no further condition."""
    assumed = tuple(one.term for one in more)
    further = [one.term for one in less if one.term not in assumed]
    if not further:
        return None
    claim = Obligation(
        id=ClaimForm.DIFFERENCE(subject, relation.value),
        code="AE951" if relation is Relation.NEWLY_ALLOWED else "AE952",
        mode=ClaimMode.ALWAYS,
        space=VariableSpace(declared, assumed),
        conclusion=t.conjunction(*further),
        headline=relation.value,
        primary=SpanLabel(declared[0].span),
    )
    (finding,) = discharge_obligations([claim], oracle)
    return finding


def _diagnostic(
    relation: Relation,
    what: str,
    witness: Witness,
    old: ComparedSet,
    new: ComparedSet,
    further_notes: tuple[str, ...] = (),
) -> Diagnostic:
    """Show the values of the witness that the changed conditions depend on."""
    before, after = ([one.term for one in side.conditions] for side in (old, new))
    removed = [one for one in old.conditions if one.term not in after]
    added = [one for one in new.conditions if one.term not in before]
    depends = {name for one in (*removed, *added) for name in t.variables_of(one.term)}
    lines = witness.lines()
    changed = [line for one, line in zip(witness.variables, lines, strict=True) if one.name in depends]
    changed = changed or lines
    notes = ["for example, with\n" + "\n".join(changed)] if changed else []
    if len(changed) < len(lines):
        notes.append(f"`--format json` shows all {len(lines)} values of this witness")
    headline = f"{what} is {relation.value}"
    return diagnostic_for(
        relation, headline, old.labels("old", removed), new.labels("new", added), (*notes, *further_notes)
    )


def _variable_mismatch(old: ComparedSet, new: ComparedSet) -> str | None:
    """Return the reason that the two sets have different variables, or None."""
    before, after = ({one.name: one for one in side.variables} for side in (old, new))
    used = {name for side in (old, new) for one in side.conditions for name in t.variables_of(one.term)}
    for name in (*before, *(name for name in after if name not in before)):
        one, other = before.get(name), after.get(name)
        role = (one or after[name]).variable.role
        if one is None or other is None:
            if role is t.VariableRole.PARAMETER or (role is t.VariableRole.INPUT and name in used):
                return f"only the {'new' if one is None else 'old'} side has `{name}`"
        elif one.variable != other.variable and (name in used or role is not t.VariableRole.STATE):
            return f"`{name}` was {one.variable.type} and is {other.variable.type}"
    return None


def _merge_variables(old: ComparedSet, new: ComparedSet) -> tuple[Declared, ...]:
    """Return every variable of either side once, with a range that includes both of its ranges."""
    merged = {one.name: one for one in old.variables}
    for one in new.variables:
        before = merged.get(one.name)
        widest = one.range
        if before is not None and before.range is not None and one.range is not None:
            (low, high), (lower, higher) = before.range, one.range
            widest = (min(low, lower), max(high, higher))
        merged[one.name] = replace(one, range=widest)
    return tuple(merged.values())


def _add_range_conditions(side: ComparedSet, merged: Iterable[Declared]) -> tuple[SetCondition, ...]:
    """Return the side's conditions, and its own range of each variable whose merged range is wider."""
    whole = {one.name: one.range for one in merged}
    used = {name for one in side.conditions for name in t.variables_of(one.term)}
    narrower = [
        SetCondition(_in_range(one), one.span)
        for one in side.variables
        if one.range != whole[one.name]
        and (one.name in used or one.variable.role is not t.VariableRole.STATE)
    ]
    return (*side.conditions, *narrower)


def _in_range(one: Declared) -> t.Term:
    """Return the term that every part of the variable is in its declared range."""
    low, high = one.range or (Fraction(0), Fraction(0))
    variable, parts = one.variable, list[t.Term]()
    dimension = one.unit.dimension
    match variable.type:
        case VectorType():
            parts += [t.Component(variable, axis) for axis in range(3)]
        case FamilyType(index=index):
            parts += [t.Select(variable, t.Literal(member, index)) for member in index.members]
        case _:
            parts.append(variable)
    ends = (t.Literal(low, RealType(dimension)), t.Literal(high, RealType(dimension)))
    return t.conjunction(
        *(t.And((t.Compare("<=", ends[0], part), t.Compare("<=", part, ends[1]))) for part in parts)
    )
