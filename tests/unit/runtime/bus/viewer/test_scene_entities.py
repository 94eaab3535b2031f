"""Entities of a scene: volumes, measured things and the robot's links, each in its frame."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

from aeros.runtime.bus.messages import Time
from aeros.runtime.bus.viewer.scene_entities import link_entities, person_entity, thing_entity, zone_entities
from aeros.runtime.bus.viewer.things import SceneThing
from aeros.runtime.ports import ColouredMesh, Hull, LinkModel, PersonFigure, Reading
from aeros.spec.expr.scope import AxisAlignedBox
from aeros.spec.model.site import Site
from tests.unit.runtime.one_joint import PLAN

BOX = AxisAlignedBox((Fraction(-1), Fraction(0), Fraction(0)), (Fraction(1), Fraction(1), Fraction(4)))
CORNERS = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def test_a_volume_is_a_box_with_its_name(site: Site) -> None:
    (zone,) = zone_entities(replace(site, volumes={"bench": BOX}), Time(3))
    assert (zone.id, zone.frame_id, zone.timestamp, zone.texts[0].text) == (
        "bench",
        "world",
        Time(3),
        "bench",
    )
    (cube,) = zone.cubes
    middle, size = cube.pose.position, cube.size
    assert (middle.x, middle.y, middle.z) == (0.0, 0.5, 2.0)
    assert (size.x, size.y, size.z) == (2.0, 1.0, 4.0)
    assert zone.texts[0].pose.position.z == 4.0


def test_a_thing_is_at_its_place_as_long_as_its_measurement_counts() -> None:
    sized = SceneThing("m.cube_position", "cube", "", 2.5, ((-0.5, -0.5, 0.0), (0.5, 0.5, 1.0)))
    entity = thing_entity(sized, Reading((1.0, 2.0, 3.0), 4.0))
    assert (entity.id, entity.timestamp, entity.texts[0].text) == ("m.cube_position", Time(4), "cube")
    assert (entity.lifetime.sec, entity.lifetime.nanosec) == (2, 500_000_000)
    assert entity.cubes[0].pose.position.z == 3.5
    assert entity.spheres == ()
    (ball,) = thing_entity(sized._replace(box=None), Reading((1.0, 2.0, 3.0), 4.0)).spheres
    assert (ball.pose.position.x, ball.pose.position.y, ball.pose.position.z) == (1.0, 2.0, 3.0)


def test_each_link_moves_with_its_frame() -> None:
    hulls = (
        Hull("foot", 0, CORNERS, 0.01),
        Hull("arm", 1, CORNERS, 0.01),
        Hull("flat", 1, CORNERS[:3], 0.01),
    )
    links = link_entities(replace(PLAN.body, hulls=hulls), ("shoulder",), Time(1), {})
    assert [(one.id, one.frame_id) for one in links] == [("foot", "base"), ("arm", "shoulder_link")]
    assert all(one.frame_locked and one.models[0].data.startswith(b"glTF") for one in links)


def test_a_robot_without_hulls_is_drawn_with_its_balls() -> None:
    (link,) = link_entities(PLAN.body, ("shoulder",), Time(1), {})
    assert (link.frame_id, link.spheres[0].size.x, link.models) == ("shoulder_link", 0.2, ())


def test_a_link_is_drawn_with_its_model_and_its_licence_if_it_has_one() -> None:
    hulls = (Hull("foot", 0, CORNERS, 0.01), Hull("arm", 1, CORNERS, 0.01))
    shown = ColouredMesh(CORNERS[:3], ((0, 1, 2),), (1.0, 0.0, 0.0))
    body, joints = replace(PLAN.body, hulls=hulls), ("shoulder",)
    plain = link_entities(body, joints, Time(1), {})
    foot, arm = link_entities(body, joints, Time(1), {hulls[1]: LinkModel((shown,), "arm.urdf: MIT")})
    assert foot == plain[0]
    assert [(one.key, one.value) for one in arm.metadata] == [("origin", "arm.urdf: MIT")]
    assert arm.models[0].data != plain[1].models[0].data
    # The model of a hull of the same name of another robot.
    other = {hulls[1]._replace(radius=0.02): LinkModel((shown,), "")}
    assert link_entities(body, joints, Time(1), other) == plain


def test_a_person_is_the_capsule_of_the_simulator() -> None:
    person = person_entity(2, PersonFigure(1.0, 2.0, -0.5, 1.75, 0.25), Time(3))
    assert (person.frame_id, person.id, person.texts[0].text) == ("world", *["person 2, simulated"] * 2)
    (trunk,) = person.cylinders
    assert (trunk.size.x, trunk.size.z) == (0.5, 1.25)
    assert (trunk.pose.position.x, trunk.pose.position.y, trunk.pose.position.z) == (1.0, 2.0, 0.375)
    assert [one.pose.position.z for one in person.spheres] == [-0.25, 1.0]
    assert {one.size.z for one in person.spheres} == {0.5}
