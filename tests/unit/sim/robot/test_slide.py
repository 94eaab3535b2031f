"""A slide is planned for every height of the surface, or refused before anything moves."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from aeros.runtime.ports import MotionCompletion, Trajectory
from aeros.sim.kinematic.plant import KinematicPlant, make_plant
from aeros.skill import act
from tests.described import described
from tests.reports_in_full import compare_with_file
from tests.shipped_scenes import shipped_scene


@pytest.fixture
def plant() -> KinematicPlant:
    return make_plant(shipped_scene("bare"), 0)


def test_the_plan_has_a_path_down_and_one_along_at_each_height(plant: KinematicPlant) -> None:
    start = plant.observe()["tool_position"].value
    height = start[2] - 0.048
    planned = plant.plan(act("slide", target=(start[0], start[1] + 0.2, height), force=5.0, speed=0.1))
    assert isinstance(planned, Trajectory)
    # One at every 5 mm from 20 mm below the target to just above the start, which is 68 mm higher.
    assert len(planned.joint_paths) == 1 + 15
    assert planned.servo is not None
    assert planned.servo.joint_tolerance == (0.01,) * 7
    # At the peak it is 1.875 times as fast as in the mean, and approaches the surface at 6 mm/s at most.
    assert 0.05 < planned.servo.tool_speed <= 0.1
    assert planned.duration == pytest.approx(1.875 * 0.2 / 0.1, rel=0.02)


@pytest.mark.parametrize(
    ("parameters", "reason"),
    [
        ({"force": 0.1, "speed": 0.1}, "out of range: `force` is outside [0.5, 60]"),
        ({"force": 5.0, "speed": 1.0}, "out of range: `speed` is outside [0.001, 0.5]"),
        ({"force": 5.0, "speed": 0.1, "yaw": 0.0}, "unknown parameter: `yaw`"),
        ({"force": 5.0}, "missing parameter: `speed`"),
    ],
)
def test_wrong_parameters_are_refused(
    plant: KinematicPlant, parameters: dict[str, float], reason: str
) -> None:
    target = (0.5, 0.2, 0.05)
    assert plant.plan(act("slide", target=target, **parameters)) == MotionCompletion(False, reason)


def test_a_slide_out_of_reach_is_refused(plant: KinematicPlant) -> None:
    planned = plant.plan(act("slide", target=(2.0, 0.0, 0.05), force=5.0, speed=0.1))
    assert isinstance(planned, MotionCompletion)
    assert str(planned.reason).startswith("unreachable: ")


def test_the_plan_in_numbers(plant: KinematicPlant) -> None:
    x, y, z = plant.observe()["tool_position"].value
    shown = []
    for way, speed in (((0.1, 0.2), 0.1), ((0.0, 0.02), 0.004)):
        planned = plant.plan(act("slide", target=(x + way[0], y + way[1], z - 0.03), force=5.0, speed=speed))
        assert isinstance(planned, Trajectory)
        ends = [
            (len(path), *(np.asarray(path)[at, at].round(5) for at in (0, -1)))
            for path in planned.joint_paths
        ]
        numbers = {"base": planned.base, "base path": planned.base_path, "duration": planned.duration}
        shown += [described(one) for one in (*ends, numbers, planned.servo)]
    compare_with_file(Path(__file__).with_name("slide.txt"), "\n".join(shown) + "\n")
