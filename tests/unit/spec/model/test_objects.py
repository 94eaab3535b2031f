"""Objects of a site, as perceivers get them."""

from __future__ import annotations

from aeros.spec.model.objects import ObjectKind


def test_perceivers_get_shape_size_and_colour_as_plain_values() -> None:
    cup = ObjectKind(("cup",), "cylinder", (0.03, 0.08), (0.1, 0.2, 0.3))
    assert cup.for_perceivers() == {"shape": "cylinder", "size": (0.03, 0.08), "colour": (0.1, 0.2, 0.3)}
    assert ObjectKind(("cup",)).for_perceivers() == {"shape": "", "size": (), "colour": None}
