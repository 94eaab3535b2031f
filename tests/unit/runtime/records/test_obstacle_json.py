"""Obstacles in records: what is written is read again, and nothing else is read."""

from __future__ import annotations

import json
from typing import Any

import pytest

from aeros.runtime.ports import Obstacle
from aeros.runtime.records.obstacle_json import obstacles_from_json, obstacles_to_json

BOX = Obstacle("unknown-object-1", (0.3, -0.1, 0.0), (0.4, 0.1, 0.25), 3.5, "overhead", "bench")


def test_an_encoding_is_read_again() -> None:
    assert obstacles_from_json(json.loads(json.dumps(obstacles_to_json([BOX, BOX])))) == (BOX, BOX)
    assert obstacles_from_json(()) == ()


@pytest.mark.parametrize(
    "change",
    [{"lower": [0.3, -0.1]}, {"upper": [0.3, -0.1, float("nan")]}, {"lower": None}, {"colour": "red"}],
)
def test_other_encodings_are_refused(change: dict[str, Any]) -> None:
    (encoded,) = obstacles_to_json([BOX])
    with pytest.raises((TypeError, ValueError)):
        obstacles_from_json([{**encoded, **change}])


def test_an_obstacle_is_named_with_its_place_and_size() -> None:
    assert str(BOX) == "unknown-object-1 at (0.35, 0.00) m in bench, 100 x 200 x 250 mm"
