"""Room on the other stand for what is put down, in pictures drawn here."""

from __future__ import annotations

import runpy
from contextlib import suppress
from math import pi
from typing import Any

import pytest

from aeros.skill import Action
from tests.modules.looking import GREY, Top, Watched, draw
from tests.modules.test_fetch_object import ABOVE, STANDING, SURVEY, WANTED, lying

MIDDLE = (0.6, 0.1, 0.04)
"""Surveyed for the middle of an object of 8 cm: the stand's top is the ground of these pictures, z = 0."""

KNOWN = ("delivery_offset", "delivery_yaw", "delivery_free_across", "delivery_taken")


def thing(offset: float, height: float = 0.06) -> Top:
    return Top(MIDDLE[0], MIDDLE[1] + offset, height, (0.022, 0.0), GREY, is_round=True)


def room(*tops: Top, to: str = "anywhere", middle: tuple[float, float, float] = MIDDLE) -> tuple[Any, ...]:
    places = {**WANTED, **SURVEY, "to": to, "delivery_position": middle}
    found = Watched("fetch_object", "find_object", places).see(0.0, draw(ABOVE, tops, name="mast"))
    return tuple(found.get(name) for name in KNOWN)


@pytest.mark.parametrize(
    ("to", "offset"), [("anywhere", 0.0), ("middle", 0.0), ("left", 0.12), ("right", -0.12)]
)
def test_on_an_empty_stand_it_is_put_where_it_is_wanted(to: str, offset: float) -> None:
    assert room(to=to) == (offset, 0.0, True, False)


def test_another_thing_is_no_matter_unless_it_is_in_that_place() -> None:
    assert room(thing(0.0), to="left") == (0.12, 0.0, True, False)
    assert room(thing(0.0), to="middle") == (None, None, None, True)
    assert room(thing(0.03), to="middle")[3] is True


def test_anywhere_is_the_first_place_with_room() -> None:
    assert room(thing(0.0))[0] == 0.12
    assert room(thing(0.0), thing(0.12))[0] == -0.12
    assert room(thing(0.0), thing(0.12), thing(-0.12)) == (None, None, None, True)


def test_beside_a_high_thing_the_hand_is_turned() -> None:
    assert room(thing(0.0, 0.15)) == (0.12, pi / 2.0, False, False)


def test_the_object_itself_does_not_take_its_place() -> None:
    own = STANDING._replace(x=MIDDLE[0], y=MIDDLE[1])
    assert room(own, to="middle") == (0.0, 0.0, True, False)


@pytest.mark.parametrize("y", [0.83, 1.5])
def test_a_place_that_the_picture_does_not_show_whole_is_unknown(y: float) -> None:
    assert room(middle=(0.6, y, 0.04)) == (None, None, None, None)


@pytest.mark.parametrize("lift", [-0.03, -0.02, 0.01, 0.02, 0.03])
def test_room_is_found_on_a_stand_that_is_higher_or_lower_than_surveyed(lift: float) -> None:
    middle = (*MIDDLE[:2], MIDDLE[2] - lift)
    assert room(middle=middle) == (0.0, 0.0, True, False)
    assert room(thing(0.0), to="middle", middle=middle)[3] is True


def test_an_object_that_lay_needs_more_room() -> None:
    near = thing(0.066)
    places = {**WANTED, **SURVEY, "to": "middle", "delivery_position": MIDDLE}
    for seen, is_taken in ((STANDING, False), (lying(0.0), True)):
        watched = Watched("fetch_object", "find_object", places)
        watched.see(0.0, draw(ABOVE, (seen,), name="mast"))
        assert watched.see(1.0, draw(ABOVE, (near,), time=1.0, name="mast"))["delivery_taken"] is is_taken


def headings(**observed: Any) -> tuple[float, ...]:
    found: tuple[float, ...] = skills()["_headings_to_put"](observed)
    return found


def skills() -> dict[str, Any]:
    return runpy.run_module("ecms.fetch_object.skills")


def test_headings_without_room_are_not_tried() -> None:
    assert headings() == (0.0, pi, pi / 2.0, -pi / 2.0)
    turned = headings(delivery_yaw=pi / 2.0, delivery_free_across=False)
    assert turned == (pi / 2.0, -pi / 2.0)


def test_nothing_is_put_down_where_all_is_taken() -> None:
    observed: dict[str, Any] = {
        "tool_position": (0.3, 0.0, 0.4),
        "base_position": (0.0, 0.0, 0.0),
        "object_place": (0.5, 0.0, 0.1),
        "object_grip_height": 0.01,
        "object_grasped": True,
        "holding": True,
        "delivery_taken": True,
    }
    body = skills()["deliver"](observed, {"hand_speed": 0.4})
    asked: list[Action] = [next(body)]
    with suppress(StopIteration):
        while len(asked) < 50:
            asked.append(body.send(observed))
    assert "grip" not in {action.kind for action in asked}
    assert [action.kind for action in asked[-4:]] == ["look"] * 4
