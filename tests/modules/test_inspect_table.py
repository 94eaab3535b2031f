"""The perceiver of `inspect_table`: which cells of the table two pictures show together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pytest

from tests.modules.looking import Top, Watched, draw
from tests.modules.test_clean_table import OVERHEAD, PLACES

ARM = (80, 80, 80)
LEFT = Top(0.5, 0.2, 0.45, (0.2, 0.15), ARM)
RIGHT = Top(0.5, -0.3, 0.45, (0.2, 0.15), ARM)
"""An arm over a part of the table, m: the pictures show no point below it."""


def inspected(overhead: Sequence[Top], mast: Sequence[Top], **readings: Any) -> Any:
    watched = Watched("inspect_table", "see_all", {"clean_table.area_position": PLACES["area_position"]})
    watched.readings |= readings
    pictures = draw(OVERHEAD, overhead), draw(OVERHEAD, mast, name="mast")
    return watched.see(0.0, *pictures).get("table_inspected")


@pytest.mark.parametrize(
    ("overhead", "mast", "answer"),
    [
        ([], [], True),
        ([LEFT], [], True),
        ([LEFT], [RIGHT], True),
        ([LEFT], [LEFT], False),
        # A piece on the table is seen itself.
        ([Top(0.5, 0.1, 0.04, (0.02, 0.02), ARM)], [], True),
        # An arm as wide as one cell hides no piece, and as wide as three it does.
        ([Top(0.5, 0.1, 0.45, (0.004, 0.2), ARM)] * 2, [Top(0.5, 0.1, 0.45, (0.004, 0.2), ARM)], True),
        ([Top(0.5, 0.1, 0.45, (0.05, 0.05), ARM)], [Top(0.5, 0.1, 0.45, (0.05, 0.05), ARM)], False),
    ],
)
def test_all_cells_are_seen_unless_both_pictures_hide_a_place(
    overhead: list[Top], mast: list[Top], answer: bool
) -> None:
    assert inspected(overhead, mast) is answer


def test_it_is_unknown_if_a_picture_shows_no_table_or_the_place_of_the_table_is_unknown() -> None:
    covered = [Top(0.5, 0.0, 0.45, (2.0, 2.0), ARM)]
    assert inspected([], covered) is None
    watched = Watched("inspect_table", "see_all")
    assert watched.see(0.0, draw(OVERHEAD, []), draw(OVERHEAD, [], name="mast")) == {}
