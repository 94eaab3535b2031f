"""Pictures show bodies, people and the robot where they are."""

from __future__ import annotations

import pytest

from aeros.sim.engine.world import PERSON_COLOUR
from aeros.sim.geometry import Camera
from aeros.sim.mujoco.engine import MujocoEngine
from aeros.sim.mujoco.pictures import person_solids
from aeros.sim.mujoco.plans import ShapePlan
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.odometry import WheelOdometry
from aeros.sim.robot.robot import RobotOptions
from tests.unit.sim.robot.panda import PANDA

pytestmark = pytest.mark.physics

SIDE = Camera((3.0, 0.0, 0.5), (0.0, 0.0, 0.5), width=64, height=48)


def middle(engine: MujocoEngine) -> float:
    """The depth in the middle of a picture, m; 5 where nothing is."""
    return float(engine.world.renderer.render(SIDE).depth[24, 32])


def test_a_body_that_falls_leaves_the_picture() -> None:
    engine = MujocoEngine()
    engine.add_box((0.2, 0.2, 0.2), (0.0, 0.0, 0.5), mass=1.0, colour=(1.0, 0.0, 0.0, 1.0))
    assert middle(engine) == pytest.approx(2.9, abs=0.01)
    for _ in range(60):
        engine.world.step()
    assert middle(engine) == pytest.approx(5.0)


@pytest.mark.parametrize("carriage", [False, True])
def test_the_robot_is_seen_with_its_carriage(carriage: bool) -> None:
    engine = MujocoEngine()
    engine.add_robot(RobotOptions(PANDA, carriage=carriage), WheelOdometry(RandomSource(0)))
    seen = engine.world.renderer.render(Camera((3.0, 0.0, -0.1), (0.0, 0.0, -0.1), width=64, height=48))
    assert float(seen.depth[24, 32]) == pytest.approx(2.75 if carriage else 5.0, abs=0.01)
    assert middle(engine) < 3.2


def test_a_person_is_a_capsule() -> None:
    engine = MujocoEngine()
    engine.add_person(1.8, 0.25).move((0.0, 0.0, 0.9))
    assert middle(engine) == pytest.approx(2.75, abs=0.01)
    solids = person_solids(ShapePlan("capsule", (0.25, 1.3, 0.0)))
    assert [one.colour for one in solids] == [PERSON_COLOUR[:3]] * 3
    assert [one.place.position[2] for one in solids] == [0.0, -0.65, 0.65]
