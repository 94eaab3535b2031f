"""Each part of the measured state is one number, with its flag."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest

from aeros.agent.world.state_numbers import StateNumbers
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import Value
from aeros.spec.expr.types import EnumType
from aeros.spec.model.variables import Declared
from aeros.spec.text.discovery import reference_site_path

_NAMES = ("holding", "human_distance", "joint_position", "tool_position")


@pytest.fixture(scope="module")
def state() -> dict[str, Declared]:
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    return {name: site.state[name] for name in _NAMES}


def _encoded(state: dict[str, Declared], known: dict[str, Value]) -> tuple[dict[str, float], dict[str, int]]:
    encoder = StateNumbers(state)
    numbers, flags = encoder.encode(known)
    return dict(zip(encoder.names, numbers, strict=True)), dict(zip(encoder.names, flags, strict=True))


def test_parts_of_vectors_and_families_have_names(state: dict[str, Declared]) -> None:
    numbers, flags = _encoded(
        state,
        {
            "tool_position": (Fraction(1, 2), Fraction(-1, 4), Fraction(1, 8)),
            "joint_position": tuple(Fraction(number, 10) for number in range(7)),
            "holding": True,
        },
    )
    assert [numbers[f"tool_position.{axis}"] for axis in "xyz"] == [0.5, -0.25, 0.125]
    joints = [name for name in numbers if name.startswith("joint_position[")]
    assert [numbers[name] for name in joints] == [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
    assert (numbers["holding"], flags["holding"], flags["human_distance"]) == (1.0, 1, 0)


def test_unknown_values_are_zero_with_a_flag_of_zero(state: dict[str, Declared]) -> None:
    numbers, flags = _encoded(state, {})
    assert set(flags.values()) == {0}
    assert set(numbers.values()) == {0.0}


def test_the_number_of_an_unknown_value_is_in_its_range(state: dict[str, Declared]) -> None:
    far = replace(state["human_distance"], range=(Fraction(2), Fraction(5)))
    numbers, flags = _encoded({"human_distance": far}, {})
    assert (numbers, flags) == ({"human_distance": 2.0}, {"human_distance": 0})


def test_a_bound_stays_in_the_range_however_it_is_rounded(state: dict[str, Declared]) -> None:
    odd = replace(state["human_distance"], range=(Fraction(1, 3), Fraction(2, 3)))
    encoder = StateNumbers({"human_distance": odd})
    (slot,) = encoder.slots
    for bound in (Fraction(1, 3), Fraction(2, 3)):
        ((number,), _) = encoder.encode({"human_distance": bound})
        assert slot.low <= number <= slot.high
        assert number == pytest.approx(float(bound))


def test_an_enum_has_one_number_for_each_member(state: dict[str, Declared]) -> None:
    variable = t.Variable("mode", EnumType("modes", ("idle", "busy")), t.VariableRole.STATE)
    numbers, flags = _encoded({"mode": replace(state["holding"], variable=variable)}, {"mode": "busy"})
    assert numbers == {"mode=idle": 0.0, "mode=busy": 1.0}
    assert flags == {"mode=idle": 1, "mode=busy": 1}
