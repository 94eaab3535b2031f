"""The sensor in time: scans at its period, readings after the latency, losses that the age shows."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from aeros.runtime.ports import Reading
from aeros.sim.clock import TICK
from aeros.sim.geometry import Vector3
from aeros.sim.randomness import RandomSource
from aeros.sim.scanners.area_sensor import AreaSensor
from aeros.sim.scanners.person_distance import RobotPosture
from aeros.sim.scanners.sections import Disc, Section
from aeros.spec.model.sensor_errors import AreaScanners
from tests.unit.sim.robot.panda import PANDA
from tests.unit.sim.scanners.cells import (
    CORNERS,
    FARTHEST,
    READY,
    reference_scanners,
    reference_site,
    scanners_at,
)

HERE = RobotPosture(READY, (0.0, 0.0, 0.0))


class Walk:
    """A cell in which somebody walks from 2 m towards the carriage at 1 m/s; `None` for nobody."""

    def __init__(self, speed: float | None) -> None:
        self.speed, self.ticks, self.looks = speed, 0, 0

    def furniture(self) -> Sequence[Section]:
        self.looks += 1
        return ()

    def people(self) -> Sequence[Section]:
        return () if self.speed is None else (Disc(-2.0 + self.speed * self.ticks * TICK, 0.0, 0.1),)

    def robot(self) -> tuple[Sequence[float], Vector3]:
        return READY, (0.0, 0.0, 0.0)


def run(cell: Walk, scanners: AreaScanners, ticks: int, seed: int = 3) -> list[Reading | None]:
    sensor = AreaSensor(scanners, cell, RandomSource(seed), PANDA, carriage=True)
    sensor.start(HERE)
    found = [sensor.reading]
    for tick in range(1, ticks):
        cell.ticks = tick
        sensor.tick(tick, HERE)
        found.append(sensor.reading)
    return found


def ages(found: Sequence[Reading | None]) -> list[float]:
    return [tick * TICK - one.time for tick, one in enumerate(found) if one is not None]


def test_readings_are_as_old_as_latency_and_period_make_them() -> None:
    cell = Walk(None)
    found = run(cell, scanners_at(*CORNERS), 480)
    assert len(ages(found)) == 480
    assert min(ages(found)[30:]) == pytest.approx(9 * TICK)
    assert max(ages(found)) <= 0.035 + 0.03 + 2 * TICK
    assert cell.looks == 2 + int(479 * TICK / 0.03)  # one of them for the survey


def test_a_reading_shows_the_moment_of_its_scan() -> None:
    found = run(Walk(1.0), scanners_at(*CORNERS), 240)
    newest = found[-1]
    assert newest is not None
    assert newest.value == pytest.approx(2.0 - newest.time - 0.1 - 0.25 - 0.1, abs=0.03)


def test_a_lost_scan_is_within_the_age_that_the_site_allows() -> None:
    """One in a row is; so are latency and period of the reference site."""
    scanners = reference_scanners()
    worst = 2 * scanners.period + scanners.latency + TICK
    most = reference_site().state[scanners.measures].max_age
    assert most is not None
    assert worst <= float(most)


class Comer(Walk):
    """A cell in which something thin is from a tick on, at the end of the rays of the only scanner."""

    def __init__(self, tick: int, y: float) -> None:
        super().__init__(None)
        self.tick, self.y = tick, y

    def people(self) -> Sequence[Section]:
        return (Disc(0.9, self.y, 0.0315),) if self.ticks >= self.tick else ()


class Dropper(Comer):
    """The same, of a thing and not of a person: it is furniture that moved."""

    BARE: Sequence[Section] = ()

    def __init__(self, tick: int, y: float) -> None:
        super().__init__(tick, y)
        self.dropped = super().people

    def people(self) -> Sequence[Section]:
        return ()

    def furniture(self) -> Sequence[Section]:
        if self.ticks < self.tick:
            return self.BARE
        if not self.BARE:
            self.BARE = (Disc(0.9, self.y, 0.0315),)
        return self.BARE


@pytest.mark.parametrize("kind", [Comer, Dropper])
@pytest.mark.parametrize("y", [0.0, 0.012, 0.024, 0.036])
def test_a_reading_is_as_old_as_what_it_makes_certain(kind: type[Comer], y: float) -> None:
    """One ray alone meets the thing at some of these places, and the second scan shows it."""
    appears = 120
    sensor = AreaSensor(
        scanners_at((-4.5, 0.0, 0.0)), cell := kind(appears, y), RandomSource(3), PANDA, carriage=False
    )
    sensor.start(HERE)
    found = []
    for tick in range(1, 240):
        cell.ticks = tick
        sensor.tick(tick, HERE)
        assert sensor.reading is not None
        found.append(sensor.reading)
    assert all((one.value < FARTHEST) == (one.time >= appears * TICK) for one in found[appears + 40 :])
    assert not [one for one in found if one.time >= appears * TICK and one.value == FARTHEST]
    assert max(ages([None, *found])) <= 0.096


def test_silent_scanners_let_the_reading_age_and_recover() -> None:
    cell = Walk(None)
    sensor = AreaSensor(scanners_at(*CORNERS), cell, RandomSource(3), PANDA, carriage=True)
    sensor.start(HERE)
    for tick in range(1, 240):
        sensor.devices.silent = frozenset(("s0",)) if 60 <= tick < 120 else frozenset()
        sensor.devices.covered = {"s1": 0.2} if 160 <= tick < 200 else {}
        sensor.tick(tick, HERE)
        assert sensor.reading is not None
        age = tick * TICK - sensor.reading.time
        if 90 <= tick <= 120 or 190 <= tick <= 200:
            assert age > 0.1
        if tick < 60 or 140 <= tick < 160 or tick >= 220:
            assert age < 0.1


def test_without_a_first_scan_there_is_no_reading() -> None:
    assert run(Walk(None), scanners_at(*CORNERS, dropout=1.0), 60) == [None] * 60


def test_noise_that_nobody_causes_shows_nobody() -> None:
    found = run(Walk(None), reference_scanners()._replace(dropout=0.0), 480)
    assert {one.value for one in found if one is not None} == {FARTHEST}
