"""Several motions at the same time: each goes on as it would alone, and one that is halted comes to rest."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from math import inf
from typing import Any

import numpy as np
import pytest

from aeros.runtime.ports import Completion, Motion
from aeros.sim.physics import PhysicsPlant, make_plant
from aeros.sim.profile import TICK
from aeros.sim.robot import BASE_ACCELERATION_MAX
from aeros.skill import Action, act
from tests.unit.sim.acting import allow, recording

DRIVE = act("move_base", x=-0.4, y=0.3, speed=0.4)
OPEN = act("grip", width=0.02, force=10.0)

pytestmark = pytest.mark.physics


@pytest.fixture
def plant() -> Iterator[PhysicsPlant]:
    made = make_plant("fetch", 0)
    yield made
    made.close()


def begin(plant: PhysicsPlant, action: Action) -> Motion:
    motion = plant.begin(action)
    assert not isinstance(motion, Completion)
    return motion


def test_the_fingers_close_while_the_base_drives_and_both_arrive(plant: PhysicsPlant) -> None:
    drive, grip = begin(plant, DRIVE), begin(plant, OPEN)
    log: list[Mapping[str, Any]] = []
    assert plant.advance(recording(log), inf) == {grip: Completion(True)}
    assert log[-1]["finger_gap"] == pytest.approx(0.02, abs=1e-3)
    assert 0.0 < math.dist(log[-1]["base_position"], log[0]["base_position"]) < 0.5
    ticks = len(log)
    assert plant.advance(recording(log), inf) == {drive: Completion(True)}
    assert math.dist(log[-1]["base_position"][:2], (-0.4, 0.3)) < 1e-3
    # Each tick was one of both: the second `advance` looks once more before it goes on.
    assert plant.now() == pytest.approx((len(log) - 2) * TICK)
    assert ticks > 50


def test_a_drive_that_is_halted_comes_to_rest_within_limits_while_the_fingers_go_on(
    plant: PhysicsPlant,
) -> None:
    drive, grip = begin(plant, DRIVE), begin(plant, OPEN)
    log: list[Mapping[str, Any]] = []
    assert plant.advance(recording(log), 0.3) == {}
    assert plant.now() == pytest.approx(0.3)
    sent: list[Any] = []
    command = plant._robot.command_base

    def spy(xy: Any, speed: Any) -> None:
        sent.append(speed)
        command(xy, speed)

    plant._robot.command_base = spy  # type: ignore[method-assign]
    plant.halt(drive)
    first = plant.advance(recording(log), inf)
    second = plant.advance(recording(log), inf)
    assert {**first, **second} == {drive: Completion(False, "halted"), grip: Completion(True)}
    slower = np.linalg.norm(sent, axis=1)
    assert slower[-1] == 0.0
    assert (np.diff(slower) <= 1e-12).all()
    assert (np.abs(np.diff(sent, axis=0)) / TICK <= 1.01 * BASE_ACCELERATION_MAX).all()
    assert log[-1]["finger_gap"] == pytest.approx(0.02, abs=1e-3)


def test_what_a_halted_motion_does_not_move_is_not_touched(plant: PhysicsPlant) -> None:
    drive = begin(plant, DRIVE)
    wait = begin(plant, act("wait", duration=30.0))
    assert plant.advance(allow, 0.3) == {}
    plant.halt(wait)
    assert plant.advance(allow, inf) == {wait: Completion(False, "halted")}
    assert plant.advance(allow, inf) == {drive: Completion(True)}
    assert math.dist(plant.observe()["base_position"].value[:2], (-0.4, 0.3)) < 1e-3


def test_a_rule_that_breaks_ends_both_at_rest(plant: PhysicsPlant) -> None:
    drive, grip = begin(plant, DRIVE), begin(plant, OPEN)
    halted = Completion(False, "monitor:near")
    assert plant.advance(lambda now, _: "near" if now > 0.3 else None, inf) == {drive: halted, grip: halted}
    before = plant.observe()["base_position"].value
    wait = begin(plant, act("wait", duration=0.5))
    assert plant.advance(allow, inf) == {wait: Completion(True)}
    assert math.dist(plant.observe()["base_position"].value, before) < 1e-3


def test_what_is_blocked_ends_both(plant: PhysicsPlant) -> None:
    drive, look = begin(plant, DRIVE), begin(plant, act("wait", duration=30.0))
    assert plant.advance(allow, 0.3) == {}
    plant._robot.q_command = plant._robot.q_command + 0.1  # as if something held the arm back
    ended = plant.advance(allow, inf)
    assert set(ended) == {drive, look}
    assert {str(one.reason).partition(":")[0] for one in ended.values()} == {"blocked"}
