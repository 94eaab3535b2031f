from __future__ import annotations

from tests.unit.models.packages import value


def test_a_number_has_one_component() -> None:
    assert value(0, 1).size == 1
    assert value(0, 1, shape=(2, 3)).size == 6
