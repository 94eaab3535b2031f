"""Any scene file becomes objects that can be held and surfaces that carry them."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.sim.geometry import Pose, yaw_orientation
from aeros.sim.kinematic.objects import ObjectSet
from aeros.sim.kinematic.plant import KinematicPlant
from aeros.sim.kinematic.scenes.declared_scene import DeclaredScene
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.robot import RobotState
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.model.scene import BodyPart
from aeros.spec.scenes.load import load_scene
from tests.shipped_scenes import shipped_scene

STRAIGHT = yaw_orientation(0.0)
SOMEWHERE = RobotState(
    (0.0,) * 7, (0.0,) * 7, (0.0,) * 7, (9.0,) * 3, 0.0, 0.08, 0.0, (1.0, 2.0, 0.3), (0.0,) * 3
)

ROOM = """schema: aeros/scene/2
description: Shapes of every kind.
robot: {mount: carriage, at: [0 m, 0 m, 30 cm]}
view: {eye: [2 m, 0 m, 1 m], target: [0 m, 0 m, 0 m]}
bodies:
  floor: {box: [6 m, 6 m, 10 cm], at: [0 m, 0 m, -5 cm]}
  drum: {cylinder: [10 cm, 40 cm], at: [1 m, 0 m, 20 cm]}
  tub: {basin: [20 cm, 10 cm, 8 cm], at: [0 m, 1 m, 10 cm], yaw: 90 deg}
  steps:
    compound:
    - {box: [20 cm, 20 cm, 10 cm], at: [0 m, 0 m, 0 m]}
    - {box: [10 cm, 20 cm, 10 cm], at: [5 cm, 0 m, 10 cm]}
    at: [-1 m, 0 m, 5 cm]
  ball: {sphere: 3 cm, at: [1 m, 0 m, 1 m], mass: 100 g}
  rod:
    compound:
    - {box: [2 cm, 10 cm, 2 cm], at: [0 m, 0 m, 0 m]}
    - {box: [4 cm, 4 cm, 2 cm], at: [0 m, 0 m, -2 cm]}
    at: [-95 cm, 0 m, 1 m]
    mass: 100 g
    grip: {low: [-1 cm, -5 cm, -1 cm], high: [1 cm, 5 cm, 1 cm]}
truth: {held: ball.held, near: robot.base.x > 0.5 m and robot.tool.x > 8 m}
"""


@pytest.fixture
def room(tmp_path: Path) -> tuple[DeclaredScene, ObjectSet]:
    (tmp_path / "room.yaml").write_text(ROOM)
    scene = DeclaredScene(load_scene(str(tmp_path / "room.yaml")))
    return scene, scene.build(RandomSource(0))


def height(scene: DeclaredScene, body: str) -> float:
    return scene.pose_of(BodyPart(body)).position[2]


def test_everything_falls_onto_what_is_under_it(room: tuple[DeclaredScene, ObjectSet]) -> None:
    scene, _ = room
    assert (scene.robot.carriage, scene.robot.base) == (True, (0.0, 0.0, 0.3))
    assert height(scene, "ball") == pytest.approx(0.4 + 0.03)
    # The rod's foot is 30 mm below its middle, and the upper step's top is at 0.2 m.
    assert height(scene, "rod") == pytest.approx(0.2 + 0.03)


@pytest.mark.parametrize(
    ("x", "y", "top"),
    [
        (1.05, 0.05, 0.4),
        (0.0, 1.0, 0.1),
        (0.04, 1.09, 0.1),
        (0.06, 1.0, 0.0),
        (-1.05, 0.0, 0.1),
        (2.0, 2.0, 0.0),
    ],
)
def test_shapes_carry_what_is_laid_on_them(
    x: float, y: float, top: float, room: tuple[DeclaredScene, ObjectSet]
) -> None:
    scene, things = room
    scene._objects["ball"].pose = Pose((x, y, 1.0), STRAIGHT)
    things.grip(scene._objects["ball"].pose)
    things.release()
    assert height(scene, "ball") == pytest.approx(top + 0.03)


def test_truth_is_of_the_latest_tick(room: tuple[DeclaredScene, ObjectSet]) -> None:
    scene, things = room
    assert scene.truth() == {"held": False, "near": False}
    ball = scene.pose_of(BodyPart("ball"))
    things.grip(ball)
    assert (scene.is_carried("ball"), scene.truth()["held"]) == (True, False)
    x, y, z = ball.position
    things.tick(Pose((x, y, z + 0.1), STRAIGHT), 0.06)
    scene.tick(SOMEWHERE)
    assert scene.truth() == {"held": True, "near": True}
    assert (scene.is_carried("drum"), scene.is_held("drum")) == (False, False)


def test_without_a_press_joints_are_at_0_and_nothing_presses(room: tuple[DeclaredScene, ObjectSet]) -> None:
    scene, _ = room
    assert scene.joint_position(BodyPart("drum", "hinge")) == 0.0
    assert scene.force_between(BodyPart("ball"), BodyPart("drum")) == 0.0


def test_an_empty_table_supports_the_hand_and_has_no_camera() -> None:
    scene = DeclaredScene(shipped_scene("bare"))
    things = scene.build(RandomSource(0))
    # The pads reach 9 mm below the tool: 1 mm into the table, at 10 kN/m.
    things.tick(Pose((0.5, 0.0, 0.008), STRAIGHT), 0.02)
    assert things.load == pytest.approx(10.0)
    things.tick(Pose((1.11, 0.0, 0.008), STRAIGHT), 0.0)
    assert things.load == 0.0
    assert dict(scene.measure()) == {}
    with pytest.raises(KeyError, match="mast"):
        scene.see("mast", SOMEWHERE, 0.0, 0.0)


def test_a_scene_without_a_robot_is_refused() -> None:
    with pytest.raises(UserError, match="has no `robot`"):
        DeclaredScene(load_scene("shelf_behind"))


def test_before_the_first_tick_truth_is_of_where_the_robot_begins(tmp_path: Path) -> None:
    raised = "robot.base.z < 0.4 m and robot.tool.z > 0.6 m"
    text = ROOM.replace("robot.base.x > 0.5 m and robot.tool.x > 8 m", raised)
    (tmp_path / "room.yaml").write_text(text)
    plant = KinematicPlant(DeclaredScene(load_scene(str(tmp_path / "room.yaml"))), 0)
    assert plant.truth() == {"held": False, "near": True}
