"""Observations are in their space, with the types that Gymnasium expects."""

from __future__ import annotations

from fractions import Fraction

from aeros.agent.world.world import WorldModel
from aeros.gym.observations import ObservationEncoder
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.text.discovery import reference_site_path


def test_an_observation_is_in_the_space() -> None:
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    encoder = ObservationEncoder({"human_distance": site.state["human_distance"]})
    for known, expected in (({}, (0.0, 0)), ({"human_distance": Fraction(5, 2)}, (2.5, 1))):
        found = encoder.encode(WorldModel(0.0, known, {}, {}))
        assert encoder.space.contains(found)
        assert [str(found[key].dtype) for key in ("values", "known")] == ["float64", "int8"]
        assert (found["values"][0], found["known"][0]) == expected
