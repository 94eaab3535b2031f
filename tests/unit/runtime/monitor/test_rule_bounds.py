"""A bound of a rule is the value beyond which the rule fails, given the other values."""

from __future__ import annotations

import random
from fractions import Fraction
from typing import Any

import pytest

from aeros.runtime.monitor.rule_bounds import Bound, rule_bounds
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower
from aeros.spec.expr.semantics import Value, is_true
from aeros.spec.expr.types import RealType
from aeros.spec.expr.unparse import unparse
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import reference_site_path


def reference() -> Site:
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    return site


SITE = reference()
RULES = {rule.id: rule for rule in SITE.rules}


def found(rule: str, kind: str, **values: Any) -> list[tuple[str, str, float]]:
    exact = {name: Fraction(value) if type(value) is float else value for name, value in values.items()}
    bounds = rule_bounds(lower(RULES[rule].terms[kind]), exact)
    return [(unparse(b.quantity), "at most" if b.is_upper else "at least", float(b.value)) for b in bounds]


def test_a_constant_bounds_a_state_variable() -> None:
    assert found("separation", "grip", human_distance=3.0) == [("human_distance", "at least", 0.5)]
    assert found("collision-force", "slide", contact_force=3.0) == [("contact_force", "at most", 65.0)]


def test_a_parameter_changes_the_bound() -> None:
    slow, fast = (
        found("arm-separation", "move_tool", human_distance=3.0, speed=speed)[0] for speed in (0.1, 1.1)
    )
    assert slow[:2] == fast[:2] == ("human_distance", "at least")
    assert fast[2] - slow[2] == pytest.approx(0.275)


def test_a_conditional_bound_applies_while_its_condition_holds() -> None:
    rule = "link-speeds-near-person"
    near = found(rule, "move_tool", human_distance=1.0, link_speed=0.1)
    assert near == [("link_speed", "at most", 0.25)]
    fast = found(rule, "move_tool", human_distance=3.0, link_speed=0.5)
    assert fast == [("human_distance", "at least", 2.3)]
    assert found(rule, "move_tool", human_distance=3.0, link_speed=0.1) == []


def test_each_joint_has_its_own_bounds() -> None:
    speeds = {f"joint_velocity[j{joint}]": 0.0 for joint in range(1, 8)}
    found_ones = found("joint-speeds", "move_tool", **speeds)
    assert len(found_ones) == 7
    assert found_ones[-1] == ("abs(joint_velocity[j7])", "at most", 2.61)


def test_a_negation_turns_bounds_round() -> None:
    distance, speed = (SITE.state[name].variable for name in ("human_distance", "link_speed"))
    assert isinstance(distance.type, RealType)
    assert isinstance(speed.type, RealType)
    one, two = t.Literal(Fraction(1), distance.type), t.Literal(Fraction(2), speed.type)
    neither = t.Not(t.Or((t.Compare("<", distance, one), t.Compare("<", two, speed))))
    values: dict[str, Value] = {"human_distance": Fraction(3), "link_speed": Fraction(0)}
    assert list(rule_bounds(lower(neither), values)) == [
        Bound(distance, False, Fraction(1)),
        Bound(speed, True, Fraction(2)),
    ]


def test_unknown_variables_give_no_bounds() -> None:
    assert found("separation", "grip") == []
    assert found("arm-separation", "move_tool", human_distance=3.0) == []
    assert found("link-speeds-near-person", "move_tool", link_speed=0.5) == []


def _some(variable: t.Variable, chance: random.Random) -> Value:
    if isinstance(variable.type, RealType):
        return Fraction(chance.uniform(-2.0, 3.0))
    return chance.random() < 0.5


def _moved(bound: Bound) -> Fraction:
    return bound.value + (Fraction(1, 1000) if bound.is_upper else Fraction(-1, 1000))


def test_the_rule_fails_beyond_a_bound() -> None:
    chance = random.Random(4)  # noqa: S311 - repeats
    tried = 0
    for rule in SITE.rules:
        for term in map(lower, rule.terms.values()):
            for _ in range(20):
                values = {name: _some(one, chance) for name, one in t.variables_of(term).items()}
                for bound in rule_bounds(term, values):
                    moved = _moved(bound)
                    if isinstance(bound.quantity, t.Absolute) and moved < 0:
                        continue
                    tried += 1
                    assert bound.margin({**values, bound.variable.name: moved}) < 0
                    assert not is_true(term, {**values, bound.variable.name: moved}), rule.id
    assert tried > 1000
