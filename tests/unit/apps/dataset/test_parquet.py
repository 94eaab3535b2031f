"""Parquet files hold what was written, with the types that the features declare."""

from __future__ import annotations

from io import BytesIO
from typing import Any

import pyarrow.parquet as pq
import pytest

from aeros.apps.dataset import parquet

_FEATURES: dict[str, dict[str, Any]] = {
    "observation.state": {"dtype": "float32", "shape": [2]},
    "index": {"dtype": "int64", "shape": [1]},
    "next.done": {"dtype": "bool", "shape": [1]},
    "observation.images.cell": {"dtype": "video", "shape": [240, 320, 3]},
}


def test_columns_have_the_declared_types_and_videos_have_none() -> None:
    columns: dict[str, list[Any]] = {
        "observation.state": [[0.5, 1.0], [0.0, -2.0]],
        "index": [7, 8],
        "next.done": [False, True],
    }
    content = parquet.data_table(columns, _FEATURES)
    schema = pq.read_schema(BytesIO(content))
    assert [(name, str(schema.field(name).type)) for name in schema.names] == [
        ("observation.state", "fixed_size_list<element: float>[2]"),
        ("index", "int64"),
        ("next.done", "bool"),
    ]
    assert parquet.read_columns(content) == columns


def test_tasks_are_read_in_the_order_of_their_numbers() -> None:
    assert parquet.read_tasks(parquet.task_table({"b": 1, "a": 0})) == ["a", "b"]


def test_an_episode_is_one_row() -> None:
    episode = {"episode_index": 3, "tasks": ["make dumplings"], "stats/action/mean": [0.5, 1.0]}
    assert parquet.read_columns(parquet.episode_table(episode)) == {
        name: [value] for name, value in episode.items()
    }


def test_another_file_is_refused() -> None:
    with pytest.raises(ValueError, match="magic bytes"):
        parquet.read_columns(b"no such file")
    with pytest.raises(ValueError, match="its columns are index"):
        parquet.read_tasks(parquet.episode_table({"index": 1}))
