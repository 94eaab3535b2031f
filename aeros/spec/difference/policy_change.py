"""One change of a policy: its relation, the diagnostics for it, and the witnesses that show it."""

from __future__ import annotations

from collections.abc import Mapping, Set
from dataclasses import dataclass, field
from enum import Enum

from aeros.spec.diagnostics.codes import Diagnostic, Severity, SpanLabel
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.verification.witness import Witness


class Relation(Enum):
    """Relation of what is allowed now to what was allowed before."""

    EQUAL = "equal"
    NEWLY_ALLOWED = "newly allowed"
    NEWLY_DENIED = "newly denied"
    INCOMPARABLE = "incomparable"  # some things newly allowed, others newly denied
    CHANGED_OTHERWISE = "changed"  # not compared by what it allows, and not the same
    NOT_COMPARABLE = "not comparable"  # the two speak of different things
    UNDECIDED = "undecided"

    @property
    def allows_more(self) -> bool:
        """True if something is allowed that was not."""
        return self in (Relation.NEWLY_ALLOWED, Relation.INCOMPARABLE)


@dataclass(frozen=True)
class PolicyChange:
    """The change of one subject.

    Attributes:
        subject: path of it, such as `wrap/grip` or `policy/limits/retries`.
        relation: relation of the new side to the old one.
        diagnostics: diagnostics that show the change.
        witnesses: a state and an action that show it, under `newly allowed` and `newly denied`.
    """

    subject: str
    relation: Relation
    diagnostics: tuple[Diagnostic, ...] = ()
    witnesses: Mapping[str, Witness] = field(default_factory=dict)


_CODES = {
    Relation.NEWLY_ALLOWED: ("AE951", Severity.WARNING),
    Relation.NEWLY_DENIED: ("AE952", Severity.NOTE),
    Relation.NOT_COMPARABLE: ("AE953", Severity.ERROR),
    Relation.CHANGED_OTHERWISE: ("AE954", Severity.NOTE),
    Relation.UNDECIDED: ("AE509", Severity.ERROR),
}


def diagnostic_for(
    relation: Relation,
    headline: str,
    old: tuple[SpanLabel, ...] = (),
    new: tuple[SpanLabel, ...] = (),
    notes: tuple[str, ...] = (),
) -> Diagnostic:
    """Make a diagnostic of a change, with the new lines as primary place and the old ones as secondary.

    Args:
        relation: relation of new to old; not EQUAL or INCOMPARABLE.
        headline: first line.
        old: places on the old side.
        new: places on the new side.
        notes: notes below the places.

    Returns:
        The diagnostic.
    """
    code, severity = _CODES[relation]
    places = (*new, *old)
    return Diagnostic(code, headline, places[0] if places else None, places[1:], notes, severity=severity)


def finite_change(
    subject: str,
    relation: Relation,
    headline: str,
    old: SourceSpan | None = None,
    new: SourceSpan | None = None,
) -> PolicyChange:
    """Make a change that needs no solver; INCOMPARABLE gets a diagnostic for each direction.

    Args:
        subject: name of the subject.
        relation: relation of new to old.
        headline: first line of the diagnostics.
        old: place on the old side.
        new: place on the new side.

    Returns:
        The change; without diagnostics if the two are equal.
    """
    halves = [] if relation is Relation.EQUAL else [relation]
    if relation is Relation.INCOMPARABLE:
        halves = [Relation.NEWLY_ALLOWED, Relation.NEWLY_DENIED]
    before = () if old is None else (SpanLabel(old, "old"),)
    after = () if new is None else (SpanLabel(new, "new"),)
    return PolicyChange(
        subject, relation, tuple(diagnostic_for(half, headline, before, after) for half in halves)
    )


def sets_relation(old: Set[str], new: Set[str]) -> Relation:
    """Compare two sets of names, where more names allow more.

    Args:
        old: names before.
        new: names now.

    Returns:
        The relation of new to old.
    """
    return bounds_relation(not new <= old, not old <= new)


def bounds_relation(allows_more: bool, allows_less: bool) -> Relation:
    """Combine the results of both directions.

    Args:
        allows_more: something is newly allowed.
        allows_less: something is newly denied.

    Returns:
        The relation of new to old.
    """
    if allows_more:
        return Relation.INCOMPARABLE if allows_less else Relation.NEWLY_ALLOWED
    return Relation.NEWLY_DENIED if allows_less else Relation.EQUAL


def describe_set_change(what: str, old: Set[str], new: Set[str]) -> str:
    """Describe the names added to and removed from a set.

    Args:
        what: name of the set, the start of the headline.
        old: names before.
        new: names now.

    Returns:
        A headline.
    """
    parts = [f"with {_join_names(new - old)}"] if new - old else []
    parts += [f"without {_join_names(old - new)}"] if old - new else []
    return f"{what}: now {' and '.join(parts)}"


def _join_names(names: Set[str]) -> str:
    return ", ".join(f"`{name}`" for name in sorted(names))
