"""Pieces on a table that is lower than it was surveyed."""

from __future__ import annotations

import runpy
from types import SimpleNamespace

import numpy as np
import pytest

pieces = SimpleNamespace(**runpy.run_module("ecms.clean_table.pieces"))


@pytest.mark.parametrize(
    ("height", "table", "fits"),
    [
        (0.010, 0.0, True),
        (0.010, 0.02, True),
        (0.010, -0.02, False),
        (0.030, -0.02, True),
        (0.005, 0.0, False),
        (0.005, 0.02, False),
    ],
)
def test_fingertips_do_not_follow_a_table_that_is_lower(height: float, table: float, fits: bool) -> None:
    points = np.array([[0.5, -1.2, height]])
    one = pieces.Piece(points, (0.5, -1.2, height / 2.0), 0.0, (0.03, 0.05, height))
    values = pieces.choose_piece([one], [points], (0.5, -1.2, 0.0), "whole", table)
    assert values["clutter_ungraspable"] is not fits
    assert ("clutter_position" in values) is fits
