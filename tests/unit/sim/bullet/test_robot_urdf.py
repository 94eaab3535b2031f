"""A robot that PyBullet ships, and one that is made of hulls and masses, are the same chain."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from aeros.sim.bullet import robot_urdf
from aeros.sim.bullet.body_factory import load_model
from aeros.sim.bullet.client import bullet
from aeros.sim.bullet.robot import BulletRobot
from aeros.sim.bullet.robot_urdf import load_robot_body
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.robot.model import RobotModel
from aeros.sim.robot.robot import RobotOptions
from tests.described import described, xml_lines
from tests.reports_in_full import compare_with_section
from tests.unit.sim.robot.panda import PANDA, ZEROS, with_zeros

MADE = replace(PANDA, stock_urdf=None)

pytestmark = pytest.mark.physics


@pytest.mark.parametrize("model", [PANDA, MADE], ids=["stock", "made"])
@pytest.mark.parametrize("carriage", [False, True])
def test_every_link_of_the_hulls_is_there(model: RobotModel, carriage: bool) -> None:
    world = PhysicsWorld()
    loaded = load_robot_body(RobotOptions(model, carriage=carriage), world.client)
    assert loaded.links.keys() == {hull.link for hull in model.body.hulls}
    assert len(loaded.arm) == 7
    assert len(loaded.carriage) == (2 if carriage else 0)
    world.close()


def tool_of(model: RobotModel) -> tuple[float, ...]:
    world = PhysicsWorld()
    robot = BulletRobot(world, RobotOptions(model))
    for _ in range(60):
        world.step()
    state = robot.read_sensors()
    world.close()
    return (*state.tool_position, *state.q)


def test_the_made_robot_holds_itself_where_the_stock_one_does() -> None:
    assert tool_of(MADE) == pytest.approx(tool_of(PANDA), abs=1e-3)


def test_the_made_robot_weighs_what_its_file_says() -> None:
    world = PhysicsWorld()
    loaded = load_robot_body(RobotOptions(MADE), world.client)
    masses = [
        bullet.getDynamicsInfo(loaded.number, joint, physicsClientId=world.client)[0] for joint in loaded.arm
    ]
    assert masses == pytest.approx([link.mass for link in PANDA.dynamics.links])
    world.close()


def test_a_robot_whose_joints_count_from_elsewhere_holds_itself_at_the_same_place() -> None:
    x, y, z, *q = tool_of(with_zeros(PANDA))
    turned = [one + zero for one, zero in zip(q, ZEROS, strict=True)]
    assert (x, y, z, *turned) == pytest.approx(tool_of(MADE), abs=1e-4)


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("made", RobotOptions(MADE)),
        ("made, on a carriage", RobotOptions(MADE, carriage=True, base=(1.0, 2.0, 3.0))),
        ("stock, on a carriage", RobotOptions(PANDA, carriage=True)),
    ],
)
def test_the_urdf_that_pybullet_reads(
    name: str, options: RobotOptions, monkeypatch: pytest.MonkeyPatch
) -> None:
    read: list[str] = []

    def load_and_keep(path: str, *given: Any, **named: Any) -> int:
        text = Path(path).read_text("utf-8").replace(str(Path(path).parent), "FOLDER")
        read.append(re.sub(r'"[^"]*/(meshes|franka_panda)/', r'"\1/', text))
        read.append(f"{given} {named['fixed']} {named['collides_with_itself']}")
        for mesh in sorted(Path(path).parent.rglob("*.obj")):
            corners = [line for line in mesh.read_text("utf-8").splitlines() if line.startswith("v ")]
            read.append(f"{mesh.name}: {len(corners)} corners, {corners[0]} to {corners[-1]}")
        return load_model(path, *given, **named)

    monkeypatch.setattr(robot_urdf, "load_model", load_and_keep)
    world = PhysicsWorld()
    loaded = load_robot_body(options, world.client)
    world.close()
    text = "\n".join(line for one in read for line in xml_lines(one))
    expected = Path(__file__).with_name("robot_urdf.txt")
    compare_with_section(expected, name, f"{text}\n{described(loaded)}\n")
