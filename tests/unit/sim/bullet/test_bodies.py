"""Declared bodies in a world, and overlaps of them that are refused with their places."""

from __future__ import annotations

from math import pi
from pathlib import Path
from typing import Any

import pytest

from aeros.sim.bullet.bodies import GREY, Box, Cylinder, SceneBody, UrdfModel, add_body, check_overlaps
from aeros.sim.bullet.client import bullet
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.geometry import Vector3, yaw_of
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.diagnostics.source import Source

pytestmark = pytest.mark.physics

SOURCE = Source("scene.yaml", "crate bottle\npole")
CUBE = Box((0.1, 0.1, 0.1))
MODEL = """<robot name="vase"><link name="a">
<inertial><mass value="0.8"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
<collision><geometry><cylinder radius="0.05" length="0.2"/></geometry></collision></link></robot>
"""


def body(
    name: str = "crate", shape: Any = CUBE, position: Vector3 = (0.0, 0.0, 0.05), **more: Any
) -> SceneBody:
    start = SOURCE.text.find(name)
    values = {"yaw": 0.0, "mass": 0.0, "friction": 0.5, "colour": GREY, **more}
    return SceneBody(name, shape, position, span=SOURCE.span(start, start + len(name)), **values)


def dynamics(world: PhysicsWorld, number: int) -> tuple[float, float]:
    """Mass and friction."""
    mass, friction = bullet.getDynamicsInfo(number, -1, physicsClientId=world.client)[:2]
    return mass, friction


@pytest.fixture
def world() -> Any:
    made = PhysicsWorld()
    yield made
    made.close()


@pytest.mark.parametrize(
    ("shape", "kind", "size"),
    [
        (Box((0.1, 0.2, 0.3)), bullet.GEOM_BOX, (0.1, 0.2, 0.3)),
        (Cylinder(0.05, 0.4), bullet.GEOM_CYLINDER, (0.4, 0.05)),
    ],
)
def test_a_body_is_as_declared(shape: Any, kind: int, size: tuple[float, ...], world: PhysicsWorld) -> None:
    declared = body(
        shape=shape,
        position=(1.0, 2.0, 3.0),
        yaw=pi / 3,
        mass=2.5,
        friction=0.25,
        colour=(0.1, 0.2, 0.3, 1.0),
    )
    number = add_body(world, declared)
    (visual,) = bullet.getVisualShapeData(number, physicsClientId=world.client)
    assert (visual[2], visual[7]) == (kind, pytest.approx((0.1, 0.2, 0.3, 1.0)))
    assert visual[3][: len(size)] == pytest.approx(size)
    assert dynamics(world, number) == (2.5, 0.25)
    pose = world.pose(number)
    assert pose.position == (1.0, 2.0, 3.0)
    assert yaw_of(pose.orientation) == pytest.approx(pi / 3)


@pytest.mark.parametrize(("mass", "falls"), [(0.0, False), (1.0, True)])
def test_a_model_is_fixed_or_has_its_own_mass(
    mass: float, falls: bool, tmp_path: Path, world: PhysicsWorld
) -> None:
    (tmp_path / "vase.urdf").write_text(MODEL)
    shape = UrdfModel(str(tmp_path / "vase.urdf"))
    number = add_body(world, body(shape=shape, position=(0.0, 0.0, 5.0), mass=mass, yaw=0.5))
    assert dynamics(world, number)[1] == 0.5
    for _ in range(24):
        world.step()
    assert (world.pose(number).position[2] < 4.99) is falls
    assert yaw_of(world.pose(number).orientation) == pytest.approx(0.5, abs=1e-3)


def test_a_model_that_cannot_be_loaded_is_refused(tmp_path: Path, world: PhysicsWorld) -> None:
    with pytest.raises(UserError):
        add_body(world, body(shape=UrdfModel(str(tmp_path / "absent.urdf"))))


def overlapping(world: PhysicsWorld, *bodies: SceneBody, names: Any = None) -> tuple[Diagnostic, ...]:
    placed = {add_body(world, one): one for one in bodies}
    with pytest.raises(UserError) as refused:
        check_overlaps(world, placed, names or {})
    return tuple(refused.value.diagnostics)


def test_two_declared_bodies_are_named_with_both_places(world: PhysicsWorld) -> None:
    bottle = body("bottle", Cylinder(0.05, 0.1), (0.09, 0.0, 0.05))
    (found,) = overlapping(world, body("crate"), bottle)
    assert (found.code, found.headline) == ("AE140", "`crate` and `bottle` overlap by 10.0 mm")
    assert found.primary is not None
    labels = [found.primary, *found.secondary]
    assert sorted(label.text for label in labels) == ["`bottle` is placed here", "`crate` is placed here"]
    assert {label.span.start for label in labels} == {0, 6}
    assert found.help == ("move one of them, or make it smaller, by at least 10.0 mm",)


def test_the_declared_body_is_named_first(world: PhysicsWorld) -> None:
    table = world.bodies.add_box((1.0, 1.0, 0.1), (0.0, 0.0, -0.045))
    stone = world.bodies.add_box((0.1, 0.1, 0.1), (5.0, 5.0, 5.0))
    (found,) = overlapping(world, body("pole"), names={table: "the table", stone: "a stone"})
    assert found.headline == "`pole` and the table overlap by 5.0 mm"
    assert found.primary is not None
    assert (found.primary.span.start, found.secondary) == (13, ())


def test_a_part_of_the_scene_without_a_name_is_reported_by_its_place(world: PhysicsWorld) -> None:
    world.bodies.add_box((1.0, 1.0, 0.1), (0.25, 0.0, -0.045))
    (found,) = overlapping(world, body("pole"))
    assert found.headline == "`pole` and the body at (0.25, 0.00, -0.04) m overlap by 5.0 mm"


def test_an_overlap_of_the_scene_itself_has_no_place_in_a_file(world: PhysicsWorld) -> None:
    first, second = (world.bodies.add_box((0.1, 0.1, 0.1), (x, 0.0, 0.0)) for x in (0.0, 0.05))
    (found,) = overlapping(world, names={first: "one", second: "another"})
    assert (found.primary, found.secondary, found.help) == (None, (), ())
    assert "overlap by 50.0 mm" in found.headline


def test_every_pair_is_reported(world: PhysicsWorld) -> None:
    rows = [
        body(name, position=(0.09 * place, 0.0, 0.05))
        for place, name in enumerate(("crate", "bottle", "pole"))
    ]
    assert len(overlapping(world, *rows)) == 2


def test_bodies_up_to_2_mm_in_each_other_are_accepted(world: PhysicsWorld) -> None:
    placed = {
        add_body(world, one): one for one in (body("crate"), body("pole", position=(0.0985, 0.0, 0.05)))
    }
    check_overlaps(world, placed, {})
    check_overlaps(PhysicsWorld(), {}, {})
