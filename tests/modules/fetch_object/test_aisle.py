"""Perceiver of the aisle: from where the base has room to put an object down, in pictures drawn here."""

from __future__ import annotations

import pytest

from aeros.perception import View
from aeros.sim.geometry import Camera, Vector3
from ecms.fetch_object.aisle import find_room
from ecms.fetch_object.stations import EASTMOST, base_for_delivery
from tests.modules.looking import GREY, Top, draw

OVER_AISLE = Camera(eye=(-0.35, 0.6, 2.4), target=(-0.35, 0.6, -0.3), up=(1.0, 0.0, 0.0), field_of_view=59.0)
PLACE = (0.48, 1.1, 0.14)
BEFORE_IT = Top(0.0, 1.2, 0.15, (0.1, 0.1), GREY)
"""Heights of tops are over the ground of the pictures, z = 0, which is the floor here."""


def aside(*tops: Top, base: Vector3 = (0.0, 2.4, 0.3)) -> float:
    picture = draw(OVER_AISLE, tops, name="aisle_top")
    readings = {"object_place": PLACE, "base_position": base}
    body = find_room(View(0.0, {"aisle_top": picture}, readings, {}))
    found = next(body)["delivery_aside"]
    return float(found.value)


def test_the_base_stands_right_before_the_place_in_a_free_aisle() -> None:
    assert aside() == 0.0
    assert base_for_delivery(PLACE, 0.0) == pytest.approx((PLACE[0] - 0.5, PLACE[1]))


@pytest.mark.parametrize(
    "far",
    [Top(0.0, 0.2, 0.15, (0.1, 0.1), GREY), Top(-0.55, 1.2, 0.15, (0.1, 0.1), GREY)],
    ids=["farther along", "on the other side"],
)
def test_things_elsewhere_are_not_in_the_way(far: Top) -> None:
    assert aside(far) == 0.0


def test_the_base_stands_beside_a_box_before_the_place() -> None:
    found = aside(BEFORE_IT)
    assert found < 0.0, "to the right, as the box is more to the left"
    x, y = base_for_delivery(PLACE, found)
    assert y + 0.225 < 1.1 - 0.05
    assert x <= EASTMOST


@pytest.mark.parametrize(
    "top",
    [BEFORE_IT._replace(z=0.04), BEFORE_IT._replace(z=1.2)],
    ids=["low", "as high as a person"],
)
def test_low_things_and_people_are_left_to_others(top: Top) -> None:
    assert aside(top) == 0.0


def test_the_carriage_is_not_in_its_own_way() -> None:
    assert aside(Top(0.0, 1.0, 0.15, (0.25, 0.22), GREY), base=(0.0, 1.0, 0.3)) == 0.0


def test_without_a_picture_nothing_is_known() -> None:
    body = find_room(View(0.0, {}, {"object_place": PLACE, "base_position": (0.0, 2.4, 0.0)}, {}))
    assert next(body) == {}
