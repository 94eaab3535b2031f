"""Any scene file becomes a world: bodies, instruments, seals, timers and truth, and overlaps are refused."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi
from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from aeros.sim.bullet import robot_urdf
from aeros.sim.bullet.client import bullet
from aeros.sim.physics import PhysicsPlant, make_plant
from aeros.sim.scenes.physics_scene import PhysicsScene
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.model.scene import BodyPart
from aeros.spec.scenes.load import add_scene, load_scene, shipped_scenes
from tests.shipped_scenes import ECMS, shipped_scene
from tests.unit.sim.bullet.bullet_parts import as_bullet

pytestmark = pytest.mark.physics

MODEL = """<robot name="chest"><link name="a">
<inertial><mass value="0.8"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
<collision><geometry><box size="0.2 0.2 0.1"/></geometry></collision></link>
<link name="lid"><inertial><mass value="0.1"/><inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0"
 izz="0.001"/></inertial><collision><origin xyz="0 0 0.3"/><geometry><box size="0.1 0.1 0.01"/></geometry>
</collision></link>
<joint name="hinge" type="revolute"><parent link="a"/><child link="lid"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="9" velocity="9"/></joint></robot>
"""

ROOM = """schema: aeros/scene/2
description: A chest on a floor, and a ball on a plate.
robot: {mount: bench}
view: {eye: [2 m, 0 m, 1 m], target: [0 m, 0 m, 0 m]}
places: {corner: {at: [1 m, 1 m, 0 m]}}
bodies:
  floor: {box: [6 m, 6 m, 10 cm], at: [0 m, 0 m, -5 cm]}
  chest: {urdf: chest.urdf, at: [1 m, 0 m, 5 cm], joints: {hinge: {friction: 1 mN*m}}}
  ball: {sphere: 5 cm, at: [0 m, 1 m, 51 mm], mass: 200 g, rolling_resistance: 1 mm}
cameras: {roof: {eye: [0 m, 0 m, 2 m], target: [1 m, 0 m, 0 m], at_start: true}}
instruments:
  weight: {load: floor}
  touch: {force: [ball, floor]}
  lid_load: {load: chest.lid}
  lid_position: {position: chest.lid}
  angle: {joint: chest.hinge}
regions: {yard: {of: corner, low: [-2 m, -1 m, 0 m], high: [0 m, 1 m, 1 m]}}
conditions: {heavy: touch > 1 N}
seals: {lock: {joint: chest.hinge, friction: 5 N*m, when: angle > 30 deg and heavy}}
timers: {rest: {while: heavy and ball.position in yard}}
truth:
  settled: rest.longest >= 0.1 s
  locked: lock and not ball.held and robot.base.x < 1 m and ball.tilt < 3 rad and chest.yaw < 1 rad
"""


@pytest.fixture
def plant(tmp_path: Path) -> Iterator[PhysicsPlant]:
    (tmp_path / "chest.urdf").write_text(MODEL)
    (tmp_path / "room.yaml").write_text(ROOM)
    made = make_plant(load_scene(str(tmp_path / "room.yaml")), 0)
    yield made
    made.close()


def scene_of(plant: PhysicsPlant) -> PhysicsScene:
    assert isinstance(plant._scene, PhysicsScene)
    return plant._scene


def test_instruments_measure_the_bodies_that_they_name(plant: PhysicsPlant) -> None:
    scene = scene_of(plant)
    assert scene.cameras == scene.initial_cameras == ("roof",)
    assert set(plant.pictures()) == {"roof"}
    with pytest.raises(KeyError, match="mast"):
        scene.camera("mast")
    with pytest.raises(KeyError, match="shelf"):
        scene.body("shelf")
    measured = {name: reading.value for name, reading in plant.observe().items()}
    assert measured["corner"] == (1.0, 1.0, 0.0)
    assert measured["weight"] == pytest.approx(0.2 * 9.81, rel=0.01)
    assert measured["lid_load"] == 0.0
    assert "touch" not in measured  # no sensor can tell which body presses on another
    assert scene.state.value("touch") == pytest.approx(measured["weight"])
    assert measured["lid_position"] == pytest.approx((1.0, 0.0, 0.05), abs=1e-3)
    assert measured["angle"] == pytest.approx(0.0, abs=1e-3)
    assert scene.pushable_objects == ("ball",)
    assert scene.pose_of(BodyPart("chest", "a")) == scene.pose_of(BodyPart("chest"))


def test_a_joint_is_sealed_and_a_time_is_measured_while_conditions_hold(plant: PhysicsPlant) -> None:
    scene, world = scene_of(plant), as_bullet(plant._world)
    chest = scene.body("chest")
    assert plant.truth() == {"settled": False, "locked": False}
    for _ in range(24):
        world.step()
        scene.tick()
    assert plant.truth() == {"settled": True, "locked": False}
    bullet.resetJointState(chest, 0, pi / 4, physicsClientId=world.client)
    world.step()
    scene.tick()
    assert plant.truth()["locked"]
    for _ in range(240):
        world.step()
        scene.tick()
    assert scene.joint_position(BodyPart("chest", "hinge")) == pytest.approx(pi / 4, abs=0.02)
    bullet.resetBasePositionAndOrientation(
        scene.body("ball"), (0.0, 1.0, 1.0), (0.0, 0.0, 0.0, 1.0), physicsClientId=world.client
    )
    world.step()
    scene.tick()
    assert (scene.state.value("rest"), scene.state.value("rest.longest") > 1.0) == (0.0, True)
    assert scene.state.sealed["lock"], "a seal does not open again"


def test_a_scene_without_a_robot_is_refused() -> None:
    with pytest.raises(UserError, match="has no `robot`"):
        make_plant(load_scene("shelf_behind"), 0)


def write(folder: Path, bodies: str) -> str:
    path = folder / "scene.yaml"
    path.write_text(f"schema: aeros/scene/2\ndescription: Things.\nbodies:\n{bodies}")
    return str(path)


def test_bodies_that_overlap_are_refused_before_anything_is_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bodies = (
        "  box: {box: [10 cm, 10 cm, 10 cm], at: [0 m, 2 m, 5 cm]}\n"
        "  bottle: {cylinder: [5 cm, 20 cm], at: [9 cm, 2 m, 10 cm], mass: 1 kg}\n"
        "  pole: {box: [5 cm, 5 cm, 1 m], at: [0 m, 0 m, 50 cm]}\n"
    )
    words = ["run", "fetch the object", "--ecms", str(ECMS), "--no-film", "--state", str(tmp_path / "state"),
             "--out", str(tmp_path / "out"), "--scene", write(tmp_path, bodies)]  # fmt: skip
    assert main(words) == Exit.REJECTED
    shown = capsys.readouterr().err
    assert "error[AE140] overlapping-bodies: `box` and `bottle` overlap by 10.0 mm" in shown
    assert "`pole` and the robot overlap by" in shown
    assert f"{tmp_path}/scene.yaml:4:42" in shown
    assert not (tmp_path / "out").exists()


def test_a_model_that_the_simulator_cannot_load_is_refused(tmp_path: Path) -> None:
    (tmp_path / "chest.urdf").write_text(MODEL.replace('<child link="lid"/>', '<child link="nobody"/>'))
    scene = write(tmp_path, "  it: {urdf: chest.urdf, at: [1 m, 1 m, 1 m]}\n")
    with pytest.raises(UserError) as error:
        make_plant(add_scene(shipped_scene("bare"), scene), 0)
    assert [found.code for found in error.value.diagnostics] == ["AE141"]


def test_every_shipped_addition_stands_in_the_room() -> None:
    for name in shipped_scenes():
        if load_scene(name).robot is None:
            make_plant(add_scene(shipped_scene("fetch"), name), 1).close()


def test_a_robot_whose_own_model_is_missing_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(robot_urdf, "DATA", str(tmp_path))
    with pytest.raises(UserError) as error:
        make_plant(shipped_scene("bare"), 0)
    (found,) = error.value.diagnostics
    assert found.code == "AE002"
    assert "cannot be read: no such file" in found.headline


@pytest.mark.parametrize("plant_name", ["kinematic", "symbolic"])
def test_nothing_is_in_the_way_without_physics(
    plant_name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["run", "fetch the object", "--ecms", str(ECMS), "--plant", plant_name, "--scene", "shelf_behind",
             "--state", str(tmp_path / "state"), "--out", str(tmp_path / "out")]  # fmt: skip
    assert main(words) == Exit.REJECTED
    assert "`--scene` needs the physics plant" in capsys.readouterr().err


def test_an_empty_table_is_under_the_robot_with_nothing_on_it() -> None:
    plant = make_plant(shipped_scene("bare"), 0)
    client = as_bullet(plant._world).client
    (hit,) = bullet.rayTest((0.9, 0.5, 1.0), (0.9, 0.5, -1.0), physicsClientId=client)
    assert hit[3][2] == pytest.approx(0.0, abs=1e-6)
    assert bullet.getNumBodies(physicsClientId=client) == 2
    assert (scene_of(plant).measure(), plant.truth()) == ({}, {})
    plant.close()
