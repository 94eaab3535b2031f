"""Things on the table that are flatter than the noise of depth: seen, and never taken for a clean table."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from aeros.perception import Picture
from tests.modules.looking import TABLE, Put, Top, Watched, draw
from tests.modules.test_clean_table import BLUE, DIRT, FOAM, OVERHEAD, PLACES, SPONGE

NEARLY_TABLE = (196, 197, 196)
BLACK, WHITE = (10, 10, 10), (255, 255, 255)
NOISE = 0.002
"""Standard deviation of a pixel's depth in the reference site, m."""


def noisy(picture: Picture, seed: int, noise: float = NOISE) -> Picture:
    """The picture as a camera of the reference site takes it."""
    chance = np.random.default_rng(seed)
    assert picture.depth is not None
    depth = picture.depth + chance.normal(0.0, noise, picture.depth.shape)
    rgb = np.clip(np.rint(picture.rgb + chance.normal(0.0, 2.0, picture.rgb.shape)), 0, 255)
    return replace(picture, depth=depth.astype(np.float32), rgb=rgb.astype(np.uint8))


def found(*tops: Top, seed: int = 0) -> dict[str, Any]:
    """Values of the picture from above, and of the second opinion on the same picture."""
    above = Watched("clean_table", "see_table", dict(PLACES))
    mast = Watched("clean_table", "check_table", dict(PLACES))
    picture = noisy(draw(OVERHEAD, [SPONGE, *tops]), seed)
    return {**above.see(0.0, picture), **mast.see(0.0, replace(picture, camera="mast"))}


@pytest.mark.parametrize("height", [0.003, 0.005, 0.008, 0.010, 0.012, 0.015, 0.019, 0.021])
@pytest.mark.parametrize("colour", [NEARLY_TABLE, DIRT, BLACK, WHITE, FOAM], ids=str)
@pytest.mark.parametrize(("x", "y"), [(0.5, 0.05), (0.6, -0.3)], ids=["in the area", "beside it"])
def test_a_domino_of_any_colour_is_seen(height: float, colour: Any, x: float, y: float) -> None:
    values = found(Top(x, y, height, (0.025, 0.0125), colour, 0.4))
    assert (values["clutter_on_table"], values["table_organized"]) == (True, False)
    assert values["table_verified"] is False
    assert values["wiping_area_clear"] is (x != 0.5)
    is_gripped = height >= 0.008
    assert values["clutter_ungraspable"] is not is_gripped
    name = "clutter_position" if is_gripped else "clutter_ungraspable_position"
    assert values[name] == pytest.approx((x, y, height / 2.0), abs=0.004)
    if is_gripped:
        assert values["clutter_yaw"] == pytest.approx(0.4, abs=0.25)
        assert values["clutter_length"] == pytest.approx(0.05, abs=0.012)


@pytest.mark.parametrize("colour", [BLUE, BLACK, WHITE])
def test_a_sheet_of_paper_beside_the_area_is_seen_by_its_colour(colour: Any) -> None:
    values = found(Top(0.6, -0.3, 0.0001, (0.03, 0.02), colour))
    assert (values["table_organized"], values["table_verified"]) == (False, False)
    assert values["clutter_ungraspable"] is True


def test_a_yellow_thing_in_the_bin_is_not_taken_for_the_sponge() -> None:
    values = found(Top(0.45, -0.5, 0.03, (0.025, 0.0125), FOAM))
    assert (values["table_organized"], values["table_verified"]) == (True, True)


@pytest.mark.parametrize(("height", "is_in"), [(0.08, True), (0.11, False)])
def test_a_piece_heaped_over_the_bin_is_not_in_it(height: float, *, is_in: bool) -> None:
    values = found(Top(0.45, -0.5, height, (0.025, 0.025), BLUE))
    assert (values["table_organized"], values["table_verified"]) == (is_in, is_in)


@pytest.mark.parametrize("seeds", [range(12), pytest.param(range(12, 40), marks=pytest.mark.deep)], ids=str)
def test_noise_alone_is_no_thing(seeds: range) -> None:
    for seed in seeds:
        values = found(seed=seed)
        assert values["clutter_on_table"] is False, seed
        assert (values["table_organized"], values["table_verified"]) == (True, True), seed


def test_dirt_is_no_thing_although_its_place_is_off() -> None:
    values = found(Top(0.51, 0.012, 0.0, (0.15, 0.15), DIRT))
    assert (values["clutter_on_table"], values["wiping_area_clear"]) == (False, True)


def test_the_sides_of_sponge_and_bin_are_no_things() -> None:
    scene = Put("table")
    scene.remove("cube", "can")
    places = {
        "area_position": (0.5, -1.2, 0.0),
        "region": "whole",
        "bin_position": (0.45, -1.7, 0.085),
        "sponge_rest_position": scene.poses["sponge"].position,
    }
    for seed in range(8):
        seen = Watched("clean_table", "see_table", dict(places)).see(0.0, noisy(scene.look("overhead"), seed))
        assert seen["clutter_on_table"] is False, seed


def test_a_low_thing_beside_a_high_one_is_seen_once_that_is_gone() -> None:
    low = Top(0.6, -0.262, 0.005, (0.015, 0.015), TABLE)
    both = found(low, Top(0.6, -0.3, 0.04, (0.02, 0.02), BLUE))
    assert both["clutter_position"][:2] == pytest.approx((0.6, -0.3), abs=0.005)
    assert found(low)["clutter_ungraspable"] is True
