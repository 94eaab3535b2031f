"""The shipped scenes without physics: pictures, and perceivers of the modules that look at them."""

from __future__ import annotations

import pytest

from aeros.sim.geometry import Pose, add, yaw_orientation
from aeros.sim.kinematic.objects import ObjectSet
from aeros.sim.kinematic.plant import make_plant
from aeros.sim.kinematic.scenes.declared_scene import DeclaredScene
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.robot import RobotState
from tests.modules.robot import Robot
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.start_layouts import room_layout, table_layout

SEED = 3
SOMEWHERE = RobotState((0.0,) * 7, (0.0,) * 7, (0.0,) * 7, (9.0,) * 3, 0.0, 0.08, 0.0, (0.0,) * 3, (0.0,) * 3)


def robot(module: str, scene: str, seed: int = 0) -> Robot:
    return Robot(module, make_plant(shipped_scene(scene), seed))


def built(name: str) -> tuple[DeclaredScene, ObjectSet]:
    scene = DeclaredScene(shipped_scene(name))
    return scene, scene.build(RandomSource(SEED))


TASKS = (
    ("make_dumplings", "dumpling_bench", ("prepare", "wrap", "boil"), "dumpling_cooked"),
    ("clean_table", "table", ("wipe", "organize", "verify"), "table_verified"),
    ("fetch_object", "fetch", ("navigate", "detect", "grasp", "deliver"), "object_delivered"),
)


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.deep) for seed in (1, 2))])
@pytest.mark.parametrize(("ecm", "scene", "skills", "goal"), TASKS, ids=[task[0] for task in TASKS])
def test_the_skills_of_each_module_reach_its_goal(
    ecm: str, scene: str, skills: tuple[str, ...], goal: str, seed: int
) -> None:
    one = robot(ecm, scene, seed)
    assert not one.observed().get(goal, False)
    for skill in skills:
        assert one.run(skill) is None
    assert one.observed()[goal]


@pytest.mark.deep
def test_two_dumplings_are_made_one_after_the_other_and_lie_in_the_pot() -> None:
    plant = make_plant(shipped_scene("dumpling_bench"), 0)
    one = Robot("make_dumplings", plant)
    one.plant.set_parameters({"make_dumplings.count": 2})
    for cooked in (1, 2):
        for skill in ("prepare", "wrap", "boil"):
            assert one.run(skill) is None
        assert one.observed()["dumplings_cooked"] == cooked
        assert plant.truth()["make_dumplings.dumplings_cooked"] == cooked


def test_a_dumpling_moved_on_the_press_takes_its_filling_along() -> None:
    one = robot("make_dumplings", "dumpling_bench")
    for skill in ("prepare", "recover"):
        assert one.run(skill) is None
        seen = one.observed()
        assert (seen["filling_on_workspace"], seen["wrapper_aligned"]) == (True, True)


def test_a_wrapper_without_its_filling_is_folded_but_never_wrapped() -> None:
    one = robot("make_dumplings", "dumpling_bench")
    # As many actions as lay the wrapper out: the filling stays on its stand.
    assert one.run("prepare", actions=15) is None
    assert one.do("look", camera="overhead").completed
    assert one.observed()["wrapper_aligned"]
    assert one.run("wrap") is None
    after = one.observed()
    assert after["wrappers_shut"] == 1  # the other one is worked on from now on
    assert not after["dumpling_wrapped"]


def test_a_camera_sees_the_can_where_it_is_in_the_picture_and_only_there() -> None:
    one = robot("fetch_object", "fetch")
    one.do("look", camera="mast")
    before = one.observed()
    assert "object_position" not in before
    assert not before["object_detected"]
    assert one.run("navigate") is None
    assert one.run("detect") is None
    assert one.observed()["object_detected"]
    assert one.do("look", camera="roof").reason == "unknown camera: `roof`"


@pytest.mark.parametrize(("thing", "is_can"), [("can", True), ("decoy", False)])
def test_the_can_and_the_decoy_differ_in_width(thing: str, is_can: bool) -> None:
    one = robot("fetch_object", "fetch", SEED)
    for skill in ("navigate", "detect"):
        assert one.run(skill) is None
    x, y, z = getattr(room_layout(SEED), thing)
    one.do("grip", width=0.08, force=10.0)
    one.do("move_tool", target=(x, y, z + 0.15), yaw=0.0, speed=0.3)
    one.do("move_tool", target=(x, y, z), yaw=0.0, speed=0.1)
    one.do("grip", width=0.03, force=10.0)
    seen = one.observed()
    assert (seen["holding"], seen["object_grasped"]) == (True, is_can)


def test_wiping_without_a_sponge_in_the_hand_wipes_nothing() -> None:
    one = robot("clean_table", "table")
    one.do("grip", width=0.0, force=10.0)
    one.do("move_tool", target=(0.5, -1.1, 0.02), yaw=0.0, speed=0.25)
    assert one.do("slide", target=(0.5, -1.3, 0.0), force=4.0, speed=0.1).completed
    assert one.do("move_tool", target=(0.3, -1.2, 0.45), yaw=0.0, speed=0.25).completed
    one.do("look", camera="overhead")
    assert one.observed()["wiped_fraction"] == 0.0


def test_can_and_decoy_stand_on_their_stand_and_are_as_wide_as_they_are() -> None:
    (_, things), laid = built("fetch"), room_layout(SEED)
    for place, yaw, width in ((laid.can, 0.0, 0.044), (laid.can, 0.7, 0.044), (laid.decoy, 0.0, 0.04)):
        assert things.width_between(Pose(place, yaw_orientation(yaw))) == pytest.approx(width)
    x, y, z = laid.can
    # The can's middle is 40 mm over the stand, and the pads reach 9 mm further than its top at 80 mm.
    assert things.width_between(Pose((x, y, z + 0.047), yaw_orientation(0.0))) is not None
    assert things.width_between(Pose((x, y, z + 0.050), yaw_orientation(0.0))) is None
    dx, dy, dz = laid.decoy
    assert things.width_between(Pose((dx, dy, dz + 0.032), yaw_orientation(0.0))) is not None
    assert things.width_between(Pose((dx, dy, dz + 0.035), yaw_orientation(0.0))) is None
    assert things.width_between(Pose((dx + 0.019, dy + 0.019, dz), yaw_orientation(0.0))) is not None
    assert things.width_between(Pose((dx + 0.021, dy, dz), yaw_orientation(0.0))) is None


def test_hands_press_on_the_stands_and_on_the_floor() -> None:
    (_, things), laid = built("fetch"), room_layout(SEED)
    for x, y, top in (
        (*laid.stands[0][:2], 0.1),
        (*laid.stands[1][:2], 0.1),
        (2.0, 2.0, -0.3),
        (-1.5, -2.5, -0.3),
    ):
        things.tick(Pose((x, y, top + 0.008), yaw_orientation(0.0)), 0.0)
        assert things.load == pytest.approx(10.0)
        things.tick(Pose((x, y, top + 0.010), yaw_orientation(0.0)), 0.0)
        assert things.load == 0.0


def test_objects_are_as_wide_as_they_are() -> None:
    (_, things), laid = built("table"), table_layout(SEED)
    x, y, z = laid.rest
    # The block on the sponge is 50 mm by 40 mm, from 19 to 49 mm over the sponge's middle.
    for height, width in ((0.011, 0.04), (0.057, 0.04), (0.009, None), (0.059, None)):
        found = things.width_between(Pose((x, y, z + height), laid.sponge.orientation))
        assert found == (None if width is None else pytest.approx(width, abs=1e-6))
    assert things.width_between(laid.cube) == pytest.approx(0.04)
    assert things.width_between(Pose(laid.can.position, yaw_orientation(0.6))) == pytest.approx(0.04)
    cx, cy, cz = laid.can.position
    assert things.width_between(Pose((cx, cy, cz + 0.032), yaw_orientation(0.0))) == pytest.approx(0.04)
    assert things.width_between(Pose((cx, cy, cz + 0.036), yaw_orientation(0.0))) is None


def test_places_are_surveyed_as_the_modules_own_variables() -> None:
    (scene, _), laid = built("table"), table_layout(SEED)
    assert dict(scene.measure()) == {
        "clean_table.sponge_rest_position": laid.rest,
        "clean_table.bin_position": (0.45, pytest.approx(-1.7), pytest.approx(0.085)),
        "clean_table.area_position": (0.5, pytest.approx(-1.2), 0.0),
        "clean_table.dock_position": (0.0, pytest.approx(-1.2), 0.0),
    }
    assert set(scene.truth()) >= {
        f"clean_table.{name}(region = {region})"
        for name in ("table_wiped", "table_organized", "table_verified")
        for region in ("whole", "left", "right")
    }


@pytest.mark.parametrize("region", ["left", pytest.param("right", marks=pytest.mark.deep)])
def test_wiping_a_half_leaves_the_other_half_as_it_is(region: str) -> None:
    plant = make_plant(shipped_scene("table"), 0)
    one = Robot("clean_table", plant)
    one.plant.set_parameters({"clean_table.region": region})
    for skill in ("wipe", "organize", "verify"):
        assert one.run(skill) is None
    assert one.observed()["table_verified"]
    truth = plant.truth()
    other = "left" if region == "right" else "right"
    assert truth[f"clean_table.table_verified(region = {region})"]
    assert not truth[f"clean_table.table_wiped(region = {other})"]
    assert isinstance(plant._scene, DeclaredScene)
    assert plant._scene.state.value(f"dirt.{other}_half.wiped") < 0.1


@pytest.mark.parametrize(
    ("x", "y"),
    [
        (0.325, -1.2),  # at the table's edge, in front of what the arm stands on
        (0.33, -1.45),
        (0.45, -1.58),  # 15 mm from the bin's wall
        (0.45, -1.592),
        (0.33, -1.70),  # between the bin and the table's edge
    ],
)
def test_a_piece_where_a_hand_has_little_room_is_put_into_the_bin(x: float, y: float) -> None:
    plant = make_plant(shipped_scene("table"), 0)
    one = Robot("clean_table", plant)
    assert isinstance(plant._scene, DeclaredScene)
    cube = plant._scene._objects["cube"]
    cube.pose = Pose((x, y, cube.pose.position[2]), yaw_orientation(0.2))
    assert one.run("organize") is None
    assert one.observed()["table_organized"]
    assert plant.truth()["clean_table.table_organized(region = whole)"]


@pytest.mark.parametrize(("depth", "wipes"), [(0.0002, True), (0.00005, False), (-0.001, False)])
def test_a_held_sponge_wipes_where_it_is_pressed_with_more_than_1_n(depth: float, wipes: bool) -> None:
    (scene, things), laid = built("table"), table_layout(SEED)
    x, y, z = laid.rest
    tool = Pose((x, y, z + 0.034), laid.sponge.orientation)
    things.grip(tool)
    # 10 kN/m: 0.2 mm too deep are 2 N.
    things.tick(Pose((0.5, -1.2, z + 0.034 - depth), tool.orientation), 0.04)
    scene.tick(SOMEWHERE)
    # The foam covers 100 mm by 70 mm of 300 mm by 300 mm.
    assert scene.coating_of("dirt").wiped_share == (pytest.approx(70 / 900, abs=0.02) if wipes else 0.0)


def test_a_hand_without_the_sponge_wipes_nothing() -> None:
    scene, things = built("table")
    things.tick(Pose((0.5, -1.2, 0.005), yaw_orientation(0.0)), 0.04)
    assert things.load > 1.0
    scene.tick(SOMEWHERE)
    assert scene.coating_of("dirt").wiped_share == 0.0


def test_a_table_is_organized_in_truth_once_both_pieces_are_in_the_bin() -> None:
    (scene, things), laid = built("table"), table_layout(SEED)
    for pose, x, is_organized in ((laid.cube, 0.42, False), (laid.can, 0.48, True)):
        things.grip(Pose(add(pose.position, (0.0, 0.0, 0.015)), pose.orientation))
        things.tick(Pose((x, -1.7, 0.2), pose.orientation), 0.04)
        things.release()
        assert scene.truth()["clean_table.table_organized(region = whole)"] is is_organized
