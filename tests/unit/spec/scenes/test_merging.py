"""The shipped scenes under a prefix and at an offset are the same scenes elsewhere."""

from __future__ import annotations

from dataclasses import replace

import pytest

from aeros.sim.geometry import add
from aeros.sim.layouts.placement import place_things
from aeros.sim.randomness import RandomSource
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.expr.terms import variables_of
from aeros.spec.model.scene import BodyPart, ForceInstrument, LoadInstrument
from aeros.spec.scenes.merging import merge, moved, names_in_use
from tests.shipped_scenes import SHIPPED, shipped_scene

OFFSET = (1.0, -2.0, 0.0)


@pytest.mark.parametrize("name", SHIPPED)
def test_nothing_changes_under_no_prefix_and_at_the_origin(name: str) -> None:
    assert moved(shipped_scene(name), "", (0.0, 0.0, 0.0)) == shipped_scene(name)


@pytest.mark.parametrize("name", SHIPPED)
def test_everything_is_renamed_and_moved(name: str) -> None:
    scene = shipped_scene(name)
    other = moved(scene, "left_", OFFSET)
    assert names_in_use(other) == {f"left_{one}": what for one, what in names_in_use(scene).items()}
    here = place_things(scene, RandomSource(0))
    # Streams are renamed, so only what is not drawn can be compared.
    there = place_things(other, RandomSource(0))
    fixed = [one for one, at in scene.placements() if at.frame is None and not any(at.spread)]
    for one in fixed:
        assert there[f"left_{one}"].position == pytest.approx(add(here[one].position, OFFSET))
    for camera, declared in scene.cameras.items():
        shift = OFFSET if declared.frame == "cell" else (0.0, 0.0, 0.0)
        assert other.cameras[f"left_{camera}"].eye == pytest.approx(add(declared.eye, shift))
    for one, condition in other.truth.items():
        assert one.rpartition(".")[2].startswith("left_")
        names = [name for name in variables_of(condition.term) if not name.startswith("robot.")]
        assert all("left_" in name for name in names)
    assert {name for name, _ in other.measured()} == {
        ".".join((*owner, f"left_{short}"))
        for *owner, short in (name.split(".") for name, _ in scene.measured())
    }


def test_parts_and_regions_keep_their_bodies() -> None:
    bench = moved(shipped_scene("dumpling_bench"), "b_", OFFSET)
    assert bench.instruments["b_press_force"] == LoadInstrument(BodyPart("b_press"))
    assert bench.instruments["b_filling_force"] == ForceInstrument(
        BodyPart("b_filling"), BodyPart("b_wrapper", "plate_b")
    )
    assert bench.seals["b_dough"].joint == BodyPart("b_wrapper", "fold")
    press = bench.presses["b_folding_press"]
    assert (press.lid, press.handle) == (BodyPart("b_press", "hinge"), BodyPart("b_press", "handle"))
    assert press.place == pytest.approx((1.5, -2.0, 0.083))
    assert (press.filling, press.inside, press.seal) == ("b_filling", "b_plate", "b_dough")
    names = set(variables_of(bench.timers["b_cooking"].term))
    assert "b_wrapper.position in b_pot" in names
    table = moved(shipped_scene("table"), "t_", OFFSET)
    assert table.coatings["t_dirt"].low == pytest.approx((1.35, -3.35))
    assert (table.coatings["t_dirt"].on, table.coatings["t_dirt"].wiped_by) == ("t_table", "t_sponge")
    wiped = table.truth["clean_table.t_table_wiped(region = left)"]
    assert set(variables_of(wiped.term)) == {"t_dirt.t_left_half.wiped"}


def test_scenes_with_one_name_are_not_put_together() -> None:
    diagnostics = Diagnostics()
    table = shipped_scene("table")
    bench = replace(shipped_scene("dumpling_bench"), robot=None)
    merge(replace(table, cameras={"overhead": table.cameras["table_top"]}), bench, None, diagnostics)
    assert {one.headline for one in diagnostics} == {
        "`dock_position` of the scene `dumpling_bench` is already a place of `table`",
        "`floor` of the scene `dumpling_bench` is already a body of `table`",
        "`overhead` of the scene `dumpling_bench` is already a camera of `table`",
    }
    assert [one.help for one in diagnostics] == [
        ("rename one of them",),
        ("rename one of them",),
        ("make both equal, or bind one of them to another camera of the site",),
    ]


def test_robots_that_are_put_up_differently_are_not_put_together() -> None:
    diagnostics = Diagnostics()
    merge(shipped_scene("fetch"), moved(shipped_scene("table"), "t_", (0.0, 0.0, 0.0)), None, diagnostics)
    (found,) = diagnostics
    assert found.headline == "the robot of the scene `table` is not put up as that of `fetch`"


def test_a_scene_keeps_its_own_robot_and_view_and_names_all_its_files() -> None:
    diagnostics = Diagnostics()
    bench = replace(moved(shipped_scene("dumpling_bench"), "b_", (0.0, 0.0, 0.0)), robot=None)
    whole = merge(shipped_scene("table"), bench, None, diagnostics)
    assert list(diagnostics) == []
    assert (whole.name, whole.robot, whole.view) == (
        "table",
        shipped_scene("table").robot,
        shipped_scene("table").view,
    )
    assert [(part.name, part.prefix) for part in whole.parts] == [("table", ""), ("dumpling_bench", "b_")]
    assert set(whole.bodies) == {*shipped_scene("table").bodies, *bench.bodies}
