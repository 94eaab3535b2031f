"""Held objects count as part of the robot: the reference site, on the physics plant."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from aeros.runtime.gate.decision import Decision, DecisionKind
from aeros.runtime.motion.trajectory import MotionDecider
from aeros.runtime.ports import Trajectory
from aeros.sim.geometry import yaw_of
from aeros.sim.physics import PhysicsPlant, make_plant
from aeros.sim.scenes.physics_scene import PhysicsScene
from aeros.skill import Action, act
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.scene import BodyPart
from aeros.spec.text.discovery import reference_site_path
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.acting import allow, execute

pytestmark = pytest.mark.physics

FOREVER = 1e9


@pytest.fixture(scope="module")
def holding() -> Iterator[PhysicsPlant]:
    """The robot at the table, with the sponge in its hand 0.2 m above."""
    plant = make_plant(shipped_scene("table"), 0)
    assert isinstance(plant._scene, PhysicsScene)
    pose = plant._scene.pose_of(BodyPart("sponge"))
    (x, y, z), yaw = pose.position, yaw_of(pose.orientation)
    for action in (
        act("move_tool", target=(x, y, 0.2), yaw=yaw, speed=0.3),
        act("move_tool", target=(x, y, z + 0.032), yaw=yaw, speed=0.1),
        act("grip", width=0.0, force=10.0),
        act("move_tool", target=(x, y, 0.2), yaw=yaw, speed=0.3),
    ):
        assert execute(plant, action, allow, FOREVER).completed
    yield plant
    plant.close()


def _denial(plant: PhysicsPlant, action: Action) -> list[tuple[str, str]]:
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    allowed = Decision(DecisionKind.ALLOW, action, ())
    found = MotionDecider(site.motion).decide(allowed, plant.plan(action), plant.observe())
    return [(reason.code, reason.rule) for reason in found.reasons]


def test_an_object_is_kept_off_the_bench_that_the_fingers_alone_may_come_near_to(
    holding: PhysicsPlant,
) -> None:
    assert holding.observe()["holding"].value is True
    low = act("move_tool", target=(0.5, -1.2, 0.005), yaw=0.0, speed=0.3)
    assert _denial(holding, low) == [("AE763", "links-off-the-bench")]  # slowly it may be set down there
    x, y, _ = holding.observe()["tool_position"].value
    for target, speed, found in (
        ((x, y, 0.05), 0.15, []),
        ((x, y, 0.05), 0.3, [("AE763", "links-off-the-bench")]),  # too fast near the bench
        ((x, y, 0.09), 0.3, []),
        ((x + 0.1, y, 0.09), 0.3, []),
    ):
        placing = act("move_tool", target=target, yaw=0.0, speed=speed)
        assert _denial(holding, placing) == found
    joints = holding.plan(act("move_tool", target=(x, y, 0.05), yaw=0.0, speed=0.15))
    assert isinstance(joints, Trajectory)
    ends = {f"q{number}": q for number, q in enumerate(joints.joint_paths[0][-1][3], 1)}
    # `move_joints` names no surface, so nothing held may come near one.
    assert _denial(holding, act("move_joints", **ends, speed=0.1)) == [("AE763", "links-off-the-bench")]
    empty = make_plant(shipped_scene("table"), 0)
    assert _denial(empty, low) == []
    empty.close()


def test_the_hit_that_is_denied_would_have_happened(holding: PhysicsPlant) -> None:
    forces: list[float] = []

    def watch(_: float, values: object) -> None:
        forces.append(values["contact_force"])  # type: ignore[index]

    low = act("move_tool", target=(0.5, -1.2, 0.005), yaw=0.0, speed=0.3)
    execute(holding, low, watch, FOREVER)
    assert max(forces) > 50.0
