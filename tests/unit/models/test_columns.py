from __future__ import annotations

import io
import zipfile

import numpy as np
import pytest

from aeros.models.columns import MAX_NUMBERS, read_columns, split_header
from aeros.models.interface import ModelFileError

WANTED = {"level [mm]": (0.0, 10.0), "volume": (0.5, 1.5)}


def npz(**arrays: object) -> bytes:
    file = io.BytesIO()
    np.savez(file, **arrays)  # type: ignore[arg-type]
    return file.getvalue()


def test_the_three_formats_hold_the_same_columns() -> None:
    assert read_columns("a.csv", b"level [mm],volume\n0,0.5\n10,1.5\n") == WANTED
    assert read_columns("a.json", b'{"level [mm]": [0, 10], "volume": [0.5, 1.5]}') == WANTED
    arrays = {
        "level [mm]": np.array([0, 10], dtype=np.int32),
        "volume": np.array([0.5, 1.5], dtype=np.float32),
    }
    assert read_columns("a.npz", npz(**arrays)) == WANTED


@pytest.mark.parametrize("type_", ["<f8", ">f8", "<i2", "<u8"])
def test_arrays_of_numbers_are_read_as_numpy_wrote_them(type_: str) -> None:
    assert read_columns("a.npz", npz(x=np.array([1, 2, 3], dtype=type_))) == {"x": (1.0, 2.0, 3.0)}


def test_a_unit_stands_in_brackets() -> None:
    assert split_header("level [mm]") == ("level", "mm")
    assert split_header("level") == ("level", None)


@pytest.mark.parametrize(
    ("file", "content", "cause"),
    [
        ("a.txt", b"", "ends in none of"),
        ("a.csv", b"", "^`a.csv`: .* begins with the names"),
        ("a.csv", b"x,y [mm]\n1,2\n\n3,z\n", r"^`a.csv`: line 4, column `y \[mm\]`: `z` is no number"),
        ("a.csv", b"x\n1\n \n", "^`a.csv`: line 3, column `x`: a number is missing"),
        ("a.csv", b"x,y\n1\n", "line 2: the header names 2 columns, and here are 1"),
        ("a.csv", b"x;y\n0,5;1\n", "separated by ';', not by commas"),
        ("a.csv", b"x\ty\n0\t1\n", r"separated by '\\t', not by commas"),
        ("a.csv", b"x\nnan\n", "not finite"),
        ("a.csv", b"x\n", "at least one number"),
        ("a.csv", b"x,x\n1,2\n", "two columns are named `x`"),
        ("a.csv", b"\xff", "byte 0 of `a.csv` is not UTF-8"),
        ("a.json", b"[1]", "an object with a list"),
        ("a.json", b'{"x": [true]}', "numbers only"),
        ("a.json", b'{"x": [1], "y": [1, 2]}', "one length"),
        ("a.json", b"[" * 100_000, "no well-formed"),
        ("a.npz", b"no archive", "no well-formed"),
    ],
)
def test_a_malformed_table_is_refused_with_the_cause(file: str, content: bytes, cause: str) -> None:
    with pytest.raises(ModelFileError, match=cause) as refused:
        read_columns(file, content)
    assert bool(refused.value.cure) == file.endswith((".csv", ".txt")) or "one length" in cause


def test_a_byte_order_mark_before_a_csv_table_is_not_part_of_a_name() -> None:
    assert read_columns("a.csv", b"\xef\xbb\xbflevel [mm],volume\n0,0.5\n10,1.5\n") == WANTED


def test_nothing_is_unpickled() -> None:
    with pytest.raises(ModelFileError, match="not a list of numbers"):
        read_columns("a.npz", npz(x=np.array([{}], dtype=object)))


def test_an_array_of_two_dimensions_is_no_column() -> None:
    with pytest.raises(ModelFileError, match="not a list of numbers"):
        read_columns("a.npz", npz(x=np.zeros((2, 2))))


def test_an_archive_of_many_numbers_is_not_unpacked() -> None:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("x.npy", bytes(8 * (MAX_NUMBERS + 1)))
    with pytest.raises(ModelFileError, match="more than 1,000,000"):
        read_columns("a.npz", file.getvalue())
