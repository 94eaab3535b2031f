"""The page and the locks by which a change of the configuration reaches a running executor."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from threading import Timer

import pytest

from aeros.runtime.execution.governor import OperatorCommand
from aeros.runtime.registry import control_page
from aeros.runtime.registry.control_page import (
    CommandStandsError,
    ControlPage,
    MotionTimeoutError,
    request_command,
)


def test_a_new_page_is_of_generation_0_and_lets_actions_run(tmp_path: Path) -> None:
    with ControlPage(tmp_path / "robot" / "registry") as page:
        assert (page.generation, page.command) == (0, OperatorCommand.RUN)
    names = {path.name: path for path in (tmp_path / "robot" / "registry").iterdir()}
    assert sorted(names) == ["live", "motion-0.lock", "motion-1.lock"]
    assert names["live"].stat().st_size == 24
    for path in names.values():
        assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert stat.S_IMODE((tmp_path / "robot" / "registry").stat().st_mode) == 0o700


def test_a_page_that_was_deleted_stops_the_run_that_nobody_can_reach_any_more(tmp_path: Path) -> None:
    with ControlPage(tmp_path) as page:
        (tmp_path / "live").unlink()
        assert page.command is OperatorCommand.STOP


@pytest.mark.parametrize("generation", [1, 255, 256, 2**64 - 1])
def test_messages_of_one_process_are_read_by_the_others(tmp_path: Path, generation: int) -> None:
    with ControlPage(tmp_path) as one, ControlPage(tmp_path) as other:
        one.publish(generation)
        one.request_command(OperatorCommand.PAUSE)
        assert (other.generation, other.command) == (generation, OperatorCommand.PAUSE)
        other.request_command(OperatorCommand.RUN)
        assert (one.generation, one.command) == (generation, OperatorCommand.RUN)
    with ControlPage(tmp_path) as later:
        assert later.generation == generation


def test_a_peer_lifts_its_own_pause_and_nothing_else(tmp_path: Path) -> None:
    with ControlPage(tmp_path) as page:
        for first, is_of_peer, stands in (
            (OperatorCommand.PAUSE, True, False),
            (OperatorCommand.PAUSE, False, True),
            (OperatorCommand.STOP, True, True),
            (OperatorCommand.STOP, False, True),
        ):
            request_command(tmp_path, first, is_of_peer=is_of_peer)
            assert page.command is first
            if stands:
                with pytest.raises(CommandStandsError, match=f"a {first.name.lower()} stands"):
                    request_command(tmp_path, OperatorCommand.RUN, is_of_peer=True)
                assert page.command is first
                request_command(tmp_path, OperatorCommand.PAUSE, is_of_peer=True)
                assert page.command is first
                request_command(tmp_path, OperatorCommand.RUN)
            else:
                request_command(tmp_path, OperatorCommand.RUN, is_of_peer=True)
            assert page.command is OperatorCommand.RUN


def test_a_page_of_an_older_version_keeps_its_command(tmp_path: Path) -> None:
    (tmp_path / "live").write_bytes(bytes(8) + (2).to_bytes(8, "little"))
    with ControlPage(tmp_path) as page:
        assert page.command.name == "STOP"
        page.request_command(OperatorCommand.RUN)
        assert page.command.name == "RUN"


def test_an_unreadable_command_is_a_stop(tmp_path: Path) -> None:
    with ControlPage(tmp_path) as page:
        page.request_command(OperatorCommand.PAUSE)
        content = bytearray((tmp_path / "live").read_bytes())
        content[15] = 1
        with (tmp_path / "live").open("r+b") as file:
            file.write(content)
        assert page.command is OperatorCommand.STOP


def test_a_link_instead_of_a_page_is_not_followed(tmp_path: Path) -> None:
    (tmp_path / "elsewhere").write_bytes(b"")
    (tmp_path / "live").symlink_to("elsewhere")
    with pytest.raises(OSError, match="symbolic links"):
        ControlPage(tmp_path)
    assert (tmp_path / "elsewhere").read_bytes() == b""


def test_an_action_under_an_old_generation_is_answered_so(tmp_path: Path) -> None:
    with ControlPage(tmp_path) as page:
        page.publish(3)
        with page.hold_generation(3) as is_latest:
            assert is_latest
        with page.hold_generation(2) as is_latest:
            assert not is_latest


def test_an_action_keeps_its_own_generation_busy_and_not_the_next(tmp_path: Path) -> None:
    with ControlPage(tmp_path) as acting, ControlPage(tmp_path) as changing:
        assert changing.is_idle(4)
        with acting.hold_generation(4):
            assert not changing.is_idle(4)
            assert not acting.is_idle(4)
            assert changing.is_idle(5)
            assert not changing.is_idle(6)
        assert changing.is_idle(4)


def test_asking_does_not_keep_a_generation_busy(tmp_path: Path) -> None:
    with ControlPage(tmp_path) as page:
        before = len(os.listdir("/proc/self/fd"))
        assert page.is_idle(0)
        assert page.is_idle(0)
        assert len(os.listdir("/proc/self/fd")) == before


def test_an_action_that_raises_lets_its_generation_go(tmp_path: Path) -> None:
    with ControlPage(tmp_path) as page:
        with pytest.raises(ZeroDivisionError), page.hold_generation(0):
            raise ZeroDivisionError
        assert page.is_idle(0)


def test_a_change_waits_until_an_action_has_ended(tmp_path: Path) -> None:
    with ControlPage(tmp_path) as acting, ControlPage(tmp_path) as changing:
        changing.wait_until_idle(0, 0.0)
        holding = acting.hold_generation(0)
        holding.__enter__()
        with pytest.raises(MotionTimeoutError, match=r"after 0\.01 s"):
            changing.wait_until_idle(0, 0.01)
        ends = Timer(0.02, lambda: holding.__exit__(None, None, None))
        ends.start()
        changing.wait_until_idle(0, 60.0)
        assert changing.is_idle(0)
        ends.join()


@pytest.mark.parametrize("parity", [0, 1])
def test_a_stop_waits_for_actions_of_this_and_of_the_previous_generation(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, parity: int
) -> None:
    monkeypatch.setattr(control_page, "_WAIT_TIMEOUT_S", 0.0)
    with ControlPage(tmp_path) as page:
        page.publish(2)
        with page.hold_generation(2 - parity):
            with pytest.raises(MotionTimeoutError):
                request_command(tmp_path, OperatorCommand.STOP)
            commands = [page.command]
            request_command(tmp_path, OperatorCommand.RUN)
            commands.append(page.command)
        request_command(tmp_path, OperatorCommand.PAUSE)
        commands.append(page.command)
    assert commands == [OperatorCommand.STOP, OperatorCommand.RUN, OperatorCommand.PAUSE]


def test_a_page_is_closed_once_and_leaves_no_file_open(tmp_path: Path) -> None:
    before = len(os.listdir("/proc/self/fd"))
    page = ControlPage(tmp_path)
    page.close()
    page.close()
    assert len(os.listdir("/proc/self/fd")) == before
