"""Random starts are spread over the ranges that docs/starts.md states, over all of them and no more."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest

from aeros.sim.geometry import Triple
from aeros.sim.layouts.dumpling_bench import lay_bench
from aeros.sim.layouts.fetch import lay_room
from aeros.sim.layouts.table import lay_table
from aeros.sim.randomness import Chance
from tests.repo.tree import text_of

PLACES: dict[str, Callable[[Chance], Triple]] = {
    "wrapper's tray": lambda chance: lay_bench(chance).tray.position,
    "filling's stand": lambda chance: lay_bench(chance).stand,
    "sponge's rest, with the sponge on it": lambda chance: lay_table(chance).rest,
    "cube": lambda chance: lay_table(chance).cube.position,
    "can, upright": lambda chance: lay_table(chance).can.position,
    "station, before the first stand": lambda chance: lay_room(chance).station,
    "second stand, and on it the place to bring it to": lambda chance: lay_room(chance).delivery,
}

STATED = re.compile(r"x (-?[\d.]+) to (-?[\d.]+) m, y (-?[\d.]+) to (-?[\d.]+) m")


@pytest.mark.parametrize("what", PLACES)
def test_starts_are_within_what_is_stated_and_fill_it(what: str) -> None:
    (row,) = (line for line in text_of("docs/starts.md").splitlines() if f"| {what} |" in line)
    found = STATED.search(row)
    assert found is not None
    stated = [float(one) for one in found.groups()]
    places = [PLACES[what](Chance(seed)) for seed in range(400)]
    for axis, (low, high) in enumerate((stated[:2], stated[2:])):
        drawn = [place[axis] for place in places]
        assert low - 1e-9 <= min(drawn) <= low + 0.05 * (high - low)
        assert high - 0.05 * (high - low) <= max(drawn) <= high + 1e-9
