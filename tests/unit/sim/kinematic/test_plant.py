"""The kinematic plant: geometry alone decides."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Mapping
from math import dist, inf
from typing import Any

import numpy as np
import pytest

from aeros.runtime.ports import MotionCompletion, Plant, Trajectory
from aeros.sim.clock import TICK
from aeros.sim.geometry import Pose, yaw_orientation
from aeros.sim.kinematic.objects import GraspableObject, ObjectSet, slab
from aeros.sim.kinematic.plant import KinematicPlant, make_plant
from aeros.sim.kinematic.scenes.declared_scene import DeclaredScene
from aeros.sim.randomness import RandomSource
from aeros.skill import Action, act
from tests.shipped_scenes import SHIPPED, shipped_scene
from tests.unit.sim.acting import allow, execute, recording


class CubeOnBlock(DeclaredScene):
    """A 4 cm cube on a block, and a wider plate on the cube."""

    def __init__(self) -> None:
        super().__init__(shipped_scene("bare"))

    def build(self, chance: RandomSource) -> ObjectSet:
        super().build(chance)
        half = 0.02
        top = slab(0.0, 0.0, half, 0.04, 0.04)
        self.cube = GraspableObject(
            Pose((0.5, 0.1, 0.08), yaw_orientation(0.0)), (-half,) * 3, (half,) * 3, half, top_surface=top
        )
        self.lid = GraspableObject(
            Pose((0.5, 0.1, 0.2), yaw_orientation(0.0)), (-0.1, -0.1, -0.005), (0.1, 0.1, 0.005), 0.005
        )
        return ObjectSet(
            (self.cube, self.lid), (slab(0.4, 0.0, 0.0, 1.4, 1.6), slab(0.5, 0.1, 0.05, 0.1, 0.03))
        )

    def measure(self) -> Mapping[str, Any]:
        return {"cube": self.cube.pose.position, "lid": self.lid.pose.position}


def observed(plant: Plant) -> dict[str, Any]:
    return {name: reading.value for name, reading in plant.observe().items()}


def move(x: float, y: float, z: float, yaw: float = 0.0, speed: float = 0.25) -> Action:
    return act("move_tool", target=(x, y, z), yaw=yaw, speed=speed)


def test_a_gripped_object_moves_with_the_tool_and_a_released_one_falls_and_stays() -> None:
    plant = KinematicPlant(CubeOnBlock(), 0)
    assert observed(plant)["cube"] == pytest.approx((0.5, 0.1, 0.07))
    assert observed(plant)["lid"] == pytest.approx((0.5, 0.1, 0.095))
    for action in (move(0.5, 0.1, 0.15), move(0.5, 0.1, 0.07), act("grip", width=0.03, force=8.0)):
        assert execute(plant, action, allow, inf).completed
    held = observed(plant)
    assert held["holding"]
    assert held["finger_gap"] == pytest.approx(0.04)
    assert held["grip_force"] == 8.0
    assert execute(plant, move(0.4, -0.2, 0.3, yaw=1.0), allow, inf).completed
    carried = observed(plant)
    assert carried["cube"] == pytest.approx(carried["tool_position"], abs=1e-6)
    assert carried["lid"][2] - carried["cube"][2] == pytest.approx(0.025)
    assert execute(plant, act("grip", width=0.08, force=8.0), allow, inf).completed
    fallen = observed(plant)
    assert not fallen["holding"]
    assert fallen["cube"] == pytest.approx((0.4, -0.2, 0.02), abs=1e-4)
    assert fallen["lid"][2] == pytest.approx(0.045)
    assert execute(plant, move(0.5, 0.2, 0.3), allow, inf).completed
    assert observed(plant)["cube"] == fallen["cube"]


def test_fingers_that_close_next_to_an_object_hold_nothing() -> None:
    plant = KinematicPlant(CubeOnBlock(), 0)
    for action in (move(0.5, 0.2, 0.15), move(0.5, 0.16, 0.07), act("grip", width=0.03, force=8.0)):
        assert execute(plant, action, allow, inf).completed
    assert not observed(plant)["holding"]
    assert observed(plant)["finger_gap"] == pytest.approx(0.03)


def test_the_arm_is_on_the_decided_path_at_every_tick() -> None:
    plant = make_plant(shipped_scene("bare"), 0)
    action = move(0.5, 0.2, 0.1, yaw=0.5)
    plan = plant.plan(action)
    assert isinstance(plan, Trajectory)
    log: list[Mapping[str, Any]] = []
    assert execute(plant, action, recording(log), inf, plan).completed
    q = np.array([values["joint_position"] for values in log])
    knots = np.array([piece[0] for piece in plan.joint_paths[0]] + [plan.joint_paths[0][-1][3]])
    away = np.abs(q[:, None, :] - knots[None, :, :]).max(axis=2)
    # Each knot of the path is passed, the last to the last digit; what is between is on the path by
    # the conformance suite.
    assert away.min(axis=0).max() < 0.01
    assert q[-1] == pytest.approx(knots[-1], abs=1e-12)


def test_a_hand_driven_into_the_table_is_blocked_and_can_rise_again() -> None:
    plant = make_plant(shipped_scene("bare"), 0)
    assert execute(plant, move(0.5, 0.0, 0.05), allow, inf).completed
    ended = execute(plant, move(0.5, 0.0, -0.05), allow, inf)
    assert str(ended.reason).startswith("blocked: the hand presses down with 1")
    assert execute(plant, move(0.5, 0.0, 0.2), allow, inf).completed


def test_a_slide_holds_the_asked_force_and_the_torques_are_those_that_hold_it() -> None:
    plant = make_plant(shipped_scene("bare"), 0)
    for action in (act("grip", width=0.0, force=10.0), move(0.5, 0.0, 0.013, speed=0.1)):
        assert execute(plant, action, allow, inf).completed
    loads: list[float] = []
    torques: list[float] = []

    def monitor(now: float, values: Mapping[str, Any]) -> str | None:
        loads.append(plant._robot.wrist_vertical_force())
        torques.append(max(map(abs, values["joint_torque"])))
        return None

    slide = act("slide", target=(0.5, 0.1, 0.0), force=6.0, speed=0.1)
    assert execute(plant, slide, monitor, inf).completed
    assert loads[-1] == pytest.approx(6.0, abs=0.5)
    assert max(loads) < 9.0
    # The shoulder's lever to the tool is 0.5 m at most.
    assert 2.0 < torques[-1] < 0.6 * 6.0


def test_planning_a_look_sees_nothing() -> None:
    plant = make_plant(shipped_scene("fetch"), 0)
    before = observed(plant), plant.pictures()
    plant.plan(act("look", camera="hand"))
    assert (observed(plant), plant.pictures()) == before
    execute(plant, act("look", camera="hand"), allow, inf)
    assert plant.pictures().keys() == {"mast", "hand"}


def test_the_same_seed_repeats_and_another_does_not() -> None:
    def after(seed: int) -> dict[str, Any]:
        plant = make_plant(shipped_scene("table"), seed)
        assert execute(plant, move(0.5, -1.0, 0.3), allow, inf).completed
        return observed(plant)

    assert after(3) == after(3)
    assert after(3) != after(4)


def test_tool_speed_is_the_rate_at_which_the_tool_moves() -> None:
    plant = make_plant(shipped_scene("fetch"), 0)
    log: list[Mapping[str, Any]] = []
    for action in (move(0.5, 0.2, 0.6), act("move_base", x=0.3, y=-0.2, speed=0.4)):
        assert execute(plant, action, recording(log), inf).completed
    speeds = [values["tool_speed"] for values in log]
    places = [values["tool_position"] for values in log]
    for index in range(1, len(log) - 1):
        rate = dist(places[index + 1], places[index - 1]) / (2.0 * TICK)
        assert speeds[index] == pytest.approx(rate, abs=0.02)
    assert max(speeds) > 0.3


def test_it_needs_no_pybullet() -> None:
    code = (
        "import sys; sys.modules['pybullet'] = None\n"
        "from aeros.sim.kinematic.plant import make_plant\n"
        "from tests.shipped_scenes import SHIPPED, shipped_scene\n"
        "[make_plant(shipped_scene(name), 0).observe() for name in SHIPPED]"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.physics
def test_it_has_each_scene_of_the_physics_plant_laid_out_alike() -> None:
    from aeros.sim import physics

    for scene in SHIPPED:
        for seed in (0, 5):
            physical = physics.make_plant(shipped_scene(scene), seed)
            theirs, ours = observed(physical), observed(make_plant(shipped_scene(scene), seed))
            physical.close()
            assert set(ours) == set(theirs)
            for name in ours:
                # Things settle in physics, by 2 mm or a few hundredths of a radian; torques hold weight;
                # a picture shows headings to a few degrees.
                if name != "joint_torque":
                    slack = 0.1 if name.endswith("_yaw") else 0.03
                    assert ours[name] == pytest.approx(theirs[name], abs=slack), name


def test_a_target_out_of_reach_is_refused_with_a_reason_before_anything_moves() -> None:
    plant = make_plant(shipped_scene("bare"), 0)
    before = plant.observe()
    far = act("move_tool", target=(0.9, 0.4, 0.3), yaw=0.0, speed=0.2)
    refused = plant.plan(far)
    assert isinstance(refused, MotionCompletion)
    assert (refused.reason or "").startswith("unreachable: ")
    assert plant.begin(far) == refused
    assert plant.observe() == before


def test_a_hand_that_meets_the_forearm_stops_the_arm() -> None:
    plant = make_plant(shipped_scene("bare"), 0)
    fold = act("move_joints", q1=0.0, q2=-0.785, q3=0.0, q4=-2.356, q5=0.0, q6=0.05, q7=-0.8, speed=0.3)
    ended = execute(plant, fold, allow, 1e9)
    assert ended == MotionCompletion(False, "blocked: `hand` meets `link5`")
    assert max(map(abs, plant.observe()["joint_velocity"].value)) == 0.0
