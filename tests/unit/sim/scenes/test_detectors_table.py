"""The table with physics, before and without any motion of the robot."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from aeros.sim.bullet.client import bullet
from aeros.sim.detected_object import DetectedObject
from aeros.sim.physics import PhysicsPlant
from aeros.sim.scenes.physics_scene import PhysicsScene
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.start_layouts import table_layout

pytestmark = pytest.mark.physics

SEED = 3


@pytest.fixture
def plant() -> Iterator[PhysicsPlant]:
    made = PhysicsPlant(PhysicsScene(shipped_scene("table")), SEED)
    yield made
    made.close()


@pytest.fixture
def scene(plant: PhysicsPlant) -> PhysicsScene:
    assert isinstance(plant._scene, PhysicsScene)
    return plant._scene


def test_everything_lies_where_it_was_drawn(plant: PhysicsPlant, scene: PhysicsScene) -> None:
    laid = table_layout(SEED)
    for name, pose in (("sponge", laid.sponge), ("cube", laid.cube), ("can", laid.can)):
        assert plant._world.pose(scene.body(name)).position == pytest.approx(pose.position, abs=0.003)
    for name in ("cube", "can"):
        dynamics = bullet.getDynamicsInfo(scene.body(name), -1, physicsClientId=plant._world.client)
        assert dynamics[0] == 0.08
    assert len({scene.body(name) for name in scene.pushable_objects}) == 3
    with pytest.raises(KeyError, match="shelf"):
        scene.body("shelf")
    measured = scene.measure()
    assert (measured["sponge_rest_position"], measured["wiped_fraction"]) == (laid.rest, 0.0)


def test_the_overhead_camera_sees_all_that_a_fault_lets_through(scene: PhysicsScene) -> None:
    laid = table_layout(SEED)
    seen = scene.detect("overhead")
    assert seen["sponge_position"] == pytest.approx(laid.rest, abs=0.01)
    assert (seen["clutter_on_table"], seen["table_organized"]) == (True, False)
    blind = scene.detect("overhead", lambda found: None)
    assert (blind["sponge_seen"], blind["clutter_on_table"]) == (False, False)

    def moved(found: DetectedObject | None) -> DetectedObject | None:
        return None if found is None else found._replace(position=(0.45, -0.5, 0.02))

    in_bin = scene.detect("overhead", moved)
    assert (in_bin["clutter_on_table"], in_bin["sponge_position"]) == (False, (0.45, -0.5, 0.02))


def test_the_mast_verifies_a_clean_table_with_its_sponge_and_nothing_else(
    plant: PhysicsPlant, scene: PhysicsScene
) -> None:
    assert scene.detect("mast") == {"table_verified": False}
    scene._coatings["dirt"].wiped[:] = True
    scene._paint("dirt")
    assert scene.detect("mast") == {"table_verified": False}, "clutter is seen"
    for name in ("cube", "can"):
        bullet.removeBody(scene.body(name), physicsClientId=plant._world.client)
    assert scene.detect("mast") == {"table_verified": True}
    assert scene.detect("mast", lambda found: None) == {"table_verified": False}

    def away(found: DetectedObject | None) -> DetectedObject | None:
        assert found is not None
        x, y, z = found.position
        return found._replace(position=(x, y - 0.05, z))

    assert scene.detect("mast", away) == {"table_verified": False}
    scene._coatings["dirt"].wiped[:6] = False
    scene._paint("dirt")
    assert scene.detect("mast") == {"table_verified": False}


@pytest.mark.parametrize(("force", "wipes"), [(3.0, True), (0.0, False)])
def test_a_sponge_wipes_if_it_presses_with_more_than_1_n(
    plant: PhysicsPlant,
    scene: PhysicsScene,
    monkeypatch: pytest.MonkeyPatch,
    force: float,
    wipes: bool,
) -> None:
    world, sponge = plant._world, scene.body("sponge")
    upright = (0.0, 0.0, 0.0, 1.0)
    bullet.resetBasePositionAndOrientation(sponge, (0.5, 0.0, 0.0155), upright, physicsClientId=world.client)
    weight = world.contact_force(sponge, scene.body("table"))
    for _ in range(48):
        world.push(sponge, (0.0, 0.0, -force))
        world.step()
    assert world.contact_force(sponge, scene.body("table")) > weight - 1.0
    before = scene.measure()["wiped_fraction"]
    painted: list[float] = []
    with monkeypatch.context() as patched:
        patched.setattr(scene, "_paint", lambda name: painted.append(scene.wiped_share(name)))
        scene.tick()
        scene.tick()
    after = scene.measure()["wiped_fraction"]
    assert before == 0.0
    assert painted == ([after] if wipes else [])
    assert (after > 0.05) is wipes
