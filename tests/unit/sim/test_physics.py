from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from aeros.runtime.ports import CameraView, MotionCompletion
from aeros.sim.clock import TICK
from aeros.sim.engine.engine import Engine
from aeros.sim.engine.robot import PhysicalRobot
from aeros.sim.fixed_step_plant import CAMERA_TICKS
from aeros.sim.layouts.cameras import fixed_camera
from aeros.sim.physics import PhysicsPlant, make_plant
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.robot import RobotOptions
from aeros.sim.scenes.physics_scene import PhysicsScene
from aeros.skill import Action, act
from aeros.spec.model.scene import BodyPart
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.acting import allow, execute, recording
from tests.unit.sim.bare_scene import BareScene
from tests.unit.sim.bullet.bullet_parts import as_bullet
from tests.unit.sim.referee import Referee
from tests.unit.sim.robot.panda import PANDA, Q_MAX, Q_MIN, QD_MAX, QDD_MAX, TAU_MAX

pytestmark = pytest.mark.physics

SCENE = "bare"
"""Of the fixture `plant`."""

FOREVER = 1e9


class CubeOnBlock(BareScene):
    """A 4 cm cube of 100 g on a block, for a fixed robot or for one on a carriage."""

    def __init__(self, *, carriage: bool = False) -> None:
        if carriage:
            self.robot = RobotOptions(PANDA, carriage=True, base=(0.0, 0.0, 0.3))

    def build(self, engine: Engine, robot: PhysicalRobot, chance: RandomSource) -> None:
        world = as_bullet(engine.world)
        world.bodies.add_box((0.10, 0.03, 0.05), (0.5, 0.1, 0.025))
        world.bodies.add_box((0.04, 0.04, 0.04), (0.5, 0.1, 0.07), mass=0.1)


def move(x: float, y: float, z: float, yaw: float = 0.0, speed: float = 0.25) -> Action:
    return act("move_tool", target=(x, y, z), yaw=yaw, speed=speed)


def test_the_arm_arrives_within_half_a_millimetre_inside_every_limit(plant: PhysicsPlant) -> None:
    log: list[Mapping[str, Any]] = []
    for action in (move(0.5, 0.2, 0.1), move(0.4, -0.3, 0.3, yaw=1.0), move(0.55, 0.1, 0.02, speed=1.0)):
        assert execute(plant, action, recording(log), FOREVER).completed
        assert math.dist(log[-1]["tool_position"], action.parameters["target"]) < 5e-4
    q = np.array([values["joint_position"] for values in log])
    assert (q > Q_MIN).all()
    assert (q < Q_MAX).all()
    assert (np.abs([values["joint_velocity"] for values in log]) < QD_MAX).all()
    assert (np.abs([values["joint_torque"] for values in log]) <= TAU_MAX).all()


def test_the_monitor_sees_every_tick(plant: PhysicsPlant) -> None:
    log: list[Mapping[str, Any]] = []
    execute(plant, act("wait", duration=0.5), recording(log), FOREVER)
    assert len(log) == 1 + 120


def test_a_named_rule_stops_the_arm_within_that_tick_and_inside_the_limits(plant: PhysicsPlant) -> None:
    robot = plant._robot
    sent: list[tuple[Any, Any]] = []
    command = robot.command

    def spy(q: Any, qd: Any) -> None:
        sent.append((q, qd))
        command(q, qd)

    robot.command = spy  # type: ignore[method-assign]
    seen = 0

    def trip(now: float, values: Mapping[str, Any]) -> str | None:
        nonlocal seen
        seen += 1
        return "too_close" if seen == 200 else None

    ended = execute(plant, move(0.5, -0.4, 0.2, speed=0.5), trip, FOREVER)
    assert ended.reason == "monitor:too_close"
    # 199 ticks of motion; from then on every set point is slower than the one before.
    rates = np.array([qd for _, qd in sent])
    assert (np.linalg.norm(np.diff(rates[:150], axis=0), axis=1) > 0).any()
    falling = np.linalg.norm(rates[198:], axis=1)
    assert (np.diff(falling) <= 1e-12).all()
    assert falling[1] < falling[0]
    assert falling[-1] == 0.0
    places = np.array([q for q, _ in sent])
    assert (np.abs(np.diff(places, n=2, axis=0)) / TICK**2 <= 1.01 * QDD_MAX).all()
    assert max(map(abs, plant.observe()["joint_velocity"].value)) < 0.02


def test_a_rule_that_is_violated_at_rest_prevents_motion(plant: PhysicsPlant) -> None:
    before = plant.observe()["tool_position"].value
    ended = execute(plant, move(0.5, 0.2, 0.1), lambda now, values: "no_entry", FOREVER)
    assert ended.reason == "monitor:no_entry"
    assert math.dist(plant.observe()["tool_position"].value, before) < 1e-4


def test_motion_ends_at_the_deadline(plant: PhysicsPlant) -> None:
    ended = execute(plant, move(0.5, 0.3, 0.1), allow, plant.now() + 0.5)
    assert ended.reason == "deadline"
    assert plant.now() < 0.9


@pytest.mark.parametrize(
    ("action", "reason"),
    [
        (move(0.9, 0.4, 0.3), "unreachable"),
        (move(math.nan, 0.0, 0.3), "bad parameter"),
        (move(0.5, 0.0, 0.3, speed=math.inf), "out of range"),
        (act("wait", duration=10**400), "out of range"),
        (act("move_tool", target=[0.5, 0.0, 0.3], yaw=0.0, speed=0.2), "bad parameter"),
        (move(0.5, 0.0, 0.3, speed=-1.0), "out of range"),
        (act("move_tool", target=(0.5, 0.0, 0.3), yaw=0.0), "missing parameter: `speed`"),
        (act("wait", duration=1.0, haste=True), "unknown parameter: `haste`"),
        (act("grip", width=True, force=10.0), "bad parameter"),
        (act("grip", width=0.02, force=500.0), "out of range"),
        (act("look", camera="mast"), "unknown camera"),
        (act("move_base", x=1.0, y=0.0, speed=0.2), "unknown kind"),
        (act("dance"), "unknown kind"),
    ],
)
def test_impossible_actions_are_refused_before_motion(
    plant: PhysicsPlant, action: Action, reason: str
) -> None:
    ended = execute(plant, action, allow, FOREVER)
    assert not ended.completed
    assert ended.reason is not None
    assert ended.reason.startswith(reason)
    assert plant.now() == 0.0


def test_a_cube_is_carried_by_friction_and_falls_when_released() -> None:
    plant = PhysicsPlant(CubeOnBlock(), 0)
    for action in (
        move(0.5, 0.1, 0.15),
        move(0.5, 0.1, 0.07),
        act("grip", width=0.03, force=10.0),
        move(0.5, -0.1, 0.25),
        act("wait", duration=2.0),
    ):
        assert execute(plant, action, allow, FOREVER).completed
    readings = plant.observe()
    assert readings["holding"].value
    assert 9.0 < readings["grip_force"].value < 11.0
    assert 0.038 < readings["finger_gap"].value < 0.043
    execute(plant, act("grip", width=0.08, force=10.0), allow, FOREVER)
    assert not plant.observe()["holding"].value
    plant.close()


def test_a_slide_holds_the_asked_force(plant: PhysicsPlant) -> None:
    for action in (act("grip", width=0.0, force=10.0), move(0.5, 0.0, 0.013, speed=0.1)):
        assert execute(plant, action, allow, FOREVER).completed
    forces: list[float] = []

    def press(now: float, values: Mapping[str, Any]) -> str | None:
        forces.append(sum(as_bullet(plant._world).forces_by_link(plant._simulated.body).values()))
        return None

    assert execute(
        plant, act("slide", target=(0.5, 0.1, 0.0), force=6.0, speed=0.1), press, FOREVER
    ).completed
    touched = next(tick for tick, force in enumerate(forces) if force > 0.0)
    assert max(forces) < 15.0
    assert max(abs(force - 6.0) for force in forces[touched + 72 :]) < 1.0


def test_a_slide_over_nothing_ends_blocked(plant: PhysicsPlant) -> None:
    execute(plant, move(0.5, 0.0, 0.30), allow, FOREVER)
    ended = execute(plant, act("slide", target=(0.5, 0.1, 0.30), force=6.0, speed=0.1), allow, FOREVER)
    assert ended.reason is not None
    assert ended.reason.startswith("no contact")


def test_an_obstacle_ends_a_move_and_the_arm_stops_pushing(plant: PhysicsPlant) -> None:
    execute(plant, move(0.5, 0.0, 0.05), allow, FOREVER)
    ended = execute(plant, move(0.5, 0.0, -0.05), allow, FOREVER)
    assert ended.reason is not None
    assert ended.reason.startswith("blocked")
    assert execute(plant, move(0.5, 0.0, 0.2), allow, FOREVER).completed


def test_the_carriage_drives_to_its_target() -> None:
    plant = PhysicsPlant(CubeOnBlock(carriage=True), 0)
    assert execute(plant, act("move_base", x=-0.6, y=0.3, speed=0.4), allow, FOREVER).completed
    assert math.dist(plant.observe()["base_position"].value, (-0.6, 0.3, 0.3)) < 0.002
    assert execute(plant, move(-0.1, 0.3, 0.5), allow, FOREVER).completed
    plant.close()


def test_the_same_seed_repeats_bit_for_bit_and_another_does_not() -> None:
    def digest(seed: int) -> str:
        plant = make_plant(shipped_scene("dumpling_bench"), seed)
        values = hashlib.sha256()
        assert isinstance(plant._scene, PhysicsScene)
        x, y, _ = plant._scene.pose_of(BodyPart("wrapper")).position
        for action in (move(x, y, 0.2), move(x, y, 0.063), act("grip", width=0.046, force=5.0)):
            execute(plant, action, allow, FOREVER)
            readings = {name: reading.value for name, reading in plant.observe().items()}
            values.update(repr(sorted(readings.items())).encode())
        plant.close()
        return values.hexdigest()

    assert digest(7) == digest(7)
    assert digest(7) != digest(8)


def test_time_passes_while_no_motion_is_under_way(plant: PhysicsPlant) -> None:
    assert plant.advance(allow, 0.5) == {}
    assert 0.5 - TICK < plant.now() <= 0.5


@pytest.mark.parametrize("end", ["halt", "stop"])
def test_a_halt_between_two_calls_makes_nothing_faster(end: str) -> None:
    referee = Referee()
    plant = PhysicsPlant(CubeOnBlock(carriage=True), 0, referee=referee)
    motion = plant.begin(act("move_base", x=1.2, y=0.2, speed=0.4))
    assert isinstance(motion, int)
    assert plant.advance(allow, 1.5) == {}
    if end == "halt":
        plant.halt(motion)
        assert not plant.advance(allow, FOREVER)[motion].completed
    else:
        plant.stop()
    plant.close()
    speeds = referee.base_speeds()
    assert speeds[358] > 0.2
    assert speeds[359:].max() < 1.02 * speeds[358]
    assert speeds[-1] < 0.01


def test_a_look_takes_the_picture_of_its_camera_and_publishes_it_after_read_out() -> None:
    scene = shipped_scene("dumpling_bench")
    plant, side_camera = make_plant(scene, 0), fixed_camera(scene.cameras["side"])
    first = plant.pictures()
    assert {name: one.time for name, one in first.items()} == {"overhead": 0.0}
    execute(plant, act("wait", duration=0.5), allow, FOREVER)
    look = plant.begin(act("look", camera="side"))
    assert not isinstance(look, MotionCompletion)
    plant.advance(allow, plant.now() + CAMERA_TICKS * TICK - TICK)
    assert plant.pictures() == first
    plant.advance(allow, FOREVER)
    taken = plant.pictures()
    assert taken["overhead"] is first["overhead"]
    side = taken["side"]
    assert side.time == 0.5
    # Nothing has moved by more than a micrometre, so that the camera sees the same now.
    seen = plant._world.renderer.render(side_camera)
    assert side.rgb == seen.rgb.tobytes()
    assert side.depth is not None
    assert np.frombuffer(side.depth, np.float32) == pytest.approx(seen.depth.ravel(), abs=1e-4)
    assert (side.width, side.height) == (side_camera.width, side_camera.height)
    assert side.view == CameraView(
        side_camera.eye, side_camera.target, side_camera.up, side_camera.field_of_view
    )
    plant.close()
