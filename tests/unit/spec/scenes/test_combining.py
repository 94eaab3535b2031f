"""Scenes of several tasks as one cell: what they share, other names, and what cannot be combined."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from aeros.sim.layouts.placement import place_things
from aeros.sim.randomness import RandomSource
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.expr.terms import variables_of
from aeros.spec.model.scene import RobotMount, Scene
from aeros.spec.scenes.combining import combine
from aeros.spec.scenes.load import load_scene
from aeros.spec.scenes.merging import names_in_use
from tests.shipped_scenes import shipped_scene

HEAD = """schema: aeros/scene/2
description: {name}.
module: {module}
robot: {{mount: carriage, at: [0 m, {y} m, 0 m]}}
view: {{eye: [1 m, {y} m, 1 m], target: [0 m, {y} m, 0 m]}}
"""
FLOOR = "  floor: {box: [4 m, 4 m, 5 cm], at: [0 m, 0 m, -40 cm]}\n"
CUP = """  cup: {{cylinder: [3 cm, 8 cm], at: [50 cm, {y} m, 4 cm], spread: [5 cm, 5 cm, 0 m], mass: 100 g}}
regions:
  spot: {{of: cup, low: [-1 cm, -1 cm, -1 cm], high: [1 cm, 1 cm, 1 cm]}}
truth: {{{truth}: cup.position in spot and not cup.held and cup.position.z < 1 m}}
"""


def scene(folder: Path, module: str, y: float = 0.0, more: str = "", floor: str = FLOOR) -> Scene:
    """A cup on a floor, as the scene of a module whose goal it defines."""
    text = HEAD.format(name=module, module=module, y=y) + more + "bodies:\n" + floor
    (file := folder / f"{module}_scene.yaml").write_text(text + CUP.format(y=y, truth="done"))
    return load_scene(str(file))


def test_one_scene_stays_as_it_is(tmp_path: Path) -> None:
    alone = scene(tmp_path, "pour")
    assert combine({"pour": alone}) == alone


def test_equal_bodies_are_shared_and_other_names_are_made_to_differ(tmp_path: Path) -> None:
    pour, serve = scene(tmp_path, "pour"), scene(tmp_path, "serve", 1.0)
    whole = combine({"pour": pour, "serve": serve})
    assert list(whole.bodies) == ["floor", "pour_cup", "serve_cup"]
    assert {name: one.of for name, one in whole.regions.items()} == {
        "pour_spot": "pour_cup",
        "serve_spot": "serve_cup",
    }
    assert set(variables_of(whole.truth["serve.done"].term)) == {
        "serve_cup.position in serve_spot",
        "serve_cup.held",
        "serve_cup.position",
    }
    assert [part.name for part in whole.parts] == ["pour_scene", "serve_scene"]
    assert whole.name == "pour_scene+serve_scene"


def test_the_robot_starts_where_the_first_scene_has_it(tmp_path: Path) -> None:
    pour, serve = scene(tmp_path, "pour"), scene(tmp_path, "serve", 1.0)
    assert combine({"pour": pour, "serve": serve}).robot == pour.robot
    assert combine({"serve": serve, "pour": pour}).robot == serve.robot


def test_everything_starts_where_it_does_in_its_own_scene(tmp_path: Path) -> None:
    pour, serve = scene(tmp_path, "pour"), scene(tmp_path, "serve", 1.0)
    together = place_things(combine({"pour": pour, "serve": serve}), RandomSource(3))
    for label, one in (("pour", pour), ("serve", serve)):
        assert together[f"{label}_cup"] == place_things(one, RandomSource(3))["cup"]


def test_a_place_keeps_its_variable_under_another_name(tmp_path: Path) -> None:
    place = "places: {{dock: {{at: [0 m, {y} m, 0 m]}}}}\n"
    pour = scene(tmp_path, "pour", 0.0, place.format(y=0.0))
    serve = scene(tmp_path, "serve", 1.0, place.format(y=1.0))
    assert dict(combine({"pour": pour, "serve": serve}).measured()) == {
        "pour.dock": "pour_dock",
        "serve.dock": "serve_dock",
    }


def test_equal_places_of_one_variable_are_measured_once_and_different_ones_refused(tmp_path: Path) -> None:
    place = "places: {{dock: {{at: [0 m, {y} m, 0 m]}}}}\n"
    first = scene(tmp_path, "pour", 0.0, place.format(y=0.0))
    second = replace(first, name="other", bodies={}, regions={}, truth={}, parts=first.parts[:0])
    second = replace(second, parts=(first.parts[0]._replace(name="other"),))
    whole = combine({"pour": first, "again": second})
    assert dict(whole.measured()) == {"pour.dock": "dock"}
    moved = {"dock": first.places["dock"]._replace(position=(1.0, 0.0, 0.0))}
    with pytest.raises(UserError, match=r"`pour\.dock` is measured in the scene `other` and in `pour_scene`"):
        combine({"pour": first, "again": replace(second, places=moved)})


def test_a_scene_that_another_includes_adds_nothing(tmp_path: Path) -> None:
    pour = scene(tmp_path, "pour")
    (tmp_path / "more.yaml").write_text(
        "schema: aeros/scene/2\ndescription: more.\ninclude: [{scene: pour_scene.yaml}]\n"
        "bodies: {jug: {box: [1 cm, 1 cm, 1 cm], at: [1 m, 1 m, 0 m]}}\n"
    )
    more = load_scene(str(tmp_path / "more.yaml"))
    for scenes in ({"pour": pour, "more": more}, {"more": more, "pour": pour}):
        assert list(combine(scenes).bodies) == ["floor", "cup", "jug"]


def test_a_scene_that_another_includes_at_another_place_is_a_second_one(tmp_path: Path) -> None:
    scene(tmp_path, "pour")
    (tmp_path / "more.yaml").write_text(
        "schema: aeros/scene/2\ndescription: more.\n"
        "include: [{scene: pour_scene.yaml, at: [0 m, 3 m, 0 m], prefix: far_}]\n"
    )
    (tmp_path / "beside.yaml").write_text(
        "schema: aeros/scene/2\ndescription: beside.\ninclude: [{scene: part.yaml, at: [0 m, 3 m, 0 m]}]\n"
    )
    (tmp_path / "part.yaml").write_text(
        "schema: aeros/scene/2\ndescription: part.\n"
        "bodies: {jug: {box: [1 cm, 1 cm, 1 cm], at: [1 m, 1 m, 0 m]}}\n"
    )
    pour, more, beside, part = (
        load_scene(str(tmp_path / f"{name}.yaml")) for name in ("pour_scene", "more", "beside", "part")
    )
    assert {"cup", "far_cup"} <= combine({"pour": pour, "more": more}).bodies.keys()
    assert list(combine({"one": part, "two": beside}).bodies) == ["one_jug", "two_jug"]


def test_a_label_in_use_is_put_before_the_name_once_more(tmp_path: Path) -> None:
    taken = FLOOR + "  pour_cup: {box: [1 cm, 1 cm, 1 cm], at: [1 m, 1 m, 0 m]}\n"
    pour, serve = scene(tmp_path, "pour", floor=taken), scene(tmp_path, "serve", 1.0)
    whole = combine({"pour": pour, "serve": serve})
    assert set(whole.bodies) == {"floor", "pour_cup", "pour_pour_cup", "serve_cup"}


@pytest.mark.parametrize(
    ("more", "reason"),
    [
        ({"robot": "fixed"}, "is not put up as that of `pour_scene`"),
        ({"robot": "higher"}, "is not put up as that of `pour_scene`"),
        ({"camera": "other"}, "`top` of the scene `serve_scene` is already a camera of `pour_scene`"),
    ],
)
def test_scenes_that_cannot_be_combined_are_refused_with_their_names(
    more: dict[str, str], reason: str, tmp_path: Path
) -> None:
    camera = "cameras: {{top: {{eye: [0 m, 0 m, {z} m], target: [0 m, 0 m, 0 m], up: [1, 0, 0]}}}}\n"
    pour = scene(tmp_path, "pour", 0.0, camera.format(z=1))
    serve = scene(tmp_path, "serve", 1.0, camera.format(z=2 if "camera" in more else 1))
    if "robot" in more:
        robot = RobotMount(more["robot"] == "higher", (0.0, 0.0, 0.3 if more["robot"] == "higher" else 0.0))
        serve = replace(serve, robot=robot)
    with pytest.raises(UserError, match=reason):
        combine({"pour": pour, "serve": serve})


def test_robots_that_cannot_drive_stand_in_one_place(tmp_path: Path) -> None:
    scenes = {name: scene(tmp_path, name, y) for name, y in (("pour", 0.0), ("serve", 1.0))}
    fixed = {
        name: replace(one, robot=RobotMount(False, (0.0, float(number), 0.0)))
        for number, (name, one) in enumerate(scenes.items())
    }
    with pytest.raises(UserError, match="does not stand where that of `pour_scene` does, and cannot drive"):
        combine(fixed)


def test_the_view_shows_the_targets_of_all_views(tmp_path: Path) -> None:
    pour, serve = scene(tmp_path, "pour"), scene(tmp_path, "serve", 3.0)
    view = combine({"pour": pour, "serve": serve}).view
    assert view is not None
    assert view.target == (0.0, 1.5, 0.0)
    assert view.eye[0] > 2.5
    assert view.eye[1] == pytest.approx(1.5)


def test_the_shipped_scenes_are_one_cell() -> None:
    names = ("dumpling_bench", "table", "fetch")
    whole = combine({name: shipped_scene(name) for name in names})
    assert {"floor", "bench", "table", "table_can", "fetch_can", "fetch_stand"} <= names_in_use(whole).keys()
    assert {name for name, _ in whole.measured()} == {
        name for one in names for name, _ in shipped_scene(one).measured()
    }
    assert whole.truth.keys() == {name for one in names for name in shipped_scene(one).truth}
