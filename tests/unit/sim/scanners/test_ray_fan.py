"""Rays of scanners: their number, their order and their directions."""

from __future__ import annotations

from math import degrees

import numpy as np
import pytest

from aeros.sim.scanners.ray_fan import ray_fan
from tests.unit.sim.scanners.cells import CORNERS, scanners_at


def test_each_scanner_has_its_rays_around_where_it_faces() -> None:
    fan = ray_fan(scanners_at(*CORNERS))
    assert fan.per_scanner == 551
    assert len(fan.origins) == 4 * 551
    for number, (x, y, facing) in enumerate(CORNERS):
        rays = fan.rays_of(number)
        assert (fan.origins[rays] == (x, y)).all()
        angles = np.degrees(np.unwrap(np.arctan2(*fan.directions[rays].T[::-1])))
        assert np.diff(angles) == pytest.approx(0.5)
        middle = angles[275] - facing
        assert degrees(np.sin(np.radians(middle))) == pytest.approx(0.0, abs=1e-6)


def test_rays_are_of_length_1() -> None:
    fan = ray_fan(scanners_at(*CORNERS))
    assert np.hypot(*fan.directions.T) == pytest.approx(1.0)
