"""Columns of numbers from CSV, JSON and NumPy `npz` files. NumPy is not needed, and nothing is unpickled.

A column is named `NAME` or `NAME [UNIT]`, as in `level [mm]`.

    CSV:   a header, then a row of numbers for each line
    JSON:  {"level [mm]": [0, 10, 20], "volume": [0, 0.1, 0.25]}
    npz:   an array of one dimension for each column, float32, float64 or an integer type
"""

from __future__ import annotations

import ast
import csv
import io
import json
import math
import struct
import zipfile
from collections.abc import Iterable, Mapping
from typing import Final

from aeros.models.interface import ModelFileError

MAX_NUMBERS: Final = 1_000_000
"""Limit on the numbers of one table."""

_NPY_MAGIC: Final = b"\x93NUMPY"
_NPY_TYPES: Final = {
    "f4": "f",
    "f8": "d",
    "i1": "b",
    "i2": "h",
    "i4": "i",
    "i8": "q",
    "u1": "B",
    "u2": "H",
    "u4": "I",
    "u8": "Q",
}
"""Codes of `struct` by NumPy's codes of types."""


def read_columns(file: str, content: bytes) -> dict[str, tuple[float, ...]]:
    """Read the columns of a table.

    Args:
        file: name of the file; its suffix is `.csv`, `.json` or `.npz`.
        content: bytes of the file.

    Returns:
        The numbers of each column, all of one length, by the column's name with its unit as written.

    Raises:
        ModelFileError: the file has another suffix, is malformed, or holds numbers that are not finite,
            columns of different lengths or more than `MAX_NUMBERS` numbers.
    """
    readers = {".csv": _read_csv, ".json": _read_json, ".npz": _read_npz}
    suffix = file[file.rfind(".") :].lower()
    if suffix not in readers:
        headline = f"`{file}` is not a table: its name ends in none of .csv, .json, .npz"
        raise ModelFileError(headline, "store it as one of these, or declare `kind: file`")
    try:
        columns = readers[suffix](content)
    except ModelFileError as error:
        raise ModelFileError(f"`{file}`: {error}", error.cure) from error
    except UnicodeDecodeError as error:
        raise ModelFileError(f"byte {error.start} of `{file}` is not UTF-8", "store it as UTF-8") from error
    except (ValueError, LookupError, OSError, struct.error, zipfile.BadZipFile, RecursionError) as error:
        raise ModelFileError(f"`{file}` is no well-formed {suffix} table: {str(error)[:200]}") from error
    lengths = {len(column) for column in columns.values()}
    if len(lengths) != 1 or 0 in lengths:
        headline = f"`{file}` needs columns of one length, with at least one number in each"
        raise ModelFileError(headline, "add a row for each point")
    for name, column in columns.items():
        if not all(map(math.isfinite, column)):
            headline = f"the column `{name}` of `{file}` holds a number that is not finite"
            raise ModelFileError(headline, "write a finite number in each row, or leave the row out")
    return columns


def split_header(header: str) -> tuple[str, str | None]:
    """Split the name of a column from its unit.

    Args:
        header: as `level [mm]` or `level`.

    Returns:
        The name, and the unit as written; None without a unit.
    """
    name, bracket, unit = header.partition("[")
    return name.strip(), unit.strip().removesuffix("]").strip() if bracket else None


def _read_csv(content: bytes) -> dict[str, tuple[float, ...]]:
    # Spreadsheets write a byte order mark before "CSV UTF-8".
    reader = csv.reader(io.StringIO(content.decode().removeprefix("\ufeff")), strict=True)
    rows = [(reader.line_num, row) for row in reader if row]
    if not rows:
        cure = "write them into the first line, as in `level [mm],volume`"
        raise ModelFileError("a CSV table begins with the names of its columns", cure)
    (_, header), *body = rows
    if len(header) == 1 and (separator := next((one for one in ";\t" if one in header[0]), None)):
        cure = "put commas between the columns, and a point before the decimals"
        raise ModelFileError(f"its columns are separated by {separator!r}, not by commas", cure)
    for line, row in body:
        if len(row) != len(header):
            found = f"line {line}: the header names {len(header)} columns, and here are {len(row)}"
            raise ModelFileError(found, "write one number for each column")
    _limit(len(header) * len(body))
    numbers = [
        [_number(cell, line, name) for cell, name in zip(row, header, strict=True)] for line, row in body
    ]
    columns = zip(*numbers, strict=True) if numbers else [()] * len(header)
    return _unique((name.strip(), tuple(column)) for name, column in zip(header, columns, strict=True))


def _number(cell: str, line: int, column: str) -> float:
    try:
        return float(cell)
    except ValueError:
        found = f"`{cell[:40]}` is no number" if cell.strip() else "a number is missing"
        cure = "write a number, as 0.25 or 2.5e-1"
        raise ModelFileError(f"line {line}, column `{column.strip()}`: {found}", cure) from None


def _read_json(content: bytes) -> dict[str, tuple[float, ...]]:
    data = json.loads(content)
    if not isinstance(data, Mapping) or not all(isinstance(column, list) for column in data.values()):
        raise ModelFileError("a JSON table is an object with a list of numbers for each column")
    _limit(sum(map(len, data.values())))
    if not all(type(one) in (int, float) for column in data.values() for one in column):
        raise ModelFileError("a JSON table holds numbers only")
    return {name.strip(): tuple(map(float, column)) for name, column in data.items()}


def _read_npz(content: bytes) -> dict[str, tuple[float, ...]]:
    columns: list[tuple[str, tuple[float, ...]]] = []
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        for entry in archive.infolist():
            _limit(entry.file_size // 8)
            with archive.open(entry) as file:
                # An archive may hold more than it says; no more than that is read.
                array = _read_npy(file.read(entry.file_size + 1), entry.filename)
            columns.append((entry.filename.removesuffix(".npy").strip(), array))
    _limit(sum(len(column) for _, column in columns))
    return _unique(columns)


def _read_npy(content: bytes, name: str) -> tuple[float, ...]:
    """Read an array of one dimension.

    Source: NumPy, numpy/lib/format.py, format versions 1.0 to 3.0.

    Raises:
        ModelFileError: it is no such array, or has too many numbers.
    """
    if content[:6] != _NPY_MAGIC or len(content) < 12:
        raise ModelFileError(f"`{name}` in the archive is not a NumPy array")
    width = 2 if content[6] == 1 else 4
    start = 8 + width + int.from_bytes(content[8 : 8 + width], "little")
    header = ast.literal_eval(content[8 + width : start].decode())
    order, code = header["descr"][:1], header["descr"][1:]
    if order not in "<>|=" or code not in _NPY_TYPES or len(header["shape"]) != 1:
        raise ModelFileError(
            f"the array `{name}` is not a list of numbers: {header['descr']}, {header['shape']}"
        )
    sign = ">" if order == ">" else "<"
    count = header["shape"][0]
    _limit(count)
    return tuple(map(float, struct.unpack(f"{sign}{count}{_NPY_TYPES[code]}", content[start:])))


def _limit(count: int) -> None:
    if count > MAX_NUMBERS:
        raise ModelFileError(f"it holds more than {MAX_NUMBERS:,} numbers")


def _unique(columns: Iterable[tuple[str, tuple[float, ...]]]) -> dict[str, tuple[float, ...]]:
    found: dict[str, tuple[float, ...]] = {}
    for name, column in columns:
        if name in found:
            raise ModelFileError(f"two columns are named `{name}`", "rename one, or remove it")
        found[name] = column
    return found
