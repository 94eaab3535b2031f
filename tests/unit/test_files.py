"""Durable writes, temporary folders and locks: what is flushed, in which order, and who gets a lock."""

from __future__ import annotations

import os
import re
import signal
import socket
import stat
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from aeros.files import (
    hold_temporary_folder,
    make_folder,
    open_private,
    open_regular,
    replace_durably,
    sync_folder,
    temporary_folder,
    temporary_root,
    try_lock,
    write_durably,
)
from tests.repo.tree import ROOT


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


def test_only_a_regular_file_is_opened(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"content")
    (tmp_path / "link").symlink_to("file")
    with open_regular(tmp_path / "link") as opened:
        assert opened.read() == b"content"
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", Path("/dev/zero"), tmp_path):
        with pytest.raises(OSError, match="not a regular file"):
            open_regular(path)


def test_a_file_that_is_not_there_is_created_and_may_be_empty(tmp_path: Path) -> None:
    replace_durably(tmp_path / "state", b"")
    assert (tmp_path / "state").read_bytes() == b""


def test_the_leftovers_of_an_earlier_write_do_not_matter(tmp_path: Path) -> None:
    (tmp_path / "state.new").write_bytes(b"half of something longer")
    replace_durably(tmp_path / "state", b"new")
    assert (tmp_path / "state").read_bytes() == b"new"


def test_a_device_a_pipe_and_a_link_stay_what_they_are(tmp_path: Path) -> None:
    device = tmp_path / "device"
    device.symlink_to("/dev/null")
    replace_durably(device, b"lost")
    open_private(device).close()
    assert device.is_char_device()
    assert device.stat().st_mode & 0o777 == 0o666
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    replace_durably(pipe, b"read")
    assert os.read(reader, 10) == b"read"
    os.close(reader)
    assert pipe.is_fifo()
    target, link = tmp_path / "target", tmp_path / "link"
    link.symlink_to(target)
    for content in (b"first", b"second"):
        replace_durably(link, content)
        assert link.is_symlink()
        assert target.read_bytes() == content


def test_a_write_that_fails_leaves_the_old_content(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "state"
    path.write_text("old")

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space left") as raised:
        replace_durably(path, b"new")
    assert raised.value.filename == str(tmp_path / "state.new")
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


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


def test_a_file_that_cannot_be_locked_is_an_error(tmp_path: Path) -> None:
    descriptor = os.open(tmp_path / "lock", os.O_RDWR | os.O_CREAT)
    os.close(descriptor)
    with pytest.raises(OSError, match="Bad file descriptor"):
        try_lock(descriptor)


# Folders.


def test_every_new_folder_is_flushed_into_the_folder_above(tmp_path: Path, flushed: list[str]) -> None:
    make_folder(tmp_path / "a" / "b" / "c", 0o700)
    assert flushed == [f"folder {tmp_path.name}", "folder a", "folder b"]
    assert (tmp_path / "a" / "b" / "c").stat().st_mode & 0o777 == 0o700
    assert (tmp_path / "a").stat().st_mode & 0o700 == 0o700
    flushed.clear()
    make_folder(tmp_path / "a" / "b" / "c")
    assert flushed == []


def test_a_relative_folder_is_flushed_too(
    tmp_path: Path, flushed: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    make_folder(Path("a/b"))
    assert flushed == [f"folder {tmp_path.name}", "folder a"]


def test_a_folder_in_whose_place_is_something_else_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    for path in (tmp_path / "file", tmp_path / "file" / "below", tmp_path / "link"):
        with pytest.raises(OSError, match=r"File exists|Not a directory"):
            make_folder(path)


NOT_DURABLE = {
    "aeros/cli/author/new/module.py": "staged, then renamed as a whole",
    "aeros/cli/author/new/project.py": "written again if it is lost",
    "aeros/cli/connect/ros2_messages.py": "built again if it is lost",
    "aeros/cli/robot/module_source.py": "in a temporary folder",
    "aeros/experiments/report/write.py": "written anew each time",
    "aeros/experiments/trials/inline_module.py": "in a temporary folder",
    "aeros/experiments/trials/synthetic.py": "in a temporary folder",
    "aeros/runtime/isolation/control_groups.py": "of the kernel, in memory",
    "aeros/runtime/registry/archive.py": "in a temporary folder",
    "aeros/runtime/registry/bundle_store.py": "flushed as a whole before it is renamed",
    "aeros/runtime/tools/confinement.py": "in a temporary folder",
}
"""Modules that create folders which need not survive a power cut, with the reason."""


def test_folders_are_made_durably_in_one_place() -> None:
    makers = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "aeros").rglob("*.py")
        if re.search(r"\.mkdir\(|makedirs\(", path.read_text(encoding="utf-8"))
    }
    assert makers == {"aeros/files.py", *NOT_DURABLE}


def test_temporary_folders_are_made_in_one_place() -> None:
    """So that those of killed processes are deleted."""
    named = re.compile(r"mkdtemp|TemporaryDirectory|NamedTemporaryFile|mkstemp")
    makers = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "aeros").rglob("*.py")
        if named.search(path.read_text(encoding="utf-8"))
    }
    assert makers == {
        "aeros/files.py",
        "aeros/apps/ros2/message_build.py",  # of pip and cmake, which end with it
        "aeros/cli/author/verify.py",  # a file that the user is to keep
        "aeros/experiments/trials/sessions.py",  # within another temporary folder
    }


# Temporary folders.

HOLD = """
import sys, time
from pathlib import Path
from aeros.files import hold_temporary_folder, temporary_folder
at = Path(sys.argv[1])
with temporary_folder(at) as folder, hold_temporary_folder(folder.parent / "chosen"):
    (folder / "below").mkdir()
    (folder / "below" / "file").touch()
    print(folder, flush=True)
    time.sleep(60)
"""


def test_a_temporary_folder_is_private_and_deleted(tmp_path: Path) -> None:
    with temporary_folder(tmp_path) as folder:
        assert folder.parent == temporary_root(tmp_path) == tmp_path / f".aeros-{os.geteuid()}"
        assert folder.stat().st_mode & 0o777 == 0o700
        assert list(folder.iterdir()) == []
        (folder / "file").touch()
        with temporary_folder(tmp_path) as other:
            assert other != folder
        assert (folder / "file").exists()
        assert not other.exists()
    assert list(tmp_path.iterdir()) == []  # nothing stays beside anybody's files
    shared = temporary_root()
    assert shared is not None
    assert shared.name == f"aeros-{os.geteuid()}"
    with temporary_folder() as folder:
        assert folder.parent == shared
    assert shared.exists()


def test_a_folder_whose_root_another_process_deletes_is_made_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[Path] = []

    def make(dir: Path) -> str:  # noqa: A002  as its caller calls it
        made.append(dir)
        if len(made) == 1:
            dir.rmdir()  # between the look for the root and the lock on it
        folder = dir / "own"
        folder.mkdir()
        return str(folder)

    monkeypatch.setattr(tempfile, "mkdtemp", make)
    with temporary_folder(tmp_path) as folder:
        assert folder == tmp_path / f".aeros-{os.geteuid()}" / "own"
    assert len(made) == 2
    assert list(tmp_path.iterdir()) == []


def test_folders_of_a_killed_process_are_deleted_by_the_next(tmp_path: Path) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", HOLD, str(tmp_path)], stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        folder = Path(process.stdout.readline().strip())
        with socket.socket(socket.AF_UNIX) as listening:
            listening.bind(str(folder / "socket"))
        with temporary_folder(tmp_path):
            # While it lives, both of its folders stay.
            assert (folder / "below" / "file").exists()
            assert (folder.parent / "chosen").exists()
        process.send_signal(signal.SIGKILL)
        process.wait()
    assert folder.exists()
    with temporary_folder(tmp_path) as own:
        assert list(folder.parent.iterdir()) == [own]


def test_a_chosen_folder_is_kept_while_it_is_held(tmp_path: Path) -> None:
    root = temporary_root(tmp_path)
    assert root is not None
    with hold_temporary_folder(root / "chosen"), temporary_folder(tmp_path):
        assert (root / "chosen").stat().st_mode & 0o777 == 0o700
    assert list(root.iterdir()) == []


def test_a_root_that_others_may_change_is_not_used(tmp_path: Path) -> None:
    root = tmp_path / f".aeros-{os.geteuid()}"
    root.mkdir()
    root.chmod(0o777)
    assert temporary_root(tmp_path) is None
    with temporary_folder(tmp_path) as folder:
        assert folder.parent == tmp_path
    assert not folder.exists()
    root.rmdir()
    (tmp_path / "elsewhere").mkdir(0o700)
    root.symlink_to(tmp_path / "elsewhere")
    assert temporary_root(tmp_path) is None
    root.unlink()
    root.touch()
    assert temporary_root(tmp_path) is None


def test_a_path_that_is_no_folder_is_left_alone(tmp_path: Path) -> None:
    root = temporary_root(tmp_path)
    assert root is not None
    (root / "file").touch()
    (tmp_path / "elsewhere").mkdir()
    (root / "link").symlink_to(tmp_path / "elsewhere")
    with temporary_folder(tmp_path):
        pass
    assert sorted(one.name for one in root.iterdir()) == ["file", "link"]


def test_a_link_to_itself_is_an_error_of_the_system(tmp_path: Path) -> None:
    (tmp_path / "loop").symlink_to("loop")
    with pytest.raises(OSError, match="symbolic links"):
        replace_durably(tmp_path / "loop", b"new")
