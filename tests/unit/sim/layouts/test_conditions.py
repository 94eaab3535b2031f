"""Seals, timers and truth follow a simulator's true state, and nothing else."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi, radians, sin
from typing import Any

import pytest

from aeros.sim.clock import TICK
from aeros.sim.geometry import UPRIGHT, Pose, Vector3, yaw_orientation
from aeros.sim.layouts.coating import CoatingMap
from aeros.sim.layouts.conditions import SceneState
from aeros.sim.layouts.placement import place_things
from aeros.sim.randomness import RandomSource
from aeros.spec.model.scene import BodyPart
from tests.shipped_scenes import shipped_scene


class StillWorld:
    """A simulator whose true state is written down; what it does not have is 0 or false."""

    def __init__(self, poses: Mapping[str, Pose], **values: Any) -> None:
        self.poses = dict(poses)
        self.force, self.joint, self.held = 0.0, 0.0, False
        self.coating = CoatingMap(shipped_scene("table").coatings["dirt"])
        self.sealed: list[tuple[BodyPart, float]] = []
        vars(self).update(values)

    def pose_of(self, part: BodyPart) -> Pose:
        return self.poses[part.body]

    def joint_position(self, joint: BodyPart) -> float:
        return self.joint

    def load_on(self, part: BodyPart) -> float:
        return self.force

    def force_between(self, first: BodyPart, second: BodyPart) -> float:
        return self.force

    def is_held(self, body: str) -> bool:
        return self.held

    def coating_of(self, name: str) -> CoatingMap:
        assert name == "dirt"
        return self.coating

    def robot_points(self) -> tuple[Vector3, Vector3]:
        return (1.0, 2.0, 0.3), (1.5, 2.0, 0.7)

    def seal(self, joint: BodyPart, friction: float) -> None:
        self.sealed.append((joint, friction))


def made(name: str) -> tuple[SceneState, StillWorld]:
    scene = shipped_scene(name)
    poses = place_things(scene, RandomSource(0))
    world = StillWorld(poses)
    return SceneState(scene, poses, world), world


def in_pot(world: StillWorld) -> None:
    """Put the dumpling into the pot: a plate at 20 mm, and the filling 11.5 mm above it."""
    world.poses["wrapper"] = Pose((0.55, 0.33, 0.020), UPRIGHT)
    world.poses["filling"] = Pose((0.55, 0.33, 0.0315), UPRIGHT)


def test_a_seal_closes_once_in_the_tick_in_which_its_condition_holds() -> None:
    state, world = made("dumpling_bench")
    in_pot(world)
    for force, joint, is_sealed in ((0.5, pi, False), (2.0, radians(159.9), False), (2.0, pi, True)):
        world.force, world.joint = force, joint
        state.tick()
        assert state.sealed["dough"] is is_sealed
    world.force = 0.0
    state.tick()
    assert world.sealed == [(BodyPart("wrapper", "fold"), 0.5)]
    assert state.truth() == {
        "make_dumplings.robot_at_bench": False,
        "make_dumplings.dough_on_workspace": False,
        "make_dumplings.filling_on_workspace": False,
        "make_dumplings.wrapper_aligned": False,
        "make_dumplings.dumpling_wrapped": True,
        "make_dumplings.dumplings_cooked": 0,
        "make_dumplings.dumpling_cooked": False,
    }


def test_a_timer_counts_ticks_without_a_break_and_keeps_the_longest() -> None:
    state, world = made("dumpling_bench")
    in_pot(world)
    world.force, world.joint = 2.0, pi
    for _ in range(240):
        state.tick()
    assert (state.value("cooking"), state.value("cooking.longest")) == (1.0, 1.0)
    world.poses["filling"] = Pose((0.0, 0.0, 1.0), UPRIGHT)
    state.tick()
    assert (state.value("cooking"), state.value("cooking.longest")) == (0.0, 1.0)
    in_pot(world)
    state.tick()
    assert (state.value("cooking"), state.value("cooking.longest")) == (TICK, 1.0)
    for _ in range(5 * 240 - 1):
        assert not state.truth()["make_dumplings.dumpling_cooked"]
        state.tick()
    assert state.truth()["make_dumplings.dumpling_cooked"]


@pytest.mark.parametrize(
    ("rows", "cube", "off", "expected"),
    [
        (30, (0.45, -1.70, 0.02), 0.0, (True, True, True)),
        (28, (0.45, -1.70, 0.02), 0.0, (False, True, False)),
        (30, (0.45, -1.61, 0.02), 0.0, (True, False, False)),
        (30, (0.45, -1.70, 0.09), 0.0, (True, False, False)),
        (30, (0.45, -1.70, 0.02), 0.031, (True, False, False)),
    ],
)
def test_a_table_is_clean_by_its_coating_and_by_where_things_are(
    rows: int, cube: Vector3, off: float, expected: tuple[bool, bool, bool]
) -> None:
    assert truths_of_table(slice(0, rows), cube, off)["whole"] == expected


@pytest.mark.parametrize(
    ("rows", "cube", "left", "right"),
    [
        # Left of the area's middle, at -1.2 m, are the upper 15 rows.
        (slice(15, 30), (0.45, -1.50, 0.02), (True, True, True), (False, False, False)),
        (slice(0, 15), (0.45, -1.50, 0.02), (False, True, False), (True, False, False)),
        (slice(0, 15), (0.45, -1.70, 0.02), (False, True, False), (True, True, True)),
        (slice(0, 30), (0.45, -0.95, 0.02), (True, False, False), (True, True, True)),
        # A thing that fell off the table is no less in the way of a goal.
        (slice(0, 30), (0.45, -0.60, -0.28), (True, False, False), (True, True, True)),
    ],
)
def test_of_a_half_only_what_is_there_counts(
    rows: slice, cube: Vector3, left: tuple[bool, bool, bool], right: tuple[bool, bool, bool]
) -> None:
    found = truths_of_table(rows, cube, 0.0)
    assert (found["left"], found["right"]) == (left, right)


def truths_of_table(wiped: slice, cube: Vector3, off: float) -> dict[str, tuple[bool, ...]]:
    """Wiped, organized and verified by truth, for each region, with these rows of cells wiped."""
    state, world = made("table")
    world.coating.wiped[wiped] = True
    world.poses["cube"] = world.poses["can"] = Pose(cube, UPRIGHT)
    x, y, z = world.poses["sponge_rest_position"].position
    world.poses["sponge"] = Pose((x + off, y, z), UPRIGHT)
    truth = state.truth()
    goals = [f"clean_table.table_{what}" for what in ("wiped", "organized", "verified")]
    return {
        region: tuple(bool(truth[f"{goal}(region = {region})"]) for goal in goals)
        for region in ("whole", "left", "right")
    }


@pytest.mark.parametrize(
    ("off", "is_held", "is_delivered"),
    [((0.0, 0.0, 0.0), False, True), ((0.0, 0.0, -0.018), False, True), ((0.0, 0.0, 0.0), True, False),
     ((0.031, 0.0, 0.0), False, False), ((0.0, 0.0, 0.011), False, False)],
)  # fmt: skip
def test_a_can_is_delivered_if_it_stands_or_lies_there_and_is_let_go(
    off: Vector3, is_held: bool, is_delivered: bool
) -> None:
    state, world = made("fetch")
    x, y, z = world.poses["delivery_position"].position
    world.poses["can"] = Pose((x + off[0], y + off[1], z + off[2]), UPRIGHT)
    world.held = is_held
    assert {name: one for name, one in state.truth().items() if "red_can" in name} == {
        "fetch_object.object_grasped(object = red_can)": is_held,
        "fetch_object.object_absent(object = red_can)": False,
        "fetch_object.object_delivered(object = red_can, to = anywhere)": is_delivered,
        "fetch_object.object_delivered(object = red_can, to = middle)": is_delivered,
        "fetch_object.object_delivered(object = red_can, to = left)": False,
        "fetch_object.object_delivered(object = red_can, to = right)": False,
    }


def test_variables_are_read_by_their_names() -> None:
    state, world = made("table")
    world.poses["can"] = Pose((0.1, 0.2, 0.3), yaw_orientation(0.5))
    assert state.value("can.position") == (0.1, 0.2, 0.3)
    assert (state.value("can.yaw"), state.value("can.tilt")) == (pytest.approx(0.5), pytest.approx(0.0))
    world.poses["can"] = Pose((0.0, 0.0, 0.0), (sin(0.2), 0.0, 0.0, (1 - sin(0.2) ** 2) ** 0.5))
    assert state.value("can.tilt") == pytest.approx(0.4)
    assert state.value("robot.base") == (1.0, 2.0, 0.3)
    assert state.value("robot.tool") == (1.5, 2.0, 0.7)
    assert state.value("bin_position") == pytest.approx((0.45, -1.7, 0.085))


def test_a_region_moves_with_its_body() -> None:
    state, world = made("dumpling_bench")
    quarter = Pose((1.0, 1.0, 0.0), yaw_orientation(pi / 2))
    world.poses["wrapper"] = quarter
    # The plate is 42 mm along x and 56 mm along y of the wrapper, which is turned by a quarter.
    for dx, dy, is_inside in ((0.0, 0.0, True), (0.027, 0.0, True), (0.0, 0.022, False), (0.029, 0.0, False)):
        world.poses["filling"] = Pose((1.0 + dx, 1.0 + dy, 0.0115), UPRIGHT)
        assert state.value("filling.position in plate") is is_inside


def test_the_truth_of_a_number_is_how_many_conditions_hold() -> None:
    state, _ = made("dumpling_bench")
    name = "make_dumplings.dumplings_cooked"
    found = []
    for ticks in ({}, {"cooking_2": 1200}, {"cooking": 1300, "cooking_2": 1200}, {"cooking": 1199}):
        state._ticks = {one: (0, ticks.get(one, 0)) for one in ("cooking", "cooking_2")}
        found.append(state.truth()[name])
    assert found == [0, 1, 2, 0]
    assert state.value(name) == 0
