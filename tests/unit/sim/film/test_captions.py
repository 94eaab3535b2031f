"""Each status has a text."""

from __future__ import annotations

from typing import get_args

from aeros.sim.film.captions import STATUS_TEXTS, Status
from aeros.sim.film.overlay import STATUS_COLOURS


def test_each_status_has_a_text_and_a_colour() -> None:
    assert set(STATUS_TEXTS) == set(STATUS_COLOURS) == set(get_args(Status))
