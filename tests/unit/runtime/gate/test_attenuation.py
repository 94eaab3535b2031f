"""Reduced parameters: never larger in magnitude, and rounded towards zero."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from math import nextafter

from hypothesis import given
from hypothesis import strategies as st

from aeros.runtime.gate.attenuation import attenuate_parameters, factor_to_length
from aeros.spec.expr import terms as t
from aeros.spec.model.rules import Rule
from aeros.spec.model.site import Site
from tests.unit.runtime.conftest import METRES, SPAN, declare

SPEED, REACH = (declare(name, METRES, t.VariableRole.PARAMETER).variable for name in ("speed", "reach"))
GAP = declare("gap", METRES, t.VariableRole.STATE).variable


def rule(**reduced: t.Term) -> Rule:
    return Rule("slow", "", "", "", {"move": t.TRUE}, {"move": reduced}, SPAN, SPAN)


def literal(value: str) -> t.Term:
    return t.Literal(Fraction(value), METRES)


def test_a_parameter_is_reduced_to_the_value_of_the_rules_term() -> None:
    asked = {"speed": 2.0, "tool": "brush"}
    found = attenuate_parameters([rule(speed=literal("1/2"))], "move", asked, {"speed": 2.0})
    assert found == {"speed": 0.5, "tool": "brush"}
    assert asked == {"speed": 2.0, "tool": "brush"}


def test_a_term_may_read_what_is_measured() -> None:
    values = {"speed": 2.0, "gap": 0.25}
    assert attenuate_parameters([rule(speed=GAP)], "move", {"speed": 2.0}, values) == {"speed": 0.25}


def test_truths_and_members_of_enums_stay_what_they_are() -> None:
    asked = {"speed": 2.0, "tool": "brush", "wet": True}
    values = {**asked, "gap": 0.25}
    found = attenuate_parameters([rule(speed=GAP)], "move", asked, values)
    assert found == {"speed": 0.25, "tool": "brush", "wet": True}


def test_a_parameter_is_never_enlarged() -> None:
    for speed in (0.25, -0.25, 0.5, -0.5):
        found = attenuate_parameters([rule(speed=literal("1/2"))], "move", {"speed": speed}, {"speed": speed})
        assert found == {"speed": speed}


def test_a_reduced_value_is_rounded_towards_zero() -> None:
    # The double nearest to 1/10 is larger than it.
    for bound, double in (("1/10", nextafter(0.1, 0.0)), ("-1/10", -nextafter(0.1, 0.0))):
        found = attenuate_parameters([rule(speed=literal(bound))], "move", {"speed": 3.0}, {"speed": 3.0})
        assert found == {"speed": double}


def test_rules_reduce_one_after_the_other_and_each_sees_the_reduced_value() -> None:
    first, second = rule(speed=literal("1")), rule(reach=SPEED)
    asked = {"speed": 2.0, "reach": 4.0}
    assert attenuate_parameters([first, second], "move", asked, asked) == {"speed": 1.0, "reach": 1.0}
    assert attenuate_parameters([second, first], "move", asked, asked) == {"speed": 1.0, "reach": 2.0}


def test_within_a_rule_all_terms_read_the_requested_values() -> None:
    both = rule(speed=literal("1"), reach=SPEED)
    asked = {"speed": 2.0, "reach": 4.0}
    assert attenuate_parameters([both], "move", asked, asked) == {"speed": 1.0, "reach": 2.0}


def shortened(vector: tuple[float, ...], length: str) -> tuple[float, ...]:
    values = {f"way.{axis}": part for axis, part in zip("xyz", vector, strict=True)}
    found = attenuate_parameters([rule(way=literal(length))], "move", {"way": vector}, values)
    return tuple(found["way"])


def test_a_vector_is_shortened_to_a_length_and_keeps_its_direction() -> None:
    assert shortened((3.0, -4.0, 0.0), "5/2") == (1.5, -2.0, 0.0)
    assert shortened((3.0, -4.0, 0.0), "5") == (3.0, -4.0, 0.0)
    assert shortened((3.0, -4.0, 0.0), "0") == (0.0, 0.0, 0.0)


def test_a_vector_stays_where_no_vector_has_the_length() -> None:
    assert shortened((3.0, -4.0, 0.0), "-1") == (3.0, -4.0, 0.0)


def test_a_second_rule_shortens_what_the_first_has_left() -> None:
    values = {"way.x": 8.0, "way.y": 0.0, "way.z": 0.0}
    rules = [rule(way=literal(length)) for length in ("4", "2", "3")]
    assert attenuate_parameters(rules, "move", {"way": [8.0, 0.0, 0.0]}, values) == {"way": (2.0, 0.0, 0.0)}


@given(
    vector=st.tuples(*[st.floats(-1e6, 1e6)] * 3),
    length=st.fractions(min_value=0, max_value=1000, max_denominator=1000),
)
def test_a_shortened_vector_is_as_long_as_possible_and_no_longer(
    vector: tuple[float, ...], length: Fraction
) -> None:
    exact = [Fraction(part) for part in vector]
    square = sum(part * part for part in exact)
    factor = factor_to_length(exact, length)
    assert 0 <= factor <= 1
    assert (factor == 1) == (square <= length * length)
    if factor < 1:
        assert factor * factor * square <= length * length
        assert (factor + Fraction(1, 2**128)) ** 2 * square > length * length
    found = [Fraction(part) for part in shortened(vector, str(length))]
    assert sum(part * part for part in found) <= max(length * length, square if factor == 1 else 0)
    for part, before in zip(found, exact, strict=True):
        assert abs(part) <= abs(before)
        assert part * before >= 0


def test_a_variable_of_a_module_with_the_name_of_a_parameter_makes_no_vector_of_it() -> None:
    asked = {"speed": 2.0}
    reduced = attenuate_parameters([rule(speed=literal("1/2"))], "move", asked, {**asked, "speed.x": 1.0})
    assert reduced == {"speed": 0.5}


def test_only_the_terms_on_the_kind_count(site: Site) -> None:
    one = replace(site.rules[0], attenuations={"move": {"speed": literal("0")}, "stop": {}})
    assert attenuate_parameters([one], "stop", {"speed": 2.0}, {"speed": 2.0}) == {"speed": 2.0}
    assert attenuate_parameters([], "move", {"speed": 2.0}, {}) == {"speed": 2.0}


@given(st.floats(-5.0, 5.0), st.fractions(-5, 5))
def test_the_result_is_no_larger_than_request_and_term(speed: float, bound: Fraction) -> None:
    reduction = rule(speed=t.Literal(bound, METRES))
    reduced = attenuate_parameters([reduction], "move", {"speed": speed}, {"speed": speed})["speed"]
    assert abs(Fraction(reduced)) <= min(abs(Fraction(speed)), max(abs(bound), abs(Fraction(speed))))
    if abs(bound) < abs(Fraction(speed)):
        assert abs(Fraction(reduced)) <= abs(bound)
        assert Fraction(reduced) * bound >= 0
    else:
        assert reduced == speed
