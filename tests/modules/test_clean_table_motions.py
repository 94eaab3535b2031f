"""Motions of clean_table for one observation: grips beside walls, drags, drops and speeds."""

from __future__ import annotations

import runpy
from collections.abc import Generator
from contextlib import suppress
from math import pi
from types import SimpleNamespace

import pytest

from aeros.skill import Action, ActionDenied, Observation

skills = SimpleNamespace(**runpy.run_module("ecms.clean_table.skills"))
"""The skills' code, which stays unimported as other tests run it."""

BIN = (0.45, -1.7, 0.085)
BASE = (0.0, -1.2, 0.0)
PACE = 0.45
AROUND = {
    "base_position": BASE,
    "bin_position": BIN,
    "area_position": (0.5, -1.2, 0.0),
    "sponge_rest_position": (0.45, -0.86, 0.015),
    "tool_position": (0.30, -1.2, 0.45),
    "sponge_seen": True,
    "sponge_position": (0.45, -0.86, 0.015),
    "sponge_yaw": 0.0,
    "sponge_overturned": False,
    "clutter_on_table": True,
    "clutter_missing": False,
    "holding": False,
}
"""Observation of a table with a piece of clutter, and an arm that is drawn in."""


def piece(x: float, y: float, yaw: float = 0.0, length: float = 0.04) -> Observation:
    """An observation with a piece of clutter that is 40 mm high."""
    return {**AROUND, "clutter_position": (x, y, 0.02), "clutter_yaw": yaw, "clutter_length": length}


def actions(
    task: Generator[Action, Observation, object], *observed: Observation, misses: int = 0
) -> list[Action]:
    """Drive a task; each look shows the next of `observed`.

    Fingers that close hold what is there, but for the first `misses` times.
    """
    now, later, done, closed = observed[0], iter(observed[1:]), [], 0
    try:
        action = next(task)
        while True:
            done.append(action)
            values = dict(now)
            if action.kind == "move_tool":
                values["tool_position"] = action.parameters["target"]
            elif action.kind == "grip":
                is_closing = action.parameters["width"] == 0.02
                closed += is_closing
                values["holding"] = is_closing and closed > misses
            elif action.kind == "look":
                values = {**next(later, now), "tool_position": now["tool_position"]}
            now = values
            action = task.send(now)
    except StopIteration:
        return done


def grasp_of(done: list[Action]) -> tuple[tuple[float, float, float], float]:
    """Place and yaw of the tool when its fingers first close."""
    at = next(i for i, one in enumerate(done) if one.kind == "grip" and one.parameters["width"] == 0.02)
    last = done[at - 1].parameters
    return last["target"], last["yaw"]


def binned(observed: Observation, *later: Observation, offset: float = 0.0) -> list[Action]:
    """Actions that put the next piece into the bin."""
    return actions(skills._bin_clutter(observed, PACE, (offset, 0.0)), observed, *later)


def kinds(done: list[Action]) -> list[str]:
    return [one.kind for one in done]


def drop_of(done: list[Action]) -> tuple[float, float, float]:
    """Place at which the fingers open last."""
    at = max(i for i, one in enumerate(done) if one.kind == "grip" and one.parameters["width"] == skills.OPEN)
    place: tuple[float, float, float] = done[at - 1].parameters["target"]
    return place


def test_a_piece_with_room_around_is_gripped_at_its_middle_as_it_lies() -> None:
    done = binned(piece(0.5, -1.2, yaw=0.3))
    place, yaw = grasp_of(done)
    assert place == pytest.approx((0.5, -1.2, 0.024))
    assert yaw == 0.3
    assert "slide" not in kinds(done)
    assert drop_of(done)[:2] == pytest.approx(BIN[:2])


@pytest.mark.parametrize(
    ("x", "y", "grasp", "yaw"),
    [
        # 30 mm outside the long wall, the hand lacks 7 mm, by which it grips farther out.
        (0.45, -1.585, (0.45, -1.578), -pi / 2.0),
        # The same beside the short wall, along which the hand is turned.
        (0.575, -1.7, (0.582, -1.7), 0.0),
        # 40 mm are enough.
        (0.45, -1.575, (0.45, -1.575), -pi / 2.0),
    ],
)
def test_a_piece_beside_the_bin_is_gripped_along_the_wall_on_its_free_side(
    x: float, y: float, grasp: tuple[float, float], yaw: float
) -> None:
    place, heading = grasp_of(binned(piece(x, y, yaw=0.2)))
    assert place[:2] == pytest.approx(grasp, abs=1e-6)
    assert heading == yaw


def test_a_long_piece_beside_the_bin_keeps_its_grip_or_is_turned_by_a_right_angle() -> None:
    # 64 mm long, so that fingers cannot turn it, and both of its sides fit between them.
    _, heading = grasp_of(binned(piece(0.45, -1.53, yaw=-0.7, length=0.064)))
    assert heading == pytest.approx(-0.7 - pi / 2.0)
    _, heading = grasp_of(binned(piece(0.45, -1.53, yaw=-0.7, length=0.1)))
    assert heading == pytest.approx(-0.7)


def test_a_piece_at_the_wall_is_dragged_away_by_its_top_and_then_gripped() -> None:
    at_wall, free = piece(0.45, -1.605), piece(0.45, -1.55)
    done = binned(at_wall, free)
    drag = next(one for one in done if one.kind == "slide").parameters
    # 10 mm outside the wall the hand lacks 27 mm.
    assert drag["target"] == pytest.approx((0.45, -1.605 + 0.027 + 0.02, 0.04 + skills.PAD))
    assert drag["force"] == skills.DRAG_FORCE
    closed = next(one for one in done if one.kind == "grip").parameters["width"]
    assert closed == skills.CLOSED
    assert grasp_of(done)[0][:2] == pytest.approx((0.45, -1.55))


def test_a_piece_that_slips_from_under_the_fingers_is_dragged_three_times_at_most() -> None:
    done = binned(piece(0.45, -1.605))
    assert kinds(done).count("slide") == skills.DRAGS
    # Then it is gripped as far out as half a fingertip allows.
    assert grasp_of(done)[0][1] == pytest.approx(-1.605 + skills.GRIP_ASIDE)


def test_a_piece_that_is_gone_after_a_drag_is_not_gripped() -> None:
    gone = {**AROUND, "clutter_on_table": False}
    done = binned(piece(0.45, -1.605), gone)
    assert kinds(done).count("slide") == 1
    assert all(one.parameters["width"] != 0.02 for one in done if one.kind == "grip")


@pytest.mark.parametrize(("x", "grasp"), [(0.330, 0.330), (0.310, 0.318), (0.296, 0.313)])
def test_a_piece_near_the_carriage_is_gripped_on_its_far_side(x: float, grasp: float) -> None:
    assert grasp_of(binned(piece(x, -1.2)))[0][0] == pytest.approx(grasp)


@pytest.mark.parametrize(
    ("length", "offset", "dropped"), [(0.04, 0.045, 0.045), (0.12, 0.045, 0.02), (0.2, -0.045, 0.0)]
)
def test_a_long_piece_is_let_go_nearer_to_the_middle_of_the_bin(
    length: float, offset: float, dropped: float
) -> None:
    done = binned(piece(0.5, -1.2, length=length), offset=offset)
    assert drop_of(done)[0] - BIN[0] == pytest.approx(dropped)


@pytest.mark.parametrize(("x", "is_slow"), [(0.33, True), (0.5, False)])
def test_an_empty_hand_moves_slower_where_the_arm_is_folded(x: float, is_slow: bool) -> None:
    done = actions(skills._approach(AROUND, PACE, (x, -1.2, 0.03), 0.0), AROUND)
    assert (max(one.parameters["speed"] for one in done) == skills.CARRY_SPEED) is is_slow


def test_a_hand_that_may_hold_something_is_never_fast() -> None:
    for held in (True, None):
        observed = {**AROUND, "holding": held}
        done = actions(skills._approach(observed, PACE, (0.5, -1.2, 0.03), 0.0), observed)
        assert max(one.parameters["speed"] for one in done) == skills.CARRY_SPEED


def test_a_table_whose_sponge_is_overturned_is_looked_at_and_nothing_is_gripped() -> None:
    observed = {**piece(0.5, -1.2), "sponge_overturned": True}
    done = actions(skills.organize(observed, {"hand_speed": PACE}), observed)
    assert "look" in kinds(done)
    assert "grip" not in kinds(done)


def test_a_lifted_table_lifts_the_places_that_were_surveyed() -> None:
    low, high = (drop_of(binned({**piece(0.5, -1.2), "table_lift": lift}))[2] for lift in (0.0, 0.02))
    assert high - low == pytest.approx(0.02)


@pytest.mark.parametrize(("lift", "height"), [(0.0, 0.0125), (0.02, 0.0325), (-0.02, 0.0125)])
def test_a_flat_piece_is_gripped_over_the_table_and_not_below_the_sites_limit(
    lift: float, height: float
) -> None:
    flat = {**piece(0.5, -1.2), "clutter_position": (0.5, -1.2, lift + 0.005), "table_lift": lift}
    assert grasp_of(binned(flat))[0][2] == pytest.approx(height)


def grasps_of(done: list[Action]) -> list[tuple[tuple[float, float, float], float]]:
    """Place and yaw of the tool each time that its fingers close."""
    return [
        (done[at - 1].parameters["target"], done[at - 1].parameters["yaw"])
        for at, one in enumerate(done)
        if one.kind == "grip" and one.parameters["width"] == 0.02
    ]


@pytest.mark.parametrize(
    ("observed", "second"),
    [
        ({**piece(0.5, -1.2, yaw=0.3), "clutter_free_across": True}, (0.024, 0.3 - pi / 2.0)),
        ({**piece(0.5, -1.2, yaw=-0.3), "clutter_free_across": True}, (0.024, -0.3 + pi / 2.0)),
        ({**piece(0.5, -1.2, yaw=0.3), "clutter_free_across": False}, (0.019, 0.3)),
        # Beside the bin's wall the hand stays along it.
        ({**piece(0.45, -1.575), "clutter_free_across": True}, (0.019, -pi / 2.0)),
    ],
    ids=["turned", "turned the other way", "no room across", "beside the bin"],
)
def test_a_piece_that_the_fingers_miss_is_gripped_once_more_in_another_way(
    observed: Observation, second: tuple[float, float]
) -> None:
    done = actions(skills._bin_clutter(observed, PACE, (0.0, 0.0)), observed, misses=1)
    (_, first), (place, yaw) = grasps_of(done)
    assert (place[2], yaw) == pytest.approx(second)
    assert first == skills._grip_yaw(observed)
    assert drop_of(done)[:2] == pytest.approx(BIN[:2])


def test_a_piece_that_is_missed_twice_where_it_is_seen_is_left() -> None:
    observed = {**piece(0.5, -1.2), "clutter_free_across": True}
    done = actions(skills.organize(observed, {"hand_speed": PACE}), observed, misses=9)
    assert len(grasps_of(done)) == 2
    # One that has moved meanwhile is tried anew.
    moved = {**piece(0.5, -1.1), "clutter_free_across": True}
    gone = {**AROUND, "clutter_on_table": False}
    done = actions(
        skills.organize(observed, {"hand_speed": PACE}), observed, observed, observed, moved, gone, misses=2
    )
    assert len(grasps_of(done)) == 3


@pytest.mark.parametrize("skill", ["wipe", "recover"])
@pytest.mark.parametrize(("misses", "is_used"), [(0, True), (1, True), (9, False)])
def test_a_sponge_that_the_fingers_miss_is_gripped_once_more_deeper_and_none_is_swept(
    skill: str, misses: int, is_used: bool
) -> None:
    observed = {**AROUND, "clutter_on_table": False, "region": "whole"}
    done = actions(getattr(skills, skill)(observed, {"hand_speed": PACE}), observed, misses=misses)
    heights = [place[2] for place, _ in grasps_of(done)]
    assert heights == pytest.approx([0.047, 0.042][: misses + 1])
    assert ("slide" in kinds(done)) is (is_used and skill == "wipe")
    at_rest = [one.parameters["target"] for one in done if one.kind == "move_tool"]
    is_put_back = any(target[2] == pytest.approx(0.048) for target in at_rest)
    assert is_put_back is is_used


@pytest.mark.parametrize(
    ("is_wiped", "share", "sweeps"),
    [
        (True, 0.96, [4]),
        (False, 0.93, [4, 5]),
        (False, 0.2, [4]),
        (False, 0.97, [4]),
        (None, 0.93, [4]),
        (False, None, [4]),
    ],
)
def test_streaks_that_a_sweep_leaves_are_swept_over_and_nothing_else_is(
    is_wiped: bool | None, share: float | None, sweeps: list[int]
) -> None:
    observed = {**AROUND, "clutter_on_table": False, "region": "whole", "table_wiped": False}
    seen = {
        name: value
        for name, value in (("table_wiped", is_wiped), ("wiped_fraction", share))
        if value is not None
    }
    after = {
        name: value for name, value in observed.items() if name not in seen and name != "table_wiped"
    } | seen
    done = actions(skills.wipe(observed, {"hand_speed": PACE}), observed, observed, after)
    slides = [one.parameters["target"][0] for one in done if one.kind == "slide"]
    assert len(slides) == sum(sweeps)
    assert slides == pytest.approx([0.395, 0.465, 0.535, 0.605, 0.38, 0.43, 0.5, 0.57, 0.62][: sum(sweeps)])
    assert len(grasps_of(done)) == len(sweeps)
    # It lies at its rest in the end.
    assert [one.kind for one in done if one.kind in {"grip", "look"}][-1] == "look"


def headings_denied(task: Generator[Action, Observation, object], observed: Observation) -> list[float]:
    """Headings of a hand that may not come below 0.1 m, in the order of trial."""
    yaws, action = list[float](), next(task)
    with suppress(ActionDenied):
        while len(yaws) < 30:
            low = action.kind == "move_tool" and action.parameters["target"][2] < 0.1
            if low:
                yaws.append(action.parameters["yaw"])
            action = task.throw(ActionDenied("too near", observed)) if low else task.send(observed)
    return yaws


def test_a_grip_that_is_denied_is_tried_beside_the_middle_then_turned() -> None:
    observed = {**piece(0.5, -1.2, yaw=0.3), "clutter_free_across": True}
    across = 0.3 - pi / 2.0
    assert headings_denied(skills._lift_clutter(observed, PACE), observed) == pytest.approx(
        [0.3, 0.3, 0.3, 0.3 - pi, across, across, across, across + pi]
    )
    narrow = {**observed, "clutter_free_across": False}
    assert len(headings_denied(skills._lift_clutter(narrow, PACE), narrow)) == 4


def test_a_bin_and_a_rest_that_are_denied_one_heading_are_tried_at_another() -> None:
    held = {**piece(0.5, -1.2), "holding": True, "tool_position": (0.5, -1.2, 0.2)}
    assert headings_denied(skills._return_sponge(held, PACE), held) == pytest.approx([0.0, pi])


@pytest.mark.parametrize("spot", [(0.6, -0.9, 0.015), None])
def test_a_sponge_whose_rest_is_taken_meanwhile_goes_to_a_free_place_or_stays_in_the_hand(
    spot: tuple[float, float, float] | None,
) -> None:
    held = {**piece(0.5, -1.2), "holding": True, "tool_position": (0.6, -1.3, 0.2)}
    task = skills._return_sponge(held, PACE)
    action, looks, low = next(task), 0, []
    with suppress(StopIteration):
        while True:
            looks += action.kind == "look"
            if looks:
                held |= {"rest_taken": True} | ({} if spot is None else {"sponge_spot": spot})
            if action.kind == "move_tool":
                held["tool_position"] = action.parameters["target"]
                low += [held["tool_position"][:2]] if held["tool_position"][2] < 0.1 else []
            action = task.send(dict(held))
    assert set(low) == (set() if spot is None else {spot[:2]})
    assert looks >= 1 + (spot is None)
