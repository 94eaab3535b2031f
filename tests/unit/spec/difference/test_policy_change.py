"""Relations of what is allowed now to what was, and the diagnostics for them."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.diagnostics.codes import Severity, SpanLabel
from aeros.spec.diagnostics.source import Source
from aeros.spec.difference.policy_change import (
    PolicyChange,
    Relation,
    bounds_relation,
    describe_set_change,
    diagnostic_for,
    finite_change,
    sets_relation,
)

OLD, NEW = Source("old.yaml", "0123456789").span(1, 2), Source("new.yaml", "0123456789").span(3, 4)
SETS = st.frozensets(st.sampled_from("abc"))


def test_only_a_relation_that_allows_something_new_allows_more() -> None:
    assert {one for one in Relation if one.allows_more} == {Relation.NEWLY_ALLOWED, Relation.INCOMPARABLE}


@pytest.mark.parametrize(
    ("more", "less", "relation"),
    [
        (False, False, Relation.EQUAL),
        (True, False, Relation.NEWLY_ALLOWED),
        (False, True, Relation.NEWLY_DENIED),
        (True, True, Relation.INCOMPARABLE),
    ],
)
def test_the_two_directions_make_the_relation(more: bool, less: bool, relation: Relation) -> None:
    assert bounds_relation(more, less) is relation


@given(SETS, SETS)
def test_more_names_allow_more(old: frozenset[str], new: frozenset[str]) -> None:
    relation = sets_relation(old, new)
    assert (relation is Relation.EQUAL) is (old == new)
    assert (relation is Relation.NEWLY_ALLOWED) is (old < new)
    assert (relation is Relation.NEWLY_DENIED) is (new < old)


def test_names_added_and_removed_are_reported_in_order() -> None:
    assert describe_set_change("sensors", {"a", "b"}, {"a", "d", "c"}) == (
        "sensors: now with `c`, `d` and without `b`"
    )
    assert describe_set_change("sensors", {"a"}, set()) == "sensors: now without `a`"
    assert describe_set_change("sensors", set(), {"a"}) == "sensors: now with `a`"


@pytest.mark.parametrize(
    ("relation", "code", "severity"),
    [
        (Relation.NEWLY_ALLOWED, "AE951", Severity.WARNING),
        (Relation.NEWLY_DENIED, "AE952", Severity.NOTE),
        (Relation.NOT_COMPARABLE, "AE953", Severity.ERROR),
        (Relation.CHANGED_OTHERWISE, "AE954", Severity.NOTE),
        (Relation.UNDECIDED, "AE509", Severity.ERROR),
    ],
)
def test_the_new_lines_come_first(relation: Relation, code: str, severity: Severity) -> None:
    old, new = (SpanLabel(OLD, "old"), SpanLabel(OLD, "older")), (SpanLabel(NEW, "new"),)
    diagnostic = diagnostic_for(relation, "it changed", old, new, ("why",))
    assert (diagnostic.code, diagnostic.severity, diagnostic.headline, diagnostic.notes) == (
        code,
        severity,
        "it changed",
        ("why",),
    )
    assert (diagnostic.primary, diagnostic.secondary) == (new[0], old)
    assert diagnostic_for(relation, "it changed").primary is None


def test_an_equal_subject_has_no_diagnostic_and_one_of_both_directions_has_two() -> None:
    assert finite_change("x", Relation.EQUAL, "it", OLD, NEW) == PolicyChange("x", Relation.EQUAL)
    both = finite_change("x", Relation.INCOMPARABLE, "it", OLD, NEW)
    assert [one.code for one in both.diagnostics] == ["AE951", "AE952"]


def test_a_change_is_shown_where_it_was_and_where_it_is() -> None:
    (both,) = finite_change("x", Relation.NEWLY_DENIED, "it", OLD, NEW).diagnostics
    assert (both.primary, both.secondary) == (SpanLabel(NEW, "new"), (SpanLabel(OLD, "old"),))
    (gone,) = finite_change("x", Relation.NEWLY_DENIED, "it", OLD, None).diagnostics
    assert (gone.primary, gone.secondary) == (SpanLabel(OLD, "old"), ())
