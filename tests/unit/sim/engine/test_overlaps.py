"""Overlaps of bodies in a world are refused with their places, whatever the engine."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from aeros.sim.engine.engine import Engine
from aeros.sim.engine.overlaps import check_overlaps
from aeros.sim.geometry import Pose, yaw_orientation
from aeros.sim.physics import make_bullet_engine, make_mujoco_engine
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.model.scene import Cylinder, SceneBody
from tests.unit.sim.engine.declared_bodies import body

pytestmark = pytest.mark.physics

WHITE = (1.0, 1.0, 1.0, 1.0)


@pytest.fixture(params=[make_bullet_engine, make_mujoco_engine], ids=["bullet", "mujoco"])
def engine(request: pytest.FixtureRequest) -> Iterator[Engine]:
    made: Engine = request.param()
    yield made
    made.world.close()


def add(engine: Engine, declared: SceneBody) -> int:
    placement = declared.placement
    return engine.add_body(declared, Pose(placement.position, yaw_orientation(placement.yaw))).number


def overlapping(engine: Engine, *bodies: SceneBody, names: Any = None) -> tuple[Diagnostic, ...]:
    placed = {add(engine, one): one for one in bodies}
    with pytest.raises(UserError) as refused:
        check_overlaps(engine.world, placed, names or {})
    return tuple(refused.value.diagnostics)


def test_two_declared_bodies_are_named_with_both_places(engine: Engine) -> None:
    bottle = body("bottle", Cylinder(0.05, 0.1), (0.09, 0.0, 0.05))
    (found,) = overlapping(engine, body("crate"), bottle)
    assert (found.code, found.headline) == ("AE140", "`crate` and `bottle` overlap by 10.0 mm")
    assert found.primary is not None
    labels = [found.primary, *found.secondary]
    assert sorted(label.text for label in labels) == ["`bottle` is placed here", "`crate` is placed here"]
    assert {label.span.start for label in labels} == {0, 6}
    assert found.help == ("move one of them, or make it smaller, by at least 10.0 mm",)


def test_the_declared_body_is_named_first(engine: Engine) -> None:
    table = engine.add_box((1.0, 1.0, 0.1), (0.0, 0.0, -0.045), mass=0.0, colour=WHITE)
    stone = engine.add_box((0.1, 0.1, 0.1), (5.0, 5.0, 5.0), mass=0.0, colour=WHITE)
    (found,) = overlapping(engine, body("pole"), names={table: "the table", stone: "a stone"})
    assert found.headline == "`pole` and the table overlap by 5.0 mm"
    assert found.primary is not None
    assert (found.primary.span.start, found.secondary) == (13, ())


def test_a_part_of_the_scene_without_a_name_is_reported_by_its_place(engine: Engine) -> None:
    engine.add_box((1.0, 1.0, 0.1), (0.25, 0.0, -0.045), mass=0.0, colour=WHITE)
    (found,) = overlapping(engine, body("pole"))
    assert found.headline == "`pole` and the body at (0.25, 0.00, -0.04) m overlap by 5.0 mm"


def test_an_overlap_of_the_scene_itself_has_no_place_in_a_file(engine: Engine) -> None:
    first, second = (
        engine.add_box((0.1, 0.1, 0.1), (x, 0.0, 0.0), mass=0.0, colour=WHITE) for x in (0.0, 0.05)
    )
    (found,) = overlapping(engine, names={first: "one", second: "another"})
    assert (found.primary, found.secondary, found.help) == (None, (), ())
    assert "overlap by 50.0 mm" in found.headline


def test_every_pair_is_reported(engine: Engine) -> None:
    rows = [
        body(name, position=(0.09 * place, 0.0, 0.05))
        for place, name in enumerate(("crate", "bottle", "pole"))
    ]
    assert len(overlapping(engine, *rows)) == 2


def test_bodies_up_to_2_mm_in_each_other_are_accepted(engine: Engine) -> None:
    placed = {add(engine, one): one for one in (body("crate"), body("pole", position=(0.0985, 0.0, 0.05)))}
    check_overlaps(engine.world, placed, {})
