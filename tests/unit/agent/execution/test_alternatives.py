"""Alternatives run one after the other, after declared failures, and are not run again after a crash."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass
from functools import partial
from typing import Any

import pytest

from aeros.agent.execution.alternatives import run_alternatives
from aeros.agent.execution.progress import PlanProgress


@dataclass
class Ended:
    is_declared: bool
    name: str


DECLARED, BROKEN = Ended(True, "declared"), Ended(False, "broken")


def run(
    ends: list[Ended | None], progress: PlanProgress, is_cancelled: Callable[[], bool] = lambda: False
) -> tuple[Ended | None, list[int]]:
    started: list[int] = []

    def start(number: int) -> Generator[None, Any, Ended | None]:
        started.append(number)
        yield
        return ends[number]

    running = run_alternatives(
        [partial(start, number) for number in range(len(ends))], (3,), progress, is_cancelled
    )
    while True:
        try:
            next(running)
        except StopIteration as done:
            return done.value, started


@pytest.mark.parametrize(
    ("ends", "end", "started"),
    [
        ([None, None], None, [0]),
        ([DECLARED, None], None, [0, 1]),
        ([DECLARED, DECLARED], DECLARED, [0, 1]),
        ([BROKEN, None], BROKEN, [0]),
        ([DECLARED, BROKEN, None], BROKEN, [0, 1]),
    ],
)
def test_the_next_one_follows_a_declared_failure(
    ends: list[Ended | None], end: Ended | None, started: list[int]
) -> None:
    assert run(ends, PlanProgress()) == (end, started)
    assert run(ends, PlanProgress(), lambda: True)[1] == [0]


def test_those_that_failed_are_left_out_when_it_goes_on() -> None:
    progress = PlanProgress()
    run([DECLARED, DECLARED, BROKEN], progress)
    assert [progress.has_failed((3,), number) for number in range(3)] == [True, True, False]
    assert run([None, None, None], progress) == (None, [2])
    progress.mark_failed((3,), 2)
    assert run([None, None, None], progress) == (None, [2])  # the last one decides
