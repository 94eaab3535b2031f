"""Simulated scanners: noise, losses, covered windows, the survey, and the robot in the plane."""

from __future__ import annotations

import numpy as np
import pytest

from aeros.sim.randomness import RandomSource
from aeros.sim.scanners.scanner_set import ScannerSet
from aeros.sim.scanners.sections import Disc, rectangle
from tests.unit.sim.robot.panda import PANDA
from tests.unit.sim.scanners.cells import CORNERS, READY, Cell, scanners_at

WALLS = (rectangle((-3.0, 2.5), (3.0, 2.6)), rectangle((-3.0, -2.6), (3.0, -2.5)))


def devices(**more: float) -> ScannerSet:
    return ScannerSet(scanners_at(*CORNERS, **more), RandomSource(5), PANDA, carriage=True)


def scan(scanners: ScannerSet, number: int, *people: Disc) -> np.ndarray:
    return scanners.scan(number, WALLS, people, READY, (0.0, 0.0, 0.0))


def test_noise_has_its_deviation_and_differs_from_scan_to_scan() -> None:
    true = scan(devices(), 0)
    noisy = devices(noise=0.02)
    errors = np.array([scan(noisy, number) - true for number in range(40)])[:, true < 5.4]
    assert errors.std() == pytest.approx(0.02, rel=0.02)
    assert errors.mean() == pytest.approx(0.0, abs=3e-4)
    assert not (errors[0] == errors[1]).any()


def test_a_ray_that_meets_nothing_has_no_noise() -> None:
    assert (scan(devices(noise=0.02), 0)[scan(devices(), 0) == 5.5] == 5.5).all()


def test_the_same_seed_repeats_after_any_history() -> None:
    one, other = devices(noise=0.02, dropout=0.3), devices(noise=0.02, dropout=0.3)
    scan(one, 3)
    assert (scan(one, 20) == scan(other, 20)).all()
    assert [one.loses(number) for number in range(50)] == [other.loses(number) for number in range(50)]


def test_a_scan_is_lost_if_one_of_the_scanners_loses_it() -> None:
    lost = np.mean([devices(dropout=0.1).loses(number) for number in range(2000)])
    assert lost == pytest.approx(1.0 - 0.9**4, abs=0.03)
    silent = devices()
    assert not silent.loses(0)
    silent.silent = frozenset(("s1",))
    assert silent.loses(0)


@pytest.mark.parametrize(("share", "count"), [(1.0, 551), (0.1, 55), (0.0001, 1)])
def test_a_covered_window_sees_itself(share: float, count: int) -> None:
    scanners = devices()
    scanners.covered = {"s2": share}
    is_covered = scan(scanners, 0) == 0.0
    assert is_covered.sum() == count
    assert is_covered[2 * 551 + 275]
    assert is_covered[2 * 551 : 3 * 551].sum() == count


def test_the_survey_is_the_furniture_alone_with_little_noise() -> None:
    scanners = devices(noise=0.02)
    exact = devices().teach(WALLS)
    taught = scanners.teach(WALLS)
    is_hit = exact < 5.5
    assert (taught - exact)[is_hit].std() == pytest.approx(0.002, rel=0.05)
    assert (taught[~is_hit] == 5.5).all()
    assert (scan(devices(), 0) < exact - 0.1).any()  # the carriage is not in the survey


def test_a_person_in_the_plane_shortens_rays() -> None:
    cell = Cell()
    assert (cell.scan([Disc(1.0, 0.0, 0.2)]) <= cell.scan()).all()
    assert (cell.scan([Disc(1.0, 0.0, 0.2)]) < cell.scan()).any()
