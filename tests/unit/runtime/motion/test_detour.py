"""Ways round obstacles, each checked as a whole by a stand-in for the decision of motions."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator, Sequence
from functools import partial
from itertools import combinations, pairwise, permutations
from math import cos, dist, pi, sin
from operator import eq

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from aeros.runtime.motion.detour import MOST_TRIES, find_base_detour, find_detour
from aeros.runtime.motion.swept_volume import BarrierBox
from aeros.runtime.ports import Vec3
from tests.unit.runtime.motions import chance_of

START, TARGET, BASE = (0.4, -0.3, 0.25), (0.4, 0.3, 0.25), (0.0, 0.0, 0.0)
WALL = BarrierBox("wall", (0.3, -0.1, 0.0), (0.5, 0.1, 0.4), False, False, None)


def anywhere(_: Vec3) -> bool:
    return True


class Offered:
    """Notes the places that may be on a way, and allows each."""

    def __init__(self) -> None:
        self.places: list[Vec3] = []

    def __call__(self, place: Vec3) -> bool:
        """Note a place."""
        self.places.append(place)
        return True


def clear(way: Sequence[Vec3]) -> int | None:
    return None


def found(
    check: Callable[[Sequence[Vec3]], int | None] = clear,
    is_allowed: Callable[[Vec3], bool] = anywhere,
    target: Vec3 = TARGET,
) -> list[Vec3] | None:
    return find_detour(START, target, BASE, [WALL], is_allowed, check)


def test_a_way_leads_to_the_target_and_round_the_obstacle() -> None:
    way = found()
    assert way is not None
    assert len(way) > 1
    assert way[-1] == TARGET
    for one, other in zip([START, *way], way, strict=False):
        for step in range(101):
            p = [a + (b - a) * step / 100.0 for a, b in zip(one, other, strict=True)]
            assert not all(low < x < high for low, x, high in zip(WALL.lower, p, WALL.upper, strict=True))


def test_a_way_that_fails_its_check_is_not_returned_and_the_failing_leg_is_not_used_again() -> None:
    tried: list[list[Vec3]] = []

    def over_it(way: Sequence[Vec3]) -> int | None:
        tried.append([START, *way])
        low = [number for number, place in enumerate(way[:-1]) if place[2] < 0.6]
        return low[0] if low else None

    way = found(over_it)
    assert way is not None
    assert all(place[2] >= 0.6 for place in way[:-1])
    first = [(one[number], one[number + 1]) for one in tried[:-1] for number in (0,) if one[1][2] < 0.6]
    assert len(first) == len(set(first))


def test_no_leg_ends_where_none_may() -> None:
    way = found(is_allowed=lambda place: place[0] >= 0.4)
    assert way is not None
    assert all(x >= 0.4 for x, _, _ in way)


def test_the_search_ends_without_a_way() -> None:
    tries = 0

    def never(way: Sequence[Vec3]) -> int:
        nonlocal tries
        tries += 1
        return 0

    assert found(never) is None
    assert tries <= MOST_TRIES
    assert found(is_allowed=lambda place: False) is None
    assert found(target=(0.4, 0.0, 0.2)) is None, "the target is inside the obstacle"


def test_the_straight_way_is_not_tried() -> None:
    far = (0.4, -0.3, 0.8)
    way = find_detour(START, far, BASE, [WALL], anywhere, clear)
    assert way is not None
    assert len(way) > 1


@settings(max_examples=20, deadline=None)
@given(st.lists(st.booleans(), min_size=8, max_size=8))
def test_equal_worlds_give_equal_ways(answers: list[bool]) -> None:
    def check() -> Callable[[Sequence[Vec3]], int | None]:
        left = list(answers)
        return lambda way: 0 if left and left.pop() else None

    assert found(check()) == found(check())


def test_a_base_drives_beside_an_obstacle_and_not_over_it() -> None:
    start, target = (0.0, 0.0, 0.0), (0.0, 2.0, 0.0)
    blocked = BarrierBox("box", (-0.2, 0.8, -9.0), (0.5, 1.2, 9.0), False, False, None)
    way = find_base_detour(start, target, [blocked], anywhere, clear)
    assert way is not None
    assert way[-1] == target
    assert all(z == 0.0 for _, _, z in way)
    assert min(x for x, _, _ in way) < -0.2, "the nearer side"
    right = find_base_detour(start, target, [blocked], lambda place: place[0] > -0.2, clear)
    assert right is not None
    assert max(x for x, _, _ in right) > 0.5
    aisle = find_base_detour(start, target, [blocked], lambda place: -0.2 < place[0] < 0.5, clear)
    assert aisle is None


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("way", [-1.0, 1.0])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_base_passes_close_beside_an_obstacle_on_the_nearer_side(
    axis: int, way: float, side: float
) -> None:
    def at(along: float, across: float) -> Vec3:
        return (way * along, side * across, 0.0) if axis == 0 else (side * across, way * along, 0.0)

    (ax, ay, _), (bx, by, _) = at(0.8, -0.5), at(1.2, 0.2)
    lower, upper = (min(ax, bx), min(ay, by), -9.0), (max(ax, bx), max(ay, by), 9.0)
    blocked = BarrierBox("box", lower, upper, False, False, None)
    found = find_base_detour(at(0.0, 0.0), at(2.0, 0.0), [blocked], anywhere, clear)
    assert found is not None
    # At least 35 mm from its side, and the shortest way is the one with the fewest legs.
    assert max(side * place[1 - axis] for place in found) == pytest.approx(0.235)
    assert found[-1] == at(2.0, 0.0)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_base_passes_an_obstacle_at_exactly_the_least_distance(side: float) -> None:
    blocked = BarrierBox("box", (-1.0, 0.5, -9.0), (1.0, 1.5, 9.0), False, False, None)
    beside = side * 1.03
    start = (beside, 0.0, 0.0)
    along = find_base_detour(start, (beside, 2.0, 0.0), [blocked], anywhere, clear)
    assert along is not None
    assert all(x == beside for x, _, _ in along), "along its side"
    at_its_side = (beside, 1.0, 0.0)
    offered = Offered()
    find_base_detour(start, (side * 2.0, 1.0, 0.0), [blocked], offered, clear)
    assert at_its_side in offered.places
    turned = find_base_detour((side * 2.0, 0.0, 0.0), at_its_side, [blocked], anywhere, clear)
    assert turned is not None
    assert [y for _, y, _ in turned] == [1.0, 1.0], "straight up to its side"


def test_places_at_exactly_the_least_distance_from_each_other_are_apart() -> None:
    offered = Offered()
    find_base_detour((0.0, -2.0, 0.0), (0.04, -2.0, 0.0), [WALL], offered, clear)
    assert [x for x, y, _ in offered.places if y == WALL.upper[1] + 0.15][:2] == [0.0, 0.04]


def test_the_places_of_a_way_are_around_the_obstacle_over_it_and_near_the_base() -> None:
    places = Offered()
    found(is_allowed=places)
    offered = places.places
    # Heights of the ends, over the base, and over the top of the obstacle.
    heights = sorted({z for _, _, z in offered})
    assert heights == pytest.approx([0.25, 0.36, 0.45, 0.56, 0.7])
    columns = {(x, y) for x, y, z in offered if z == max(heights)}
    assert START[:2] in columns
    assert TARGET[:2] in columns
    wanted = [
        (0.4 + along * (0.1 + off), 0.0 + across * (0.1 + off))
        for off in (0.14, 0.24, 0.36)
        for along in (-1, 0, 1)
        for across in (-1, 0, 1)
        if (along, across) != (0, 0)
    ]
    turns = [pi * step / 6.0 for step in range(-4, 5)]
    wanted += [(far * cos(turn), far * sin(turn)) for far in (0.32, 0.45) for turn in turns]
    for column in wanted:
        assert min(dist(column, other) for other in columns) < 0.04, column
    for column in columns - {START[:2], TARGET[:2], (0.4, 0.0)}:
        assert min(dist(column, other) for other in wanted) < 1e-9, column
    assert all(dist(one, other) >= 0.04 for one, other in combinations(columns, 2))


ALL = Offered()
found(is_allowed=ALL)
OFFERED = ALL.places


def passes_near(one: Vec3, other: Vec3) -> bool:
    """Tell if a leg comes within 5 cm of the wall: a graph leaves out some of these."""
    for step in range(61):
        place = [a + (b - a) * step / 60.0 for a, b in zip(one, other, strict=True)]
        if all(a - 0.05 < p < b + 0.05 for a, p, b in zip(WALL.lower, place, WALL.upper, strict=True)):
            return True
    return False


def cost(way: Sequence[Vec3]) -> float:
    return sum(dist(one, other) + 0.15 for one, other in pairwise([START, *way]))


@pytest.mark.parametrize("seed", range(12))
def test_no_other_way_that_passes_its_check_is_cheaper(seed: int) -> None:
    chance = chance_of(seed)
    for _ in range(8):
        places = chance.sample(OFFERED, chance.choice([2, 3, 4]))
        refused = {
            leg
            for leg in permutations([START, *places, TARGET], 2)
            if leg == (START, TARGET) or passes_near(*leg) or chance.random() < 0.2
        }

        def check(way: Sequence[Vec3], refused: Container[tuple[Vec3, Vec3]] = refused) -> int | None:
            legs = list(pairwise([START, *way]))
            return next((number for number, leg in enumerate(legs) if leg in refused), None)

        ways = [[*via, TARGET] for count in range(1, 5) for via in permutations(places, count)]
        passing = [cost(way) for way in ways if check(way) is None]
        way = found(check, places.__contains__)
        assert (way is not None) == bool(passing)
        if way is not None:
            assert cost(way) == pytest.approx(min(passing))


def random_world(seed: int) -> tuple[Vec3, Vec3, list[BarrierBox]]:
    """A start, a target, and two boxes, which may be near the ends and each other."""
    chance = chance_of(seed)
    boxes = []
    for name in ("one", "other"):
        x, y, z = (chance.uniform(-0.4, 0.4) for _ in range(3))
        upper = (x + chance.uniform(0.05, 0.3), y + chance.uniform(0.05, 0.3), z + chance.uniform(0.05, 0.3))
        boxes.append(BarrierBox(name, (x, y, z), upper, False, False, None))
    start, target = (
        (chance.uniform(-0.6, 0.6), chance.uniform(-0.6, 0.6), chance.uniform(0.0, 0.5)) for _ in "12"
    )
    return start, target, boxes


def clearance(place: Sequence[float], boxes: Sequence[BarrierBox]) -> float:
    """Distance along the axis on which the place is farthest out of the nearest box; negative inside."""
    return min(
        max(max(low - p, p - high) for low, p, high in zip(box.lower, place, box.upper, strict=True))
        for box in boxes
    )


def test_legs_are_used_where_they_keep_three_centimetres_from_obstacles_and_only_there() -> None:
    seen = {True: 0, False: 0}
    for seed in range(60):
        start, target, boxes = random_world(seed)
        offered = Offered()
        find_detour(start, target, BASE, boxes, offered, clear)
        assert min(clearance(place, boxes) for place in offered.places) >= 0.03
        via = chance_of(seed).choice(offered.places)
        line = [
            [a + (b - a) * step / 150.0 for a, b in zip(one, other, strict=True)]
            for one, other in ((start, via), (via, target))
            for step in range(151)
        ]
        least = min(clearance(place, boxes) for place in line)
        way = find_detour(start, target, BASE, boxes, partial(eq, via), clear)
        if not 0.03 <= least < 0.04:  # samples are 1 cm apart
            assert way == ([via, target] if least > 0.03 else None), seed
            seen[way is None] += 1
    assert min(seen.values()) >= 10


def test_a_world_that_is_elsewhere_has_the_same_places_there() -> None:
    def shifted(place: Vec3) -> Vec3:
        return (place[0] + 1.0, place[1] - 2.0, place[2] + 0.5)

    for seed in range(3):
        start, target, boxes = random_world(seed)
        there = [box._replace(lower=shifted(box.lower), upper=shifted(box.upper)) for box in boxes]
        arm, base, arm_there, base_there = (Offered() for _ in range(4))
        find_detour(start, target, BASE, boxes, arm, clear)
        find_detour(shifted(start), shifted(target), shifted(BASE), there, arm_there, clear)
        find_base_detour(start, target, boxes, base, clear)
        find_base_detour(shifted(start), shifted(target), there, base_there, clear)
        for here, elsewhere in ((arm, arm_there), (base, base_there)):
            assert [*map(shifted, here.places)] == [pytest.approx(place) for place in elsewhere.places]


class CountedBoxes(list[BarrierBox]):
    """Obstacles that count how often they are looked through: once for each place and for each leg."""

    looks = 0

    def __iter__(self) -> Iterator[BarrierBox]:
        """Count, and look through them."""
        self.looks += 1
        return super().__iter__()


def test_a_leg_is_examined_once_and_only_if_the_search_comes_to_it() -> None:
    def looks(tries: int) -> int:
        boxes, left = CountedBoxes([WALL]), [1] * tries
        find_detour(START, TARGET, BASE, boxes, anywhere, lambda _: left.pop() if left else None)
        return boxes.looks

    assert looks(0) <= 9 * len(OFFERED), "of which the search has set out from eight"
    assert looks(20) <= 40 * len(OFFERED)
