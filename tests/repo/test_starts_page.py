"""Random starts are spread over all of the ranges that docs/starts.md states, and never outside them."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest

from aeros.sim.geometry import Vector3
from aeros.sim.layouts.dumpling_bench import sample_bench_layout
from aeros.sim.layouts.fetch import sample_room_layout
from aeros.sim.layouts.table import sample_table_layout
from aeros.sim.randomness import RandomSource
from tests.repo.tree import text_of

PLACES: dict[str, Callable[[RandomSource], Vector3]] = {
    "wrapper's tray": lambda chance: sample_bench_layout(chance).tray.position,
    "filling's stand": lambda chance: sample_bench_layout(chance).stand,
    "sponge's rest, with the sponge on it": lambda chance: sample_table_layout(chance).rest,
    "cube": lambda chance: sample_table_layout(chance).cube.position,
    "can, upright": lambda chance: sample_table_layout(chance).can.position,
    "station, before the first stand": lambda chance: sample_room_layout(chance).station,
    "second stand, with the place of delivery on it": lambda chance: sample_room_layout(chance).delivery,
}

STATED = re.compile(r"x (-?[\d.]+) to (-?[\d.]+) m, y (-?[\d.]+) to (-?[\d.]+) m")


@pytest.mark.parametrize("what", PLACES)
def test_starts_are_within_what_is_stated_and_fill_it(what: str) -> None:
    (row,) = (line for line in text_of("docs/starts.md").splitlines() if f"| {what} |" in line)
    found = STATED.search(row)
    assert found is not None
    stated = [float(one) for one in found.groups()]
    places = [PLACES[what](RandomSource(seed)) for seed in range(400)]
    for axis, (low, high) in enumerate((stated[:2], stated[2:])):
        drawn = [place[axis] for place in places]
        assert low - 1e-9 <= min(drawn) <= low + 0.05 * (high - low)
        assert high - 0.05 * (high - low) <= max(drawn) <= high + 1e-9
