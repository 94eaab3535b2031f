"""Commands that `aeros top` gives, and what it says of them."""

from __future__ import annotations

import threading
from contextlib import closing
from pathlib import Path

import pytest

from aeros.cli.top import operator_call
from aeros.cli.top.operator_call import OperatorCall
from aeros.runtime.execution.governor import OperatorCommand
from aeros.runtime.registry.control_page import MotionTimeoutError
from aeros.runtime.registry.registry import Registry


def messages_of(state: Path, command: OperatorCommand) -> list[str]:
    heard: list[str] = []
    with closing(OperatorCall(state, heard.append)) as calls:
        calls.give(command)
    return heard


def test_without_a_robot_nothing_is_given(tmp_path: Path) -> None:
    asked, end = messages_of(tmp_path / "none", OperatorCommand.STOP)
    assert asked == "stop: asked"
    assert end.startswith("not given: no robot runs from")
    assert not (tmp_path / "none").exists()


@pytest.mark.parametrize(
    ("failure", "words"),
    [
        (None, "stopped"),
        (MotionTimeoutError("after 10 s"), "still moving after 10 s; use the robot's emergency stop"),
        (OSError("the disk is full"), "not given: OSError: the disk is full"),
    ],
)
def test_it_says_if_the_command_has_taken_effect(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failure: Exception | None, words: str
) -> None:
    given: list[OperatorCommand] = []

    def request(folder: Path, command: OperatorCommand) -> None:
        given.append(command)
        if failure is not None:
            raise failure

    Registry(tmp_path).folder.mkdir(parents=True)
    monkeypatch.setattr(operator_call, "request_command", request)
    assert messages_of(tmp_path, OperatorCommand.STOP) == ["stop: asked", words]
    assert given == [OperatorCommand.STOP]


def test_a_pause_does_not_replace_a_stop_that_has_no_effect_yet(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given: list[OperatorCommand] = []
    stands = threading.Event()

    def request(folder: Path, command: OperatorCommand) -> None:
        given.append(command)
        assert stands.wait(60.0)

    Registry(tmp_path).folder.mkdir(parents=True)
    monkeypatch.setattr(operator_call, "request_command", request)
    calls = OperatorCall(tmp_path, lambda _: None)
    calls.give(OperatorCommand.STOP)
    calls.give(OperatorCommand.PAUSE)
    stands.set()
    calls.close()
    calls.give(OperatorCommand.PAUSE)
    calls.close()
    assert given == [OperatorCommand.STOP, OperatorCommand.PAUSE]
