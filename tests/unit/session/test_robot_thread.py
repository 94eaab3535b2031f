from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial

import pytest

from aeros.session.robot_thread import RobotThread


class RobotError(Exception):
    """Of these tests."""


@contextmanager
def robot(seen: list[str]) -> Iterator[str]:
    seen.append(f"opened in {threading.current_thread().name}")
    try:
        yield "arm"
    finally:
        seen.append(f"closed in {threading.current_thread().name}")


@contextmanager
def failing(*, opening: bool) -> Iterator[str]:
    if opening:
        raise RobotError("no power")
    yield "arm"
    raise RobotError("no brake")


def _describe_use(number: int, part: str) -> str:
    return f"{part} {number} {threading.current_thread().name}"


def test_it_is_opened_used_and_closed_in_one_thread_in_order() -> None:
    seen: list[str] = []
    thread = RobotThread(lambda: robot(seen))
    found = [thread.call(partial(_describe_use, number)) for number in range(3)]
    thread.close()
    thread.close()
    assert [one.result() for one in found] == [f"arm {n} aeros-robot" for n in range(3)]
    assert seen == ["opened in aeros-robot", "closed in aeros-robot"]


def test_an_exception_of_a_call_is_in_its_future_and_the_next_call_is_made() -> None:
    thread = RobotThread(lambda: robot([]))

    def fail(_: str) -> None:
        raise RobotError("stuck")

    first, second = thread.call(fail), thread.call(len)
    thread.close()
    with pytest.raises(RobotError, match="stuck"):
        first.result()
    assert second.result() == 3


def test_an_exception_while_opening_is_raised_to_the_caller() -> None:
    with pytest.raises(RobotError, match="no power"):
        RobotThread(lambda: failing(opening=True))


def test_an_exception_of_close_is_raised_once() -> None:
    thread = RobotThread(lambda: failing(opening=False))
    with pytest.raises(RobotError, match="no brake"):
        thread.close()
    thread.close()
