"""A scene is elaborated as its file says; the shipped ones are the examples."""

from __future__ import annotations

from math import radians
from pathlib import Path

import pytest

from aeros.spec.expr.terms import variables_of
from aeros.spec.model.scene import AlternativePlace, BodyPart, Coating, Placement, RobotMount, SceneCamera
from aeros.spec.scenes.load import load_scene
from tests.shipped_scenes import ECMS, shipped_scene


def test_robot_places_and_cameras() -> None:
    scene = shipped_scene("fetch")
    assert scene.robot == RobotMount(True, (0.0, 0.0, 0.0))
    assert scene.places["station_survey"] == Placement(
        None, (-0.05, 2.4, 0.0), 0.0, (0.08, 0.08, 0.0), 0.0, "station"
    )
    assert scene.cameras["mast"] == SceneCamera(
        "base", (0.05, 0.2, 0.85), (0.58, 0.0, 0.12), (0.0, 0.0, 1.0), 50.0, 320, 240, True
    )
    hand = scene.cameras["hand"]
    assert (hand.frame, hand.up, hand.at_start) == ("hand", (1.0, 0.0, 0.0), False)
    assert hand.field_of_view == pytest.approx(70.0)


def test_a_body_may_stand_elsewhere_where_that_is_farther_from_another() -> None:
    decoy = shipped_scene("fetch").bodies["decoy"].placement
    assert (decoy.frame, decoy.alternative) == ("stand", AlternativePlace((0.0, 0.17, 0.226), "can"))


def test_a_body_is_put_down_by_its_anchor() -> None:
    wrapper = shipped_scene("dumpling_bench").bodies["wrapper"].placement
    assert (wrapper.anchor, wrapper.yaw_spread) == ((-0.022, 0.0, -0.003), 0.05)


def test_a_coating_is_a_rectangle_of_cells() -> None:
    assert shipped_scene("table").coatings["dirt"] == Coating(
        (0.35, -1.35),
        (0.65, -1.05),
        "table",
        "sponge",
        (0.10, 0.07, 0.03),
        1.0,
        0.0015,
        0.01,
        (0.353, 0.298, 0.251),
        (0.78, 0.702, 0.58),
    )


def test_a_press_and_a_seal_name_joints() -> None:
    scene = shipped_scene("dumpling_bench")
    press = scene.presses["folding_press"]
    assert (press.lid, press.folds) == (BodyPart("press", "hinge"), BodyPart("wrapper", "fold"))
    assert (press.handle_radius, press.range, press.gap) == (0.075, (0.0, 3.25), 0.016)
    seal = scene.seals["dough"]
    assert (seal.joint, seal.friction) == (BodyPart("wrapper", "fold"), 0.5)
    assert radians(160) == pytest.approx(2.7925268)
    assert scene.conditions["closed"].text.startswith("wrapper.fold > 160 deg")


def test_a_truth_that_speaks_of_a_parameter_is_one_for_each_of_its_values() -> None:
    truth = shipped_scene("fetch").truth
    assert {name for name in truth if "grasped" in name} == {
        "fetch_object.object_grasped(object = blue_block)",
        "fetch_object.object_grasped(object = red_can)",
    }
    delivered = truth["fetch_object.object_delivered(object = blue_block, to = left)"]
    assert set(variables_of(delivered.term)) == {"decoy.position in delivered_left", "decoy.held"}
    assert len(truth) == 2 * 2 + 2 * 4


def test_a_truth_may_use_another_that_depends_on_a_parameter(tmp_path: Path) -> None:
    folder = tmp_path / "scenes"
    folder.mkdir()
    text = (ECMS / "fetch_object" / "scenes" / "fetch.yaml").read_text().replace("module: fetch_object\n", "")
    more = "\n  both: object_grasped and object_delivered\n  near: robot.base.x < 1 m\n"
    (folder / "two.yaml").write_text(text.rstrip() + more)
    scene = load_scene(str(folder / "two.yaml"))
    both = scene.truth["both(object = red_can, to = right)"]
    assert set(variables_of(both.term)) == {
        "object_grasped(object = red_can)",
        "object_delivered(object = red_can, to = right)",
    }
    assert "near" in scene.truth
