"""Motions of the checks begin where the checks say, or the plant is closed."""

from __future__ import annotations

from typing import Any, cast

import pytest

from aeros.runtime.ports import MotionCompletion, Plant
from aeros.skill import Action
from aeros.wired_arm.check_motions import move_joints, open_at

REFUSED = MotionCompletion(False, "reflex")


class StandingArm:
    """A plant that answers a motion with `began`, and ends it with `ended`."""

    def __init__(self, began: Any, ended: MotionCompletion | None) -> None:
        self.began, self.ended = began, ended
        self.asked: list[Action] = []
        self.is_closed = False

    def now(self) -> float:
        return 0.0

    def begin(self, action: Action) -> Any:
        self.asked.append(action)
        return self.began

    def advance(self, monitor: Any, until: float) -> dict[int, MotionCompletion]:
        assert monitor(0.0, {}) is None
        return {} if self.ended is None else {self.began: self.ended}

    def close(self) -> None:
        self.is_closed = True


def test_the_arm_goes_to_the_start() -> None:
    plant = StandingArm(3, MotionCompletion(True))
    opened: object = open_at(lambda: cast("Plant", plant), (0.5, -0.5))
    assert opened is plant
    assert plant.asked == [move_joints((0.5, -0.5))]
    assert plant.asked[0].parameters == {"q1": 0.5, "q2": -0.5, "speed": 0.15}
    assert not plant.is_closed


@pytest.mark.parametrize(
    ("began", "words"), [(REFUSED, "cannot go to the start"), (3, "did not get to the start")]
)
def test_an_arm_that_does_not_get_there_is_closed(began: Any, words: str) -> None:
    plant = StandingArm(began, REFUSED)
    with pytest.raises(RuntimeError, match=f"{words} of the checks: reflex"):
        open_at(lambda: cast("Plant", plant), (0.5,))
    assert plant.is_closed


def test_an_arm_that_moves_for_too_long_is_closed() -> None:
    plant = StandingArm(3, None)
    with pytest.raises(
        RuntimeError, match=r"did not get to the start of the checks: it still moves after 60 s"
    ):
        open_at(lambda: cast("Plant", plant), (0.5,))
    assert plant.is_closed
