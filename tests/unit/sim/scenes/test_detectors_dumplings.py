"""The bench with physics, before and without any motion of the robot."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi
from typing import Any

import pytest

from aeros.sim.bullet.client import bullet
from aeros.sim.bullet.world import Contact
from aeros.sim.detected_object import DetectedObject
from aeros.sim.geometry import Pose, to_world
from aeros.sim.layouts.dumpling_bench import ALIGNED_POSITION, DumplingTracker, WrapperDetection
from aeros.sim.physics import PhysicsPlant
from aeros.sim.scenes.physics_scene import PhysicsScene
from aeros.spec.model.scene import BodyPart
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.start_layouts import bench_layout

pytestmark = pytest.mark.physics

SEED = 3


@pytest.fixture(scope="module")
def plant() -> Iterator[PhysicsPlant]:
    """One for all tests: none of them moves anything."""
    made = PhysicsPlant(PhysicsScene(shipped_scene("dumpling_bench")), SEED)
    yield made
    made.close()


@pytest.fixture
def scene(plant: PhysicsPlant) -> PhysicsScene:
    assert isinstance(plant._scene, PhysicsScene)
    tracker_of(plant._scene, DumplingTracker())
    return plant._scene


def tracker_of(scene: PhysicsScene, new: DumplingTracker | None = None) -> DumplingTracker:
    """The tracker of the bench's detector, replaced by `new` if it is given."""
    detector: Any = scene._detectors[0]
    if new is not None:
        detector._tracker = new
    tracker: DumplingTracker = detector._tracker
    return tracker


def _mass(plant: PhysicsPlant, body: int) -> float:
    return float(bullet.getDynamicsInfo(body, -1, physicsClientId=plant._world.client)[0])


def test_wrapper_and_filling_lie_where_they_were_drawn(plant: PhysicsPlant, scene: PhysicsScene) -> None:
    laid = bench_layout(SEED)
    for name, pose in (("wrapper", laid.wrapper), ("filling", laid.filling)):
        assert plant._world.pose(scene.body(name)).position == pytest.approx(pose.position, abs=0.003)
    with pytest.raises(KeyError, match="shelf"):
        scene.body("shelf")
    measured = scene.measure()
    assert measured["press_handle_position"] == pytest.approx((0.425, 0.0, 0.094), abs=0.003)
    assert measured["press_force"] == 0.0
    assert scene.joint_position(BodyPart("wrapper", "fold")) == pytest.approx(0.0, abs=0.05)
    assert not scene.state.sealed["dough"]
    assert _mass(plant, scene.body("filling")) == 0.05


def test_the_overhead_camera_sees_all_that_a_fault_lets_through(scene: PhysicsScene) -> None:
    laid = bench_layout(SEED)
    seen = scene.detect("overhead")
    assert seen["filling_position"] == pytest.approx(laid.filling.position, abs=0.01)
    hinge = to_world(scene.pose_of(BodyPart("wrapper")), (-0.022, 0.0, 0.0))
    assert seen["wrapper_position"] == pytest.approx(hinge, abs=0.01)
    blind = scene.detect("overhead", lambda found: None)
    assert (blind["filling_position"], blind["wrapper_position"]) == (None, None)

    def raised(found: DetectedObject | None) -> DetectedObject | None:
        assert found is not None
        x, y, z = found.position
        return found._replace(position=(x, y, z + 1.0))

    high = scene.detect("overhead", raised)
    assert high["wrapper_position"][2] == pytest.approx(seen["wrapper_position"][2] + 1.0)
    assert high["filling_position"][2] == pytest.approx(seen["filling_position"][2] + 1.0)


def _contact(force: float) -> Contact:
    return Contact(0, -1, 0, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), force)


@pytest.mark.parametrize(
    ("forces", "fold", "off", "seals"),
    [
        ((0.6, 0.6), pi, 0.0, True),
        ((0.4, 0.6), pi, 0.0, False),
        ((5.0,), 2.7, 0.0, False),
        ((5.0,), pi, 0.1, False),
    ],
)
def test_a_wrapper_is_sealed_if_it_is_folded_over_its_filling_and_pressed(
    plant: PhysicsPlant,
    scene: PhysicsScene,
    monkeypatch: pytest.MonkeyPatch,
    forces: tuple[float, ...],
    fold: float,
    off: float,
    seals: bool,
) -> None:
    world, wrapper, filling = plant._world, scene.body("wrapper"), scene.body("filling")
    stiffened: list[tuple[int, int, float]] = []
    x, y, z = ALIGNED_POSITION
    poses = {
        wrapper: Pose((x, y, z), (0.0, 0.0, 0.0, 1.0)),
        filling: Pose((x + off, y, z + 0.0115), (0.0, 0.0, 0.0, 1.0)),
    }

    def contacts(body: int, other: int, link: int) -> list[Contact]:
        assert (body, other, link) == (wrapper, filling, 0)
        return [_contact(force) for force in forces]

    with monkeypatch.context() as patched:
        patched.setitem(scene.state.sealed, "dough", False)
        patched.setattr(world, "contacts", contacts)
        patched.setattr(world, "pose", lambda body, link=-1: poses.get(body, poses[wrapper]))
        patched.setattr(world, "joint_position", lambda body, joint: fold)
        patched.setattr(world.bodies, "set_joint_friction", lambda *given: stiffened.append(given))
        scene.tick()
        scene.tick()
        assert scene.measure()["press_force"] == pytest.approx(sum(forces))
    assert stiffened == ([(wrapper, 0, 0.5)] if seals else [])


def test_a_side_view_without_a_wrapper_takes_no_picture(
    plant: PhysicsPlant, scene: PhysicsScene, monkeypatch: pytest.MonkeyPatch
) -> None:
    def unused(*_: object) -> None:
        raise AssertionError("a picture was taken")

    monkeypatch.setattr(plant._world.renderer, "render", unused)
    tracker_of(scene).wrapper = None
    assert scene.detect("side") == {"dumpling_wrapped": False}
    tracker_of(scene).wrapper = WrapperDetection(ALIGNED_POSITION, 0.0, pi)
    assert scene.detect("side", lambda found: None) == {"dumpling_wrapped": False}


@pytest.mark.parametrize(("is_visible", "is_pressed"), [(True, True), (True, False), (False, True)])
def test_a_side_view_finds_a_dumpling_that_was_pressed_and_shows_its_filling(
    scene: PhysicsScene, monkeypatch: pytest.MonkeyPatch, is_visible: bool, is_pressed: bool
) -> None:
    closed = WrapperDetection(ALIGNED_POSITION, 0.0, pi)
    looked_at: list[WrapperDetection] = []

    def visible(_: object, __: object, wrapper: WrapperDetection) -> bool:
        looked_at.append(wrapper)
        return is_visible

    monkeypatch.setattr("aeros.sim.scenes.detectors.is_filling_visible", visible)
    tracker_of(scene).wrapper = closed
    tracker_of(scene).add_press_force(2.0 if is_pressed else 0.0)
    assert scene.detect("side") == {"dumpling_wrapped": is_visible and is_pressed}
    assert looked_at == [closed]
