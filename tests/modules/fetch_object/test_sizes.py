"""Sizes of objects: the hand grips each where palm and fingertips are clear of it and of the ground."""

from __future__ import annotations

import pytest

from ecms.fetch_object.sizes import BELOW, PALM, TIP, fits_hand, grip_height


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
