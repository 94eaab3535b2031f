"""Random starts are spread over all of the ranges that docs/starts.md states, and never outside them."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest

from aeros.sim.geometry import Vector3
from tests.repo.tree import text_of
from tests.unit.sim.start_layouts import bench_layout, room_layout, table_layout

PLACES: dict[str, Callable[[int], Vector3]] = {
    "wrapper's tray": lambda seed: bench_layout(seed).tray.position,
    "filling's stand": lambda seed: bench_layout(seed).stand.position,
    "sponge's rest, with the sponge on it": lambda seed: table_layout(seed).rest,
    "cube": lambda seed: table_layout(seed).cube.position,
    "can, upright": lambda seed: table_layout(seed).can.position,
    "station, before the first stand": lambda seed: room_layout(seed).station,
    "second stand, with the place of delivery on it": lambda seed: room_layout(seed).delivery,
}

STATED = re.compile(r"x (-?[\d.]+) to (-?[\d.]+) m, y (-?[\d.]+) to (-?[\d.]+) m")


@pytest.mark.parametrize("what", PLACES)
def test_starts_are_within_what_is_stated_and_fill_it(what: str) -> None:
    (row,) = (line for line in text_of("docs/starts.md").splitlines() if f"| {what} |" in line)
    found = STATED.search(row)
    assert found is not None
    stated = [float(one) for one in found.groups()]
    places = [PLACES[what](seed) for seed in range(400)]
    for axis, (low, high) in enumerate((stated[:2], stated[2:])):
        drawn = [place[axis] for place in places]
        assert low - 1e-9 <= min(drawn) <= low + 0.05 * (high - low)
        assert high - 0.05 * (high - low) <= max(drawn) <= high + 1e-9
