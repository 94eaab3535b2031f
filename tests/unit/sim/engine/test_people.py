"""People who walk about: where they are when, how near they are, and what a file may say of them."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from math import dist, hypot
from typing import Any

import pytest

from aeros.runtime.ports import simulated_people
from aeros.sim.bullet.engine import BulletPerson
from aeros.sim.engine.people import Person, WalkSchedule, Waypoint
from aeros.sim.physics import PhysicsPlant, make_plant
from aeros.sim.randomness import RandomSource
from aeros.skill import act
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.acting import allow, execute, recording

pytestmark = pytest.mark.physics

WAY = (
    Waypoint((2.0, 0.0), dwell=1.0),
    Waypoint((2.0, 1.0), speed=0.5, dwell=2.0),
    Waypoint((0.0, 1.0), arrival_time=10.0),
)


def move(x: float, y: float, z: float) -> Any:
    return act("move_tool", target=(x, y, z), yaw=0.0, speed=0.4)


@pytest.mark.parametrize(
    ("time", "place"),
    [(0.0, (2.0, 0.0)), (1.0, (2.0, 0.0)), (2.0, (2.0, 0.5)), (3.0, (2.0, 1.0)), (5.0, (2.0, 1.0)),
     (7.5, (1.0, 1.0)), (10.0, (0.0, 1.0)), (99.0, (0.0, 1.0))],
)  # fmt: skip
def test_somebody_stays_walks_and_arrives_as_declared(time: float, place: tuple[float, float]) -> None:
    assert WalkSchedule(Person("a", WAY), RandomSource(0)).position(time) == pytest.approx(place)


def test_random_offsets_of_places_and_times_stay_within_their_bounds() -> None:
    person = Person("a", WAY, position_spread=0.1, max_delay=2.0)
    places = {WalkSchedule(person, RandomSource(seed)).position(0.0) for seed in range(50)}
    assert len(places) == 50
    assert all(abs(x - 2.0) <= 0.1 and abs(y) <= 0.1 for x, y in places)
    left = [
        next(
            t / 100
            for t in range(400)
            if dist(WalkSchedule(person, RandomSource(seed)).position(t / 100), at) > 0.0
        )
        for seed in range(50)
        for at in [WalkSchedule(person, RandomSource(seed)).position(0.0)]
    ]
    assert min(left) >= 1.0
    assert max(left) <= 3.02
    assert max(left) - min(left) > 1.5
    assert WalkSchedule(person, RandomSource(7)).position(2.0) == WalkSchedule(
        person, RandomSource(7)
    ).position(2.0)


def test_two_people_of_the_same_way_draw_their_own_chance() -> None:
    first, second = (
        WalkSchedule(Person(name, WAY, position_spread=0.1), RandomSource(0)).position(0.0) for name in "ab"
    )
    assert first != second


def standing(*places: tuple[float, float]) -> PhysicsPlant:
    return make_plant(
        shipped_scene("bare"), 0, people=[Person(f"p{n}", (Waypoint(at),)) for n, at in enumerate(places)]
    )


def measured(plant: PhysicsPlant) -> Any:
    return plant.observe()["human_distance"].value


def test_the_distance_is_from_the_nearest_part_of_the_robot_to_the_nearest_person() -> None:
    plant = standing((2.0, 0.0), (0.0, -3.0))
    reach = plant.observe()["tool_position"].value[0]
    # The hand is 63 mm thick to each side of the tool's axis at most, and the fingers are thinner.
    assert 2.0 - 0.25 - reach - 0.07 < measured(plant) < 2.0 - 0.25 - reach
    nearer = standing((2.0, 0.0), (0.0, -0.6))
    assert measured(nearer) < 0.6 - 0.25
    for one in (plant, nearer):
        one.close()


def test_without_anybody_in_range_the_scanner_reads_its_range() -> None:
    empty, far = make_plant(shipped_scene("bare"), 0), standing((30.0, 0.0))
    assert measured(empty) == measured(far) == 20.0
    for one in (empty, far):
        one.close()


def test_a_person_inside_the_robot_is_at_distance_zero_and_exerts_no_force() -> None:
    def positions(plant: PhysicsPlant) -> list[Any]:
        joint_positions = []
        for action in (move(0.5, 0.2, 0.3), move(0.4, -0.2, 0.2)):
            assert execute(plant, action, allow, 99.0).completed
            joint_positions.append(plant.observe()["joint_position"].value)
        return joint_positions

    alone, amid = make_plant(shipped_scene("bare"), 0), standing((0.5, 0.0))
    assert positions(alone) == positions(amid)
    assert measured(amid) == 0.0
    for one in (alone, amid):
        one.close()


def test_the_incremental_distance_equals_a_search_over_all_links() -> None:
    way = (Waypoint((1.5, -1.5)), Waypoint((0.9, 0.9), speed=1.6))
    plant = make_plant(shipped_scene("bare"), 0, people=[Person("a", way)])
    people = plant._people
    assert simulated_people(plant) == tuple(people.figures()) != ()
    (walker,) = people.walkers
    capsule = walker._capsule
    assert isinstance(capsule, BulletPerson)
    joint_positions: list[tuple[float, float]] = []

    def monitor(now: float, values: Mapping[str, Any]) -> str | None:
        joint_positions.append((values["human_distance"], capsule._query_distance(people._robot, 20.0)))
        return None

    execute(plant, move(0.5, -0.3, 0.3), monitor, 99.0)
    execute(plant, move(0.5, 0.3, 0.3), monitor, 99.0)
    assert len(joint_positions) > 500
    assert min(joint_positions)[0] < 0.5
    assert all(found == max(0.0, searched) for found, searched in joint_positions)
    plant.close()


def test_the_same_seed_repeats_bit_for_bit_with_people_and_another_does_not() -> None:
    path = (Waypoint((3.0, 0.0)), Waypoint((1.4, -1.1), speed=1.4))
    onlooker = Person("onlooker", path, floor=-0.3, position_spread=0.05, max_delay=1.0)

    def joint_positions(seed: int) -> list[Any]:
        log: list[Mapping[str, Any]] = []
        plant = make_plant(shipped_scene("table"), seed, people=[onlooker])
        execute(plant, act("wait", duration=3.0), recording(log), 99.0)
        plant.close()
        return log

    first = joint_positions(3)
    assert first[0]["human_distance"] > first[-1]["human_distance"] + 1.0
    assert joint_positions(3) == first
    assert joint_positions(4)[-1]["human_distance"] != first[-1]["human_distance"]


def test_people_walk_no_faster_than_declared() -> None:
    walk = WalkSchedule(Person("a", WAY), RandomSource(0))
    places = [walk.position(tick / 240) for tick in range(2400)]
    steps = [240 * hypot(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(places)]
    assert max(steps) == pytest.approx(0.5, rel=1e-6)
