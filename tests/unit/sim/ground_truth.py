"""Ground truth of a task: bodies and joints in the simulator, which no acting code sees.

It is computed here without the scene's own conditions, which tests compare with it.
"""

from __future__ import annotations

from itertools import product
from math import dist, radians

from aeros.sim.geometry import Vector3, to_frame
from aeros.sim.physics import PhysicsPlant
from aeros.sim.scenes.physics_scene import PhysicsScene
from aeros.spec.model.scene import BodyPart


def is_done(plant: PhysicsPlant) -> bool:
    """Return True if the task of the plant's scene is done."""
    scene = plant._scene
    assert isinstance(scene, PhysicsScene)
    return {"dumpling_bench": _is_cooking, "table": _is_clean, "fetch": _is_fetched}[scene.scene.name](scene)


_PAIRS = tuple(product(("wrapper", "wrapper_2"), ("filling", "filling_2")))


def _is_folded(scene: PhysicsScene, wrapper: str, filling: str) -> bool:
    x, y, z = to_frame(scene.pose_of(BodyPart(wrapper)), _place(scene, filling))
    fold = scene.joint_position(BodyPart(wrapper, "fold"))
    return fold > radians(160) and abs(x) < 0.021 and abs(y) < 0.028 and abs(z - 0.0115) < 0.006


def _is_cooking(scene: PhysicsScene) -> bool:
    folded = [pair for pair in _PAIRS if _is_folded(scene, *pair)]
    return any(all(_is_in_pot(*_place(scene, name)) for name in pair) for pair in folded)


def _is_in_pot(x: float, y: float, z: float) -> bool:
    return abs(x - 0.55) < 0.08 and abs(y - 0.33) < 0.085 and 0.005 < z < 0.055


def _is_clean(scene: PhysicsScene) -> bool:
    places = [_place(scene, name) for name in ("cube", "can")]
    in_bin = [abs(x - 0.45) < 0.09 and abs(y + 1.7) < 0.08 and 0.005 < z < 0.085 for x, y, z in places]
    rest = scene._poses["sponge_rest_position"].position
    return (
        scene.coating_of("dirt").wiped_share >= 0.95
        and all(in_bin)
        and dist(_place(scene, "sponge"), rest) < 0.03
    )


def _is_fetched(scene: PhysicsScene) -> bool:
    can, delivery = _place(scene, "can"), scene._poses["delivery_position"].position
    return dist(can[:2], delivery[:2]) < 0.03 and abs(can[2] - delivery[2]) < 0.04


def _place(scene: PhysicsScene, body: str) -> Vector3:
    return scene.pose_of(BodyPart(body)).position
