"""Sizes of objects: the hand grips each where palm and fingertips are clear of it and of the ground."""

from __future__ import annotations

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.text.discovery import reference_site_path
from ecms.fetch_object.sizes import BELOW, LONGEST, PALM, TIP, fits_hand, grip_height


def test_palm_and_fingertips_are_clear_of_every_object_that_the_hand_holds() -> None:
    assert grip_height(0.08, is_lying=False) == 0.012
    assert grip_height(0.044, is_lying=True) == 0.0
    for height in (0.012, 0.025, 0.04, 0.05, 0.085, 0.09):
        over = grip_height(height, is_lying=False)
        assert height / 2.0 - over <= PALM + 1e-12
        assert over + height / 2.0 >= TIP - 1e-12
        assert over + height / 2.0 <= BELOW + 1e-12


@pytest.mark.parametrize(
    ("sides", "fits"),
    [
        ((0.06, 0.03, 0.08), True),
        ((0.07, 0.07, 0.012), True),
        ((0.09, 0.09, 0.05), False),
        ((0.03, 0.03, 0.12), False),
        ((0.14, 0.04, 0.03), False),
        ((0.03, 0.01, 0.03), False),
    ],
)
def test_an_object_of_a_wrong_size_does_not_fit(sides: tuple[float, float, float], fits: bool) -> None:
    assert fits_hand(*sides) is fits


def test_the_largest_object_is_as_large_as_the_gate_takes_what_is_held_to_be() -> None:
    """A taller one would hang out of the space that motions keep clear: the palm is over its top."""
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    box = site.volumes["largest_object"]
    assert float(box.upper[2]) == BELOW
    assert [float(high - low) for low, high in zip(box.lower, box.upper, strict=True)][:2] == [LONGEST] * 2
