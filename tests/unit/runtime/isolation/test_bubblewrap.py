"""The command line of bubblewrap, word by word."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.runtime.isolation.bubblewrap import find_bubblewrap, wrap_command


def mounts(command: list[str]) -> list[str]:
    """The folders that are mounted, each at its own place."""
    places = [place for place, word in enumerate(command) if word == "--ro-bind-try"]
    assert [command[place + 1] for place in places] == [command[place + 2] for place in places]
    return [command[place + 1] for place in places]


def test_everything_is_unshared_and_dropped_and_the_command_comes_last() -> None:
    command = wrap_command("/usr/bin/bwrap", ["python", "-c", "pass"], [], 7)
    assert command[:6] == [
        "/usr/bin/bwrap",
        "--unshare-all",
        "--cap-drop",
        "ALL",
        "--new-session",
        "--clearenv",
    ]
    assert command[-10:] == [
        "--proc",
        "/proc",
        "--chdir",
        "/",
        "--info-fd",
        "7",
        "--",
        "python",
        "-c",
        "pass",
    ]
    assert "--die-with-parent" not in command


def test_the_system_and_the_readable_folders_are_mounted_read_only() -> None:
    command = wrap_command("bwrap", ["python"], ["/opt/python", "/home/a"], 3)
    assert mounts(command) == ["/etc/ld.so.cache", "/home/a", "/lib", "/lib64", "/opt/python", "/usr"]
    assert not [word for word in command if word.startswith("--bind")]


def test_a_folder_is_mounted_once_and_before_what_it_contains() -> None:
    command = wrap_command("bwrap", [], ["/opt/a/b", "/opt/a/", "/opt/a", "/usr/"], 3)
    assert mounts(command) == ["/etc/ld.so.cache", "/lib", "/lib64", "/opt/a", "/opt/a/b", "/usr"]


def test_the_program_is_found_on_the_search_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    assert find_bubblewrap() is None
    program = tmp_path / "bwrap"
    program.touch(0o755)
    assert find_bubblewrap() == str(program)
