"""Obligations and the conditions that their reports point at."""

from __future__ import annotations

from aeros.spec.diagnostics.codes import SpanLabel
from aeros.spec.diagnostics.source import Source
from aeros.spec.expr import terms as t
from aeros.spec.model.rules import Conjunct
from aeros.spec.obligations.obligation import (
    LabelledConjunct,
    VariableSpace,
    label_conjuncts,
    rule_conjuncts,
)
from tests.unit.agent.dumplings import STATE, term
from tests.unit.spec.obligations.data.tidier import site

SPAN = Source("text", "0123456789").span(2, 5)


def test_the_variables_of_a_space_are_found_by_name() -> None:
    space = VariableSpace((STATE["area"], STATE["tool"]), ())
    assert dict(space.by_name) == {"area": STATE["area"], "tool": STATE["tool"]}
    assert dict(VariableSpace((), ()).by_name) == {}


def test_each_conjunct_is_labelled_at_its_own_place() -> None:
    parts = [Conjunct(term("dumpling_cooked"), SPAN), Conjunct(t.TRUE, SPAN)]
    assert label_conjuncts(parts, "clashes") == (
        LabelledConjunct(term("dumpling_cooked"), SpanLabel(SPAN, "clashes")),
        LabelledConjunct(t.TRUE, SpanLabel(SPAN, "clashes")),
    )
    assert label_conjuncts([], "clashes") == ()


def test_the_conjuncts_of_rules_are_labelled_with_the_rule_that_requires_them() -> None:
    rules = site().rules
    texts = [(one.label.text, one.label.span.text) for one in rule_conjuncts(rules, "drive")]
    assert texts == [
        ("required by `stop-button`", "not stop_pressed"),
        ("required by `some-joint-ready`", "any(joint_ready[j] for j in joints)"),
        ("required by `short-drive`", "-1 m <= distance_driven"),
        ("required by `short-drive`", "distance_driven <= 1 m"),
    ]
    assert rule_conjuncts(rules, "nothing") == ()
