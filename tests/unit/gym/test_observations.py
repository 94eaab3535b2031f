"""Observations: each part of the measured state is one number, with its flag."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np

from aeros.agent.world.world import WorldModel
from aeros.gym.observations import ObservationEncoder
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import EnumType
from aeros.spec.text.discovery import reference_site_path

_SITE = load_site(reference_site_path(), Diagnostics())
assert _SITE is not None

_STATE = {
    name: one
    for name, one in _SITE.state.items()
    if name in ("holding", "tool_position", "joint_position", "human_distance")
}


def _encoded(known: dict[str, object]) -> tuple[dict[str, float], dict[str, int]]:
    encoder = ObservationEncoder(_STATE)
    world = WorldModel(0.0, known, {}, {})  # type: ignore[arg-type] - as the world has them
    found = encoder.encode(world)
    assert encoder.space.contains(found)
    return (
        dict(zip(encoder.names, found["values"].tolist(), strict=True)),
        dict(zip(encoder.names, found["known"].tolist(), strict=True)),
    )


def test_parts_of_vectors_and_families_have_names() -> None:
    values, known = _encoded(
        {
            "tool_position": (Fraction(1, 2), Fraction(-1, 4), Fraction(1, 8)),
            "joint_position": tuple(Fraction(number, 10) for number in range(7)),
            "holding": True,
        }
    )
    assert [values[f"tool_position.{axis}"] for axis in "xyz"] == [0.5, -0.25, 0.125]
    joints = [name for name in values if name.startswith("joint_position[")]
    assert [values[name] for name in joints] == [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
    assert (values["holding"], known["holding"]) == (1.0, 1)


def test_what_is_unknown_is_zero_with_a_flag_of_zero() -> None:
    values, known = _encoded({})
    assert set(known.values()) == {0}
    assert set(values.values()) == {0.0}


def test_a_bound_is_within_the_space_however_it_was_rounded() -> None:
    low, high = _STATE["human_distance"].range or (Fraction(0), Fraction(0))
    for bound in (low, high):
        values, _ = _encoded({"human_distance": bound})
        assert np.isclose(values["human_distance"], float(bound))


def test_an_enum_has_one_number_for_each_member() -> None:
    variable = t.Variable("mode", EnumType("modes", ("idle", "busy")), t.VariableRole.STATE)
    encoder = ObservationEncoder({"mode": replace(_STATE["holding"], variable=variable)})
    assert encoder.names == ("mode=idle", "mode=busy")
    found = encoder.encode(WorldModel(0.0, {"mode": "busy"}, {}, {}))
    assert encoder.space.contains(found)
    assert found["values"].tolist() == [0.0, 1.0]
    assert found["known"].tolist() == [1, 1]
