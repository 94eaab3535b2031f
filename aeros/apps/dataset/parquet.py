"""Parquet files of a dataset.

The sole importer of PyArrow, which the extra `dataset` installs.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from io import BytesIO
from typing import Any, Final

import pyarrow as pa
import pyarrow.parquet as pq

_INDEX: Final = "__index_level_0__"
"""Name that pandas gives to the column of an index without a name."""


def data_table(columns: Mapping[str, Sequence[Any]], features: Mapping[str, Mapping[str, Any]]) -> bytes:
    """Write the frames of an episode.

    Args:
        columns: values of each feature, but for videos.
        features: the features, in order.

    Returns:
        A Parquet file.
    """
    kept = {name: one for name, one in features.items() if one["dtype"] != "video"}
    arrays = {name: pa.array(list(columns[name]), _type_of(one)) for name, one in kept.items()}
    return _file(pa.table(arrays))


def episode_table(episode: Mapping[str, Any]) -> bytes:
    """Write the metadata of one episode.

    Args:
        episode: its values by column.

    Returns:
        A Parquet file of one row.
    """
    return _file(pa.table({name: [value] for name, value in episode.items()}))


def task_table(numbers: Mapping[str, int]) -> bytes:
    """Write the tasks as pandas writes them with the tasks' texts as index, which LeRobot reads.

    Args:
        numbers: the number of each task, by its text.

    Returns:
        A Parquet file.
    """

    def column(field: str, pandas_type: str, numpy_type: str) -> dict[str, Any]:
        name = None if field == _INDEX else field
        return {
            "name": name,
            "field_name": field,
            "pandas_type": pandas_type,
            "numpy_type": numpy_type,
            "metadata": None,
        }

    about = {
        "index_columns": [_INDEX],
        "column_indexes": [],
        "columns": [column("task_index", "int64", "int64"), column(_INDEX, "unicode", "object")],
        "creator": {"library": "pyarrow", "version": pa.__version__},
        "pandas_version": None,
    }
    table = pa.table({"task_index": pa.array(numbers.values(), pa.int64()), _INDEX: list(numbers)})
    return _file(table.replace_schema_metadata({"pandas": json.dumps(about)}))


def read_columns(content: bytes) -> dict[str, list[Any]]:
    """Read a Parquet file.

    Args:
        content: the file.

    Returns:
        The values of each column.

    Raises:
        ValueError: it is no Parquet file.
    """
    try:
        found: dict[str, list[Any]] = pq.read_table(BytesIO(content)).to_pydict()
    except pa.ArrowException as error:
        raise ValueError(str(error)) from error
    return found


def read_tasks(content: bytes) -> list[str]:
    """Read the texts of the tasks, in the order of their numbers.

    Args:
        content: a file as `task_table` writes it.

    Returns:
        The texts.

    Raises:
        ValueError: it is no such file.
    """
    columns = read_columns(content)
    if columns.keys() != {"task_index", _INDEX}:
        raise ValueError(f"its columns are {', '.join(columns)}")
    return [task for _, task in sorted(zip(columns["task_index"], columns[_INDEX], strict=True))]


def _type_of(feature: Mapping[str, Any]) -> Any:
    element = {"float32": pa.float32(), "int64": pa.int64(), "bool": pa.bool_()}[feature["dtype"]]
    # A list of one is a number in this format.
    return element if feature["shape"] == [1] else pa.list_(element, feature["shape"][0])


def _file(table: Any) -> bytes:
    written = BytesIO()
    pq.write_table(table, written, compression="snappy")
    return written.getvalue()
