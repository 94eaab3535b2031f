"""Motions of make_dumplings for one observation: what fingers miss is gripped once more in another way."""

from __future__ import annotations

import runpy
from contextlib import suppress
from math import dist, pi
from types import SimpleNamespace
from typing import Any

import pytest

from aeros.skill import Action, ActionDenied, Observation

skills = SimpleNamespace(**runpy.run_module("ecms.make_dumplings.skills"))
"""The skills' code, which stays unimported as other tests run it."""

PACE = 0.45
PRESS, TRAY, STAND = (0.52, 0.0, 0.03), (0.43, -0.28, 0.02), (0.36, 0.24, 0.02)
KNOWN: dict[str, Any] = {
    "base_position": (0.0, 0.0, 0.0),
    "tool_position": (0.3, 0.0, 0.45),
    "press_position": PRESS,
    "press_handle_position": (0.45, 0.0, 0.041),
    "pot_position": (0.55, 0.33, 0.06),
    "press_free": True,
    "wrapper_position": TRAY,
    "wrapper_yaw": 0.1,
    "wrapper_has_room": True,
    "filling_position": STAND,
    "filling_yaw": 0.2,
    "filling_has_room": True,
    "filling_free_across": True,
    "dough_on_workspace": False,
    "filling_on_workspace": False,
    "dumpling_wrapped": False,
    "holding": False,
    "finger_gap": 0.08,
}
"""Observation of a bench with a wrapper on its tray and a filling on its stand."""


def actions(skill: str, misses: int, **more: Any) -> list[Action]:
    """Drive a skill that sees the same all the time; fingers hold what is there, but for the first times."""
    now: Observation = {**KNOWN, **more}
    body = getattr(skills, skill)(now, {"hand_speed": PACE})
    done: list[Action] = []
    closed = 0
    try:
        action = next(body)
        while True:
            done.append(action)
            values = dict(now)
            if action.kind == "move_tool":
                values["tool_position"] = action.parameters["target"]
            elif action.kind == "grip":
                width = action.parameters["width"]
                is_closing = width not in (skills.OPEN, skills.HALF_OPEN)
                closed += is_closing
                values["holding"] = is_closing and closed > misses
                values["finger_gap"] = width + (0.01 if values["holding"] else 0.0)
            now = values
            action = body.send(now)
    except StopIteration:
        return done


def grips(done: list[Action]) -> list[tuple[float, float, float]]:
    """Height and yaw of the tool, and width, each time that its fingers close."""
    return [
        (done[at - 1].parameters["target"][2], done[at - 1].parameters["yaw"], one.parameters["width"])
        for at, one in enumerate(done)
        if one.kind == "grip" and one.parameters["width"] not in (skills.OPEN, skills.HALF_OPEN)
    ]


def test_a_wrapper_that_the_fingers_miss_is_gripped_once_more_deeper_and_narrower() -> None:
    first, second, *_ = grips(actions("prepare", misses=1))
    assert first == pytest.approx((0.02, 0.1, skills.WRAPPER_GRIP))
    assert second == pytest.approx((0.018, 0.1, skills.BLOCKER_GRIP))


@pytest.mark.parametrize(
    ("across", "second"), [(True, (0.023, 0.2 - pi / 2.0)), (False, (0.023, 0.2))], ids=["turned", "as-seen"]
)
def test_a_filling_that_the_fingers_miss_is_gripped_once_more(
    across: bool, second: tuple[float, float]
) -> None:
    done = actions("prepare", misses=1, dough_on_workspace=True, filling_free_across=across)
    assert grips(done) == [
        pytest.approx((0.023, 0.2, skills.FILLING_GRIP)),
        pytest.approx((*second, skills.FILLING_GRIP)),
    ]


@pytest.mark.parametrize(
    ("skill", "more"),
    [
        ("prepare", {}),
        ("prepare", {"dough_on_workspace": True}),
        ("boil", {"dumpling_wrapped": True}),
    ],
    ids=["wrapper", "filling", "dumpling"],
)
def test_things_that_are_missed_twice_are_put_nowhere(skill: str, more: dict[str, Any]) -> None:
    done = actions(skill, misses=9, **more)
    # With a wrapper that is missed there is still a filling, which nobody puts anywhere either.
    assert len(grips(done)) == (4 if skill == "prepare" and not more else 2)
    assert all(one.kind != "wait" for one in done)
    places = [one.parameters["target"][:2] for one in done if one.kind == "move_tool"]
    assert PRESS[:2] not in places
    assert KNOWN["pot_position"][:2] not in places


def slides(done: list[Action]) -> list[Action]:
    """Moves to where a wrapper belongs on the press, at its height."""
    return [one for one in done if one.kind == "move_tool" and one.parameters["target"] == PRESS]


@pytest.mark.parametrize(("misses", "times"), [(0, 1), (1, 1), (2, 0)])
def test_a_wrapper_on_the_press_is_slid_unless_the_fingers_miss_it_twice(misses: int, times: int) -> None:
    on_press = (PRESS[0] + 0.02, PRESS[1], PRESS[2])
    done = actions("recover", misses=misses, wrapper_position=on_press)
    expected = [(0.03, skills.WRAPPER_GRIP), (0.028, skills.BLOCKER_GRIP)]
    found = [(height, width) for height, _, width in grips(done)]
    assert found == [pytest.approx(one) for one in expected[: misses + 1]]
    assert len(slides(done)) == times


BLOCKED: dict[str, Any] = {
    "press_free": False,
    "blocker_position": PRESS,
    "blocker_yaw": 0.0,
    "aside_place": (0.4, 0.1, 0.02),
}


@pytest.mark.parametrize("is_filling", [False, True])
def test_a_blocker_that_is_missed_twice_stays_and_nothing_is_laid_on_it(is_filling: bool) -> None:
    done = actions("prepare", misses=9, **BLOCKED, blocker_is_filling=is_filling)
    height = 0.033 if is_filling else 0.03
    second = height if is_filling else height - skills.DEEPER
    # Two grips for the wrapper's sake, and two for the filling's: after each two the rest stays as it is.
    assert [one for one, _, _ in grips(done)] == pytest.approx([height, second] * 2)
    aside = [one for one in done if one.kind == "move_tool" and one.parameters["target"][:2] == (0.4, 0.1)]
    assert not aside


def test_a_blocker_that_the_second_grip_takes_leaves_the_next_one_its_first_grip() -> None:
    done = actions("prepare", misses=1, **BLOCKED, blocker_is_filling=False)
    assert [one for one, _, _ in grips(done)][:3] == pytest.approx([0.03, 0.028, 0.03])


@pytest.mark.parametrize(("misses", "heights"), [(0, [0.041]), (1, [0.041, 0.039])])
def test_a_handle_that_the_fingers_miss_is_gripped_deeper(misses: int, heights: list[float]) -> None:
    done = actions("wrap", misses=misses, wrapper_position=PRESS)
    found = [height for height, _, width in grips(done) if width == skills.HANDLE_GRIP]
    assert found == pytest.approx(heights)


def headings_denied(**more: Any) -> list[float]:
    """Headings of a hand that may not come below 0.1 m to take what it lays out, in the order of trial."""
    now: Observation = {**KNOWN, **more}
    body = skills.prepare(now, {"hand_speed": PACE})
    yaws, action = list[float](), next(body)
    with suppress(ActionDenied):
        while len(yaws) < 30:
            low = action.kind == "move_tool" and action.parameters["target"][2] < 0.1
            if low:
                yaws.append(action.parameters["yaw"])
            action = body.throw(ActionDenied("too near", now)) if low else body.send(now)
    return yaws


def test_a_wrapper_whose_grip_is_denied_is_gripped_beside_its_middle_or_a_little_askew() -> None:
    assert headings_denied() == pytest.approx([0.1, 0.1, 0.1, 0.25, -0.05])


@pytest.mark.parametrize(("across", "more"), [(True, [0.2 - pi / 2.0]), (False, [])], ids=["room", "no-room"])
def test_a_filling_whose_grip_is_denied_is_gripped_by_its_other_sides_too(
    across: bool, more: list[float]
) -> None:
    yaws = headings_denied(dough_on_workspace=True, filling_free_across=across)
    assert yaws == pytest.approx([0.2, 0.2, 0.2, 0.35, 0.05, *more])


def test_wrap_looks_again_at_a_press_that_was_covered() -> None:
    body = skills.wrap({**KNOWN, "press_covered": True}, {"hand_speed": PACE})
    assert next(body).kind == "look"
    assert body.send({**KNOWN, "press_covered": False}).kind == "grip"  # to open for the handle
    assert [one.kind for one in actions("wrap", 0, press_covered=True)] == ["look"]


def test_a_wrapper_goes_back_if_something_was_put_on_the_press_while_it_was_gripped() -> None:
    body = skills.prepare(dict(KNOWN), {"hand_speed": PACE})
    now, done = dict(KNOWN), [next(body)]
    with suppress(StopIteration):
        while True:
            if done[-1].kind == "grip":
                width = done[-1].parameters["width"]
                now |= {"holding": width == skills.WRAPPER_GRIP, "finger_gap": width + 0.01}
            elif done[-1].kind == "move_tool":
                now["tool_position"] = done[-1].parameters["target"]
            # The first look was before it came.
            now["press_covered"] = [one.kind for one in done].count("look") > 1
            done.append(body.send(dict(now)))
    places = [one.parameters["target"] for one in done if one.kind == "move_tool"]
    assert not any(dist(one[:2], PRESS[:2]) < 0.1 for one in places)
    lowest = [one for one in places if one[2] == TRAY[2]]
    assert lowest == [TRAY, TRAY], "gripped there, and put back"
    assert done[-1].kind == "look"


@pytest.mark.parametrize(("place", "waits"), [((0.55, 0.33, 0.05), True), (PRESS, False)])
def test_a_dumpling_in_the_pot_is_boiled_although_the_press_is_covered(
    place: tuple[float, float, float], waits: bool
) -> None:
    covered = {"press_covered": True, "place_covered": True, "pot_covered": False}
    done = actions("boil", 0, wrapper_position=place, dumpling_wrapped=True, **covered)
    assert ("wait" in [one.kind for one in done]) is waits
    assert not grips(done)
