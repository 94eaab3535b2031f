"""A robot of four joints with a gripper of two fingers: its file, its fingers and its motions."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import closing
from math import inf
from pathlib import Path

import numpy as np
import pytest

from aeros.runtime.ports import Hull
from aeros.sim.engine.engine import Engine
from aeros.sim.kinematic.plant import make_plant
from aeros.sim.robot.body import Capsule
from aeros.sim.robot.gripper import finger_corners, finger_outside
from aeros.sim.robot.robot_file import read_robot
from aeros.skill import act
from aeros.spec.diagnostics.errors import UserError
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.acting import allow, execute

SCARA = Path(__file__).parent / "scara"
TEXT = (SCARA / "scara.yaml").read_text(encoding="utf-8")


def test_the_corners_are_those_of_both_fingers_closed_and_open() -> None:
    hand = read_robot(str(SCARA / "scara.yaml")).hand
    assert hand.gripper is not None
    boxes = [*finger_corners(hand, hand.gripper)]
    assert [len(box) for box in boxes] == 2 * 2 * [2 * 8]
    corners = np.concatenate(boxes)
    # Open by 110 mm, a finger of 35 mm reaches 90 mm to each side; its end is 175 mm beyond the flange.
    assert corners.max(axis=0) == pytest.approx([0.015, 0.09, 0.195])
    assert corners.min(axis=0) == pytest.approx([-0.015, -0.09, 0.12])


def test_a_hull_that_a_finger_leaves_is_found() -> None:
    robot = read_robot(str(SCARA / "scara.yaml"))
    hulls = robot.body.hulls
    assert finger_outside(robot.hand, robot.capsules, hulls) is None
    shorter = tuple(
        Hull(one.link, one.joint, tuple((x, y, min(z, 0.19)) for x, y, z in one.corners), 0.0)
        for one in hulls
    )
    found = finger_outside(robot.hand, robot.capsules, shorter)
    assert found is not None
    assert found == ("hull", found[1])
    assert found[1] == pytest.approx(0.005, abs=1e-6)
    thinner = tuple(one._replace(radius=one.radius - 0.01) for one in robot.capsules)
    found = finger_outside(robot.hand, thinner, hulls)
    assert found is not None
    assert found[0] == "capsule"
    assert 0.005 < found[1] < 0.01


def test_enclosures_that_have_some_of_the_corners_each_do_not_hold_a_finger() -> None:
    robot = read_robot(str(SCARA / "scara.yaml"))
    assert robot.hand.gripper is not None
    corners = np.concatenate([*finger_corners(robot.hand, robot.hand.gripper)]).tolist()
    (whole,) = (one for one in robot.capsules if one.link == "fingers")
    balls = tuple(Capsule("fingers", whole.joint, (*corner,), (*corner,), 1e-3) for corner in corners)
    found = finger_outside(robot.hand, balls, robot.body.hulls)
    assert found is not None
    assert found[0] == "capsule"
    assert finger_outside(robot.hand, (*balls, whole), robot.body.hulls) is None


@pytest.mark.parametrize(
    ("old", "new", "cause"),
    [
        ("model: two_fingers", "model: franka_hand", "simulators have their own shapes of the `franka_hand`"),
        ("  finger:", "  # finger:", "lacks `palm` or `finger`"),
        ("at: [0.0, 0.006, 0.145]", "at: [0.0, 0.004, 0.145]", "reaches 0.002 m beyond y = 0"),
        ("edges: [0.022, 0.012, 0.06]", "edges: [0.022, 0, 0.06]", "an edge that is not above 0 m"),
        ("mass: 0.06", "mass: 0", "`0` is not above 0"),
        ("widest_gap: 110 mm", "widest_gap: 130 mm", "of `fingers` does not hold the fingers: a corner is"),
        ("hulls: scara_hulls.json", "hulls: scara_hulls.json\nurdf: {path: a, base: b, joints: [a, b, c, d]}",
         "the URDF of PyBullet has the Franka Hand"),
    ],
)  # fmt: skip
def test_a_fault_of_a_hand_has_its_cause_and_its_cure(old: str, new: str, cause: str, tmp_path: Path) -> None:
    assert old in TEXT
    text = TEXT.replace(old, new, 1)
    if new == "  # finger:":
        start = text.index(new)
        text = text[:start] + text[text.index("postures:", start) :]
    (tmp_path / "arm.yaml").write_text(text, encoding="utf-8")
    hulls = (SCARA / "scara_hulls.json").read_text(encoding="utf-8")
    (tmp_path / "scara_hulls.json").write_text(hulls, encoding="utf-8")
    with pytest.raises(UserError) as error:
        read_robot(str(tmp_path / "arm.yaml"))
    (found, *_) = error.value.diagnostics
    assert cause in found.headline
    assert found.help
    assert found.primary is not None


def test_an_arm_of_four_joints_moves_presses_and_grips() -> None:
    robot = read_robot(str(SCARA / "scara.yaml"))
    with closing(make_plant(shipped_scene("bare"), 0, robot=robot)) as plant:
        for action in (
            act("move_tool", target=(0.5, 0.2, 0.15), yaw=0.5, speed=0.25),
            act("move_tool", target=(0.5, 0.1, 0.013), yaw=0.0, speed=0.25),
            act("slide", target=(0.55, 0.15, 0.0), force=6.0, speed=0.1),
            act("grip", width=0.05, force=10.0),
        ):
            assert execute(plant, action, allow, inf).completed, action
        found = plant.observe()
        assert found["tool_position"].value[:2] == pytest.approx((0.55, 0.15), abs=1e-4)
        assert found["finger_gap"].value == pytest.approx(0.05)
        planned = plant.plan(act("move_tool", target=(0.5, 0.1, 0.6), yaw=0.0, speed=0.25))
        assert "unreachable" in str(planned)


@pytest.mark.physics
@pytest.mark.parametrize("name", ["bullet", "mujoco"])
def test_the_fingers_close_on_a_thing_of_its_width_in_both_engines(name: str) -> None:
    from aeros.sim import physics

    engines: dict[str, Callable[[], Engine]] = {
        "bullet": physics.make_bullet_engine,
        "mujoco": physics.make_mujoco_engine,
    }
    robot = read_robot(str(SCARA / "scara.yaml"))
    with closing(physics.make_plant(shipped_scene("bare"), 0, robot=robot, engine=engines[name]())) as plant:
        for width in (0.03, 0.1):
            assert execute(plant, act("grip", width=width, force=10.0), allow, 10.0).completed
            assert plant.observe()["finger_gap"].value == pytest.approx(width, abs=2e-3)


def test_the_hulls_of_the_file_are_those_of_its_urdf_files() -> None:
    hulls = json.loads((SCARA / "scara_hulls.json").read_text(encoding="utf-8"))["hulls"]
    (palm,) = (one for one in hulls if one["link"] == "hand")
    spans = np.ptp(np.array(palm["corners"]), axis=0)
    # The palm of gripper.urdf is 150 mm wide along x, the way of its fingers, which is y of a hand.
    assert spans == pytest.approx([0.07, 0.15, 0.1], abs=1e-3)
