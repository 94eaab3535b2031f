"""Distance of people from scans: intruders, shadows, covered windows, and the robot itself."""

from __future__ import annotations

import ast
from importlib.util import find_spec
from math import cos, hypot, radians, sin
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.sim.scanners.person_distance import RobotPosture
from aeros.sim.scanners.robot_outline import RobotOutline
from aeros.sim.scanners.sections import Disc, rectangle
from tests.unit.sim.robot.panda import PANDA
from tests.unit.sim.scanners.cells import CORNERS, FARTHEST, READY, Cell, scanners_at
from tests.unit.sim.scanners.test_robot_outline import REACHING_DOWN

ROBOT = RobotOutline(PANDA, READY, (0.0, 0.0, 0.0), carriage=True)


def true_distance(person: Disc, robot: RobotOutline = ROBOT) -> float:
    return robot.distance(np.array([person[:2]])) - person.radius


def test_of_an_empty_cell_it_is_the_farthest() -> None:
    assert Cell().distance() == FARTHEST


@given(st.floats(-1.9, 1.9), st.floats(-1.9, 1.9), st.floats(0.1, 0.25))
def test_a_person_is_never_farther_than_measured(x: float, y: float, radius: float) -> None:
    person = Disc(x, y, radius)
    true = true_distance(person)
    near_a_scanner = any(hypot(x - at[0], y - at[1]) < radius + 0.06 for at in CORNERS)
    if true < 0.15 or near_a_scanner:
        return
    measured = Cell().distance(person)
    assert measured is not None
    assert measured <= true
    assert measured >= true - 0.1 - 0.05 or measured < true  # nearer where the person hides something


def test_a_person_is_measured_less_the_allowance() -> None:
    person = Disc(1.2, 1.2, 0.25)
    assert Cell().distance(person) == pytest.approx(true_distance(person) - 0.1, abs=0.02)


def test_a_box_in_the_aisle_is_an_intruder() -> None:
    assert Cell().distance(rectangle((-0.2, 1.0), (0.2, 1.4))) == pytest.approx(0.675, abs=0.02)


def test_behind_a_cabinet_of_the_survey_nobody_is_seen() -> None:
    """They came through seen space, or cannot be there; so the value is as without them."""
    cabinet = rectangle((0.8, -0.6), (1.2, 0.6))
    cell = Cell(scanners_at((-2.0, -2.0, 45.0), (-2.0, 2.0, -45.0)), (cabinet,), carriage=False)
    assert cell.distance() == FARTHEST
    assert (cell.scan([Disc(1.5, 0.0, 0.2)]) == cell.scan()).all()


def test_in_a_shadow_a_person_may_stand() -> None:
    """A crate that hides a place from the only scanner counts, and so does the place behind it."""
    cell = Cell(scanners_at((0.0, -2.0, 90.0)), carriage=False)
    crate = rectangle((-0.3, -1.4), (0.3, -1.2))
    near = cell.distance(crate)
    assert near is not None
    assert near == 0.0  # the shadow reaches the robot
    two = Cell(scanners_at((0.0, -2.0, 90.0), (0.0, 2.0, -90.0)), carriage=False)
    assert two.distance(crate) == pytest.approx(ROBOT_ALONE.distance(np.array([(0.0, -1.2)])) - 0.1, abs=0.06)


ROBOT_ALONE = RobotOutline(PANDA, READY, (0.0, 0.0, 0.0), carriage=False)


def test_the_carriage_hides_nothing_if_scanners_stand_around_it() -> None:
    cell = Cell()
    assert {cell.distance(base=(x, y, 0.0)) for x in (-0.8, 0.0, 0.8) for y in (-0.8, 0.0, 0.8)} == {FARTHEST}


def test_behind_the_carriage_there_is_a_place_that_one_scanner_does_not_see() -> None:
    cell = Cell(scanners_at((-2.0, 0.0, 0.0)))
    assert cell.distance() == 0.0


def test_a_dirty_window_is_no_measurement() -> None:
    cell = Cell()
    cell.devices.covered = {"s2": 0.05}
    assert cell.distance() is None
    cell.devices.covered = {}
    assert cell.distance() == FARTHEST


def test_the_carriage_is_tracked_where_odometry_drifts() -> None:
    """By 2 mm a scan up to 150 mm, which is more than the allowance."""
    cell = Cell()
    for number in range(75):
        off = 0.002 * number
        assert cell.distance(base=(off, -off, 0.0), believed=(0.0, 0.0, 0.0)) == FARTHEST
    person = Disc(1.4, 0.1, 0.25)
    drifted = RobotOutline(PANDA, READY, (off, -off, 0.0), carriage=True)
    measured = cell.distance(person, base=(off, -off, 0.0), believed=(0.0, 0.0, 0.0))
    assert measured == pytest.approx(true_distance(person, drifted) - 0.1, abs=0.03)


def test_a_carriage_that_is_not_where_it_is_taken_to_be_is_an_intruder() -> None:
    measured = Cell().distance(base=(0.5, 0.0, 0.0), believed=(0.0, 0.0, 0.0))
    assert measured is not None
    assert measured < 0.5


def test_an_arm_that_reaches_down_is_no_intruder() -> None:
    cell = Cell()
    assert (cell.scan(joints=REACHING_DOWN) < cell.scan()).any()
    assert cell.distance(joints=REACHING_DOWN) == FARTHEST


def test_of_somebody_who_stands_still_it_does_not_rise_with_noise() -> None:
    cell = Cell(scanners_at(*CORNERS, noise=0.02))
    person = Disc(1.3, 0.0, 0.25)
    measured = [cell.distance(person) or 0.0 for _ in range(60)]
    assert measured == sorted(measured, reverse=True)
    assert measured[0] - measured[-1] < 0.06
    leaving = cell.distance(Disc(1.8, 0.0, 0.25))
    assert leaving is not None
    assert leaving > measured[-1] + 0.3


def test_noise_makes_no_intruder() -> None:
    cell = Cell(scanners_at(*CORNERS, noise=0.02), (rectangle((1.4, -0.2), (1.7, 0.2)),))
    assert {cell.distance() for _ in range(60)} == {FARTHEST}


def noticed(*scans: tuple[int, ...]) -> list[bool]:
    """Say after each scan if somebody is noticed; each is given by its rays that are shorter."""
    cell, found = Cell(), []
    free = cell.scan()
    cell.controller.evaluate(free, RobotPosture(READY, (0.0, 0.0, 0.0)))
    for rays in scans:
        ranges = free.copy()
        ranges[list(rays)] -= 0.5
        distance = cell.controller.evaluate(ranges, RobotPosture(READY, (0.0, 0.0, 0.0)))
        assert distance is not None
        found.append(distance < FARTHEST)
    return found


@pytest.mark.parametrize(
    ("scans", "are_noticed"),
    [
        (((700,), ()), [False, False]),
        (((700, 702), ()), [False, False]),
        (((700, 701), ()), [True, False]),
        (((700,), (700,)), [False, True]),
        (((700,), (701,), (703,), ()), [False, True, True, False]),
        (((700,), (), (700,)), [False, False, False]),
        (((700,), (800,), (900,)), [False, False, False]),
        (((550,), (552,)), [False, False]),  # the last but one ray of a scanner, and the second of the next
    ],
)
def test_a_ray_alone_is_noise_until_the_next_scan_finds_one_there_again(
    scans: tuple[tuple[int, ...], ...], are_noticed: list[bool]
) -> None:
    assert noticed(*scans) == are_noticed


def test_at_the_first_scan_a_ray_alone_is_somebody() -> None:
    """Nothing says that it is noise."""
    cell = Cell()
    ranges = cell.scan()
    ranges[700] -= 0.5
    distance = cell.controller.evaluate(ranges, RobotPosture(READY, (0.0, 0.0, 0.0)))
    assert distance is not None
    assert distance < FARTHEST


def test_it_says_whether_it_awaits_the_next_scan() -> None:
    cell, here = Cell(), RobotPosture(READY, (0.0, 0.0, 0.0))
    free, one = cell.scan(), cell.scan()
    one[700] -= 0.5
    awaits = []
    for ranges in (free, one, one, free, one, free):
        cell.controller.evaluate(ranges, here)
        awaits.append(cell.controller.awaits_next_scan)
    assert awaits == [False, True, False, False, True, False]


def test_a_ray_alone_that_is_farther_than_somebody_is_not_waited_for() -> None:
    cell, here = Cell(), RobotPosture(READY, (0.0, 0.0, 0.0))
    person = Disc(1.2, 0.0, 0.25)
    before, ranges = cell.scan([person]), cell.scan([person])
    untouched = np.flatnonzero((before == cell.scan()) & (before == cell.scanners.range))
    ranges[untouched[len(untouched) // 2]] -= 0.2
    for one in (before, ranges):
        cell.controller.evaluate(one, here)
    assert not cell.controller.awaits_next_scan


def far_from_a_lone_scanner(step: float) -> Cell:
    """A cell whose only scanner is 4.6 m away, with rays some degrees apart, after a scan of nobody."""
    scanners = scanners_at((-4.5, 1.0, 0.0))._replace(step=radians(step))
    cell = Cell(scanners, carriage=False)
    assert cell.distance() == FARTHEST
    return cell


@pytest.mark.parametrize(("step", "width"), [(0.5, 0.063), (0.8, 0.11), (1.0, 0.11)])
def test_a_thing_wider_than_rays_are_apart_is_missed_once_at_most(step: float, width: float) -> None:
    """Where it stands, up to the rays' end less the allowance, and where it walks, across or along them."""
    cell, is_missed_at_first = far_from_a_lone_scanner(step), 0
    for way in np.linspace(4.6, 5.35, 6).tolist():
        for turn in np.linspace(0.0, 2.0 * radians(step), 9).tolist():
            for across, along in ((0.0, 0.0), (0.048, 0.0), (0.0, -0.048)):
                assert cell.distance() == FARTHEST
                x, y = -4.5 + way * cos(turn), 1.0 + way * sin(turn)
                measured = [
                    cell.distance(Disc(x + number * along, y + number * across, width / 2))
                    for number in range(4)
                ]
                is_missed_at_first += measured[0] == FARTHEST
                last = Disc(x + 3 * along, y + 3 * across, width / 2)
                assert max(one for one in measured[1:] if one is not None) < FARTHEST
                assert measured[-1] is not None
                assert measured[-1] <= true_distance(last, ROBOT_ALONE)
    assert is_missed_at_first > 0


def test_without_a_carriage_there_is_the_arm_alone() -> None:
    cell = Cell(carriage=False)
    ranges = cell.scan([Disc(0.0, 1.0, 0.2)])
    assert cell.controller.evaluate(ranges, RobotPosture(READY, (0.0, 0.0, 0.0))) == pytest.approx(
        ROBOT_ALONE.distance(np.array([(0.0, 0.8)])) - 0.1, abs=0.03
    )


HIDDEN = ("bullet", "kinematic", "layouts", "physics", "pictures", "scenes", "sensors")
"""Parts of `aeros.sim` that know the true world."""


def imports_of(module: str) -> set[str]:
    """Modules of AEROS that a module imports, directly or not."""
    found, waiting = set[str](), [module]
    while waiting:
        name = waiting.pop()
        if name in found:
            continue
        found.add(name)
        spec = find_spec(name)
        assert spec is not None
        assert spec.origin is not None
        tree = ast.parse(Path(spec.origin).read_text(encoding="utf-8"))
        sources = [node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
        waiting.extend(source for source in sources if source.startswith("aeros."))
    return found


def test_the_controller_knows_scans_and_the_robot_and_nothing_else_of_the_world() -> None:
    imported = imports_of("aeros.sim.scanners.person_distance")
    assert "aeros.sim.scanners.sight_grid" in imported
    forbidden = [f"aeros.sim.{part}" for part in HIDDEN]
    forbidden += [f"aeros.sim.scanners.{part}" for part in ("area_sensor", "scanner_set", "sections")]
    forbidden += ["aeros.spec.model.scene"]
    known = [name for name in imported for one in forbidden if name == one or name.startswith(one + ".")]
    assert known == []
