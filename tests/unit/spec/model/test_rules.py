"""Rules of a site: the levels of risk, and which rules constrain the action itself."""

from __future__ import annotations

from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL
from aeros.spec.model.rules import Risk, Rule
from tests.unit.agent.dumplings import build, term

_PARAMETER = t.Variable("gentle", BOOL, t.VariableRole.PARAMETER)


def test_risks_are_ordered() -> None:
    assert Risk.LOW < Risk.MEDIUM < Risk.HIGH


def test_a_rule_constrains_an_action_if_it_reads_a_parameter_or_nothing() -> None:
    rule = build(
        Rule,
        terms={
            "reads_a_parameter": t.Implies(term("dumpling_wrapped"), _PARAMETER),
            "reads_the_state": term("dumpling_wrapped"),
            "reads_nothing": t.FALSE,
        },
    )
    assert [kind for kind in rule.terms if rule.constrains_action(kind)] == [
        "reads_a_parameter",
        "reads_nothing",
    ]
