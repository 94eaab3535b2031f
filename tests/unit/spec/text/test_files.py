"""Text files are regular, UTF-8 and not too large, or an error says why not."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.text.files import MAX_BYTES, read_source, too_large_error


def refused_file(path: str | Path) -> Diagnostic:
    with pytest.raises(UserError) as raised:
        read_source(path)
    (found,) = raised.value.diagnostics
    return found


def test_a_path_that_is_no_regular_file_is_refused(tmp_path: Path) -> None:
    fifo = tmp_path / "fifo"
    os.mkfifo(fifo)
    loop = tmp_path / "loop"
    loop.symlink_to(loop)
    for path in (
        tmp_path / "missing.yaml",
        tmp_path,
        fifo,
        loop,
        "/dev/zero",
        "/dev/null",
        "a\0b",
        "a" * 5_000,
        "\ud800",
    ):
        assert refused_file(path).code == "AE002", path
    assert refused_file(tmp_path / "missing.yaml").headline.endswith(
        "cannot be read: no such file or directory"
    )
    assert refused_file(fifo).headline.endswith("cannot be read: it is not a regular file")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_a_file_without_permission_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.touch(mode=0o000)
    assert refused_file(path).code == "AE002"


def test_only_the_allowed_part_of_a_huge_file_is_read(tmp_path: Path) -> None:
    path = tmp_path / "huge.yaml"
    with path.open("wb") as file:
        file.truncate(100_000_000)
    assert refused_file(path).code == "AE003"


def test_a_file_that_is_not_utf8_names_the_byte(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_bytes("é: b\nc: ".encode() + b"\xff\n")
    found = refused_file(path)
    assert found.code == "AE004"
    assert found.headline == "byte 9 (0xff) is not UTF-8"
    assert found.primary is not None
    assert (found.primary.span.line, found.primary.span.column) == (2, 4)


def test_a_byte_order_mark_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_bytes("\ufeffé: b\r\n".encode())
    found = refused_file(path)
    assert (found.code, found.help) == ("AE005", ("save the file as UTF-8 without a byte order mark",))


def test_a_file_is_read_as_it_is(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_bytes("é: b\r\n".encode())
    source = read_source(path)
    assert (source.path, source.text) == (str(path), "é: b\r\n")
    path.write_bytes(b"")
    assert read_source(str(path)).text == ""


def test_a_link_to_a_file_is_followed(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text("a")
    (tmp_path / "b.yaml").symlink_to("a.yaml")
    assert read_source(tmp_path / "b.yaml").text == "a"


def test_a_file_may_be_as_large_as_allowed(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_bytes(b"a" * MAX_BYTES)
    assert len(read_source(path).text) == MAX_BYTES
    path.write_bytes(b"a" * (MAX_BYTES + 1))
    assert refused_file(path) == too_large_error(str(path))
    assert too_large_error("a").headline == "`a` is larger than 1,048,576 bytes"


def test_a_folder_is_called_one(tmp_path: Path) -> None:
    assert refused_file(tmp_path).headline.endswith("cannot be read: it is a directory")


def test_a_file_with_a_character_that_nobody_sees_is_refused_with_its_place_and_name(tmp_path: Path) -> None:
    path = tmp_path / "plan.json"
    path.write_text('{"a": 1,\n "b\u200b": 2}', encoding="utf-8")
    with pytest.raises(UserError) as refused:
        read_source(path)
    (found,) = refused.value.diagnostics
    assert found.code == "AE005"
    assert "U+200B (ZERO WIDTH SPACE)" in found.headline
    assert found.primary is not None
    assert str(found.primary.span) == f"{path}:2:4"
