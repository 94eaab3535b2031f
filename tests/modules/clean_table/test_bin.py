"""The bin is where a picture shows its rim, and not exactly where it was surveyed."""

from __future__ import annotations

from dataclasses import replace
from math import dist

import numpy as np
import pytest

from aeros.perception import Picture, Points
from ecms.clean_table.bin import find_bin
from ecms.clean_table.own_hand import OwnHand
from ecms.clean_table.table import level_table, points_above_table
from tests.modules.looking import Put, Watched

BIN = (0.45, -1.7, 0.085)
PLACES = {"area_position": (0.5, -1.2, 0.0), "region": "whole", "sponge_rest_position": (0.45, -0.86, 0.015)}


def picture(camera: str, *, hidden: bool = False) -> Picture:
    table = Put("table")
    if hidden:
        table.remove("bin")
    look = table.look(camera)
    assert look.depth is not None
    noise = 0.002 * np.random.default_rng(0).standard_normal(look.depth.shape)
    return replace(look, depth=(look.depth + noise).astype(np.float32))


def points_of(look: Picture) -> Points:
    area = (0.5, -1.2, 0.0)
    none = OwnHand(None, [], None, is_off=False)
    points, _ = points_above_table(look, level_table(look, area), area, none.error)
    return points


@pytest.mark.parametrize("camera", ["overhead", "mast"])
@pytest.mark.parametrize("off", [(0.0, 0.0), (0.0, -0.006), (0.01, 0.012), (-0.012, 0.008)])
def test_the_bin_is_found_where_its_rim_is(camera: str, off: tuple[float, float]) -> None:
    surveyed = (BIN[0] + off[0], BIN[1] + off[1], BIN[2])
    assert dist(find_bin(points_of(picture(camera)), surveyed), BIN) < 0.004


def test_without_its_rim_in_the_picture_it_is_where_it_was_surveyed() -> None:
    assert find_bin(points_of(picture("overhead", hidden=True)), BIN) == BIN
    far = (BIN[0], BIN[1] + 0.3, BIN[2])
    assert find_bin(points_of(picture("overhead")), far) == far


@pytest.mark.parametrize("off", [0.0, 0.006, -0.006, 0.012])
def test_a_wall_of_a_bin_that_was_surveyed_some_millimetres_off_is_no_clutter(off: float) -> None:
    table = Put("table")
    table.remove("cube", "can")
    watched = Watched("clean_table", "see_table", {**PLACES, "bin_position": (BIN[0], BIN[1] + off, BIN[2])})
    assert watched.see(0.0, table.look("overhead"))["clutter_on_table"] is False
