"""Durable writes and locks: what is flushed, in which order, and who gets a lock."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import pytest

from aeros.files import replace_durably, sync_folder, try_lock, write_durably


@pytest.fixture
def flushed(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Record flushes and renames from here on, in order: `file` or `folder`, each with its name."""
    seen: list[str] = []
    real_flush, real_rename = os.fsync, Path.replace

    def flush(descriptor: int) -> None:
        kind = "folder" if stat.S_ISDIR(os.fstat(descriptor).st_mode) else "file"
        path = Path(f"/proc/self/fd/{descriptor}").readlink()
        content = "" if kind == "folder" else f" {path.read_text()}"
        seen.append(f"{kind} {path.name}{content}")
        real_flush(descriptor)

    def rename(path: Path, target: Path) -> Path:
        seen.append(f"rename {path.name} to {target.name}")
        return real_rename(path, target)

    monkeypatch.setattr(os, "fsync", flush)
    monkeypatch.setattr(Path, "replace", rename)
    return seen


def test_a_file_is_replaced_once_its_new_content_is_on_the_disk(tmp_path: Path, flushed: list[str]) -> None:
    path = tmp_path / "state"
    path.write_text("old")
    replace_durably(path, b"new")
    assert flushed == ["file state.new new", "rename state.new to state", f"folder {tmp_path.name}"]
    assert path.read_bytes() == b"new"
    assert [one.name for one in tmp_path.iterdir()] == ["state"]


def test_a_file_that_is_not_there_is_created_and_may_be_empty(tmp_path: Path) -> None:
    replace_durably(tmp_path / "state", b"")
    assert (tmp_path / "state").read_bytes() == b""


def test_what_a_write_before_left_does_not_matter(tmp_path: Path) -> None:
    (tmp_path / "state.new").write_bytes(b"half of something longer")
    replace_durably(tmp_path / "state", b"new")
    assert (tmp_path / "state").read_bytes() == b"new"


def test_a_write_that_fails_leaves_the_old_content(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "state"
    path.write_text("old")

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space left"):
        replace_durably(path, b"new")
    assert path.read_text() == "old"


def test_a_file_is_overwritten_in_place_and_flushed(tmp_path: Path, flushed: list[str]) -> None:
    path = tmp_path / "log"
    path.write_bytes(b"longer than it will be")
    same = path.stat().st_ino
    write_durably(path, b"short")
    assert flushed == ["file log short"]
    assert (path.read_bytes(), path.stat().st_ino) == (b"short", same)


def test_a_folder_is_flushed_and_closed(tmp_path: Path, flushed: list[str]) -> None:
    before = len(os.listdir("/proc/self/fd"))
    sync_folder(tmp_path)
    assert flushed == [f"folder {tmp_path.name}"]
    assert len(os.listdir("/proc/self/fd")) == before


def test_only_a_folder_is_flushed_as_one(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    for path in (tmp_path / "file", tmp_path / "nowhere"):
        with pytest.raises(OSError, match=r"Not a directory|No such file"):
            sync_folder(path)


def test_a_lock_is_one_opens_at_a_time(tmp_path: Path) -> None:
    path = tmp_path / "lock"
    first, second = (os.open(path, os.O_RDWR | os.O_CREAT) for _ in range(2))
    try:
        assert try_lock(first) is True
        assert try_lock(first) is True  # it has it already
        assert try_lock(second) is False
        os.close(first)
        first = second
        assert try_lock(second) is True
    finally:
        os.close(second)


def test_what_cannot_be_locked_is_an_error(tmp_path: Path) -> None:
    descriptor = os.open(tmp_path / "lock", os.O_RDWR | os.O_CREAT)
    os.close(descriptor)
    with pytest.raises(OSError, match="Bad file descriptor"):
        try_lock(descriptor)
