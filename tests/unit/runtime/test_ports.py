from __future__ import annotations

from typing import Any

import pytest

from aeros.runtime.ports import CameraPicture, CameraView, ColumnNames, Reading, Snapshot, newest_pictures
from aeros.sim.fake import FakePlant
from aeros.spec.diagnostics.errors import MisuseError
from tests.unit.runtime.bench import (
    NOW,
    STATE,
    measured,
)

_ORDER = ColumnNames(STATE)


def _snapshot(values: dict[str, Any], order: ColumnNames = _ORDER, time: Any = NOW) -> Snapshot:
    return Snapshot(order, tuple(values[name] for name in order.names), time)


def test_a_snapshot_equals_its_readings() -> None:
    values = dict(STATE)
    columns = _snapshot(values)
    assert columns == measured(values)
    assert columns["load"] == Reading(0.5, NOW)
    assert columns.get("mood") is None
    assert list(columns) == sorted(values)


@pytest.mark.parametrize("column", [(), tuple(range(len(STATE) + 1)), list(STATE.values())])
def test_a_column_has_a_value_for_each_name(column: Any) -> None:
    with pytest.raises(MisuseError):
        Snapshot(_ORDER, column, NOW)


def test_column_names_must_be_str() -> None:
    with pytest.raises(MisuseError):
        ColumnNames([1, 2])  # type: ignore[list-item]


def test_names_are_in_alphabetical_order_with_their_places() -> None:
    names = ColumnNames(["wind", "load", "hand"])
    assert names.names == ("hand", "load", "wind")
    assert names.places == {"hand": 0, "load": 1, "wind": 2}
    assert ColumnNames([]).names == ()


def test_a_snapshot_is_a_mapping_of_as_many_readings_as_names() -> None:
    snapshot = Snapshot(ColumnNames(["load", "hand"]), (1.0, 2.0), 3.0)
    assert len(snapshot) == 2
    assert dict(snapshot) == {"hand": Reading(1.0, 3.0), "load": Reading(2.0, 3.0)}
    assert "hand" in snapshot
    assert "wind" not in snapshot
    with pytest.raises(KeyError):
        snapshot["wind"]


def test_a_snapshot_takes_column_names_and_a_tuple() -> None:
    with pytest.raises(MisuseError, match="a snapshot needs a tuple of 1 values"):
        Snapshot(ColumnNames(["load"]), [1.0], 0.0)  # type: ignore[arg-type]
    with pytest.raises(MisuseError, match="as `ColumnNames`"):
        Snapshot(["load"], (1.0,), 0.0)  # type: ignore[arg-type]


@pytest.mark.parametrize(("rgb", "depth"), [(17, None), (18, 23), (0, 24)])
def test_a_picture_has_all_its_pixels(rgb: int, depth: int | None) -> None:
    view = CameraView((0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 45.0)
    with pytest.raises(MisuseError, match="the picture of `mast` has not 3 × 2 pixels"):
        CameraPicture("mast", 0.0, 3, 2, bytes(rgb), None if depth is None else bytes(depth), view)


def test_a_plant_without_cameras_has_no_pictures() -> None:
    assert newest_pictures(FakePlant()) == {}
