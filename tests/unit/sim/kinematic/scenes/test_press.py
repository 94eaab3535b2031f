"""The bench without physics: the handle turns the lid, the lid folds the wrapper."""

from __future__ import annotations

from math import asin, atan, pi

import pytest

from aeros.sim.geometry import Pose, add, to_world, yaw_orientation
from aeros.sim.kinematic.objects import ObjectSet
from aeros.sim.kinematic.scenes.declared_scene import DeclaredScene
from aeros.sim.kinematic.scenes.press import FoldingPress, Handle
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.robot import RobotState
from aeros.spec.model.scene import BodyPart
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.start_layouts import BenchLayout, bench_layout

SEED = 3
SOMEWHERE = RobotState((0.0,) * 7, (0.0,) * 7, (0.0,) * 7, (9.0,) * 3, 0.0, 0.08, 0.0, (0.0,) * 3, (0.0,) * 3)
STRAIGHT = yaw_orientation(0.0)
HINGE = (0.50, 0.0, 0.094)
"""Of the press, whose handle is 75 mm from it."""

ALIGNED_POSITION = (0.50, 0.0, 0.083)
"""Place of the hinge of an aligned wrapper, m."""


def _handle() -> Handle:
    return Handle(
        Pose((0.425, 0.0, 0.094), STRAIGHT), (-0.01,) * 3, (0.01,) * 3, 0.01, axis=HINGE, radius=0.075
    )


@pytest.mark.parametrize(
    ("x", "z", "angle"),
    [
        (-0.1, 0.0, 0.0),
        (-0.1, 0.1, pi / 4),
        (0.0, 0.2, pi / 2),
        (0.1, 0.1, 0.75 * pi),
        (0.1, 0.0, pi),
        (0.1, -0.005, pi + atan(0.05)),
        (0.1, -0.05, 3.25),
        (0.01, -0.1, 3.25),
        (-0.1, -0.1, 0.0),
    ],
)
def test_a_handle_turns_to_the_fingers_on_its_circle(x: float, z: float, angle: float) -> None:
    handle = _handle()
    handle.stops["wrapper"] = 3.25
    handle.move_with_gripper(Pose((HINGE[0] + x, 9.0, HINGE[2] + z), STRAIGHT), -9.0)
    assert handle.angle == pytest.approx(angle, abs=1e-5)
    dx, dz = handle.pose.position[0] - HINGE[0], handle.pose.position[2] - HINGE[2]
    assert dx**2 + dz**2 == pytest.approx(0.075**2)
    assert handle.pose.position[1] == 0.0


def test_a_handle_at_its_stop_takes_a_force_that_it_keeps_until_it_is_let_go() -> None:
    handle = _handle()
    handle.stops["wrapper"] = pi / 2
    # At the stop it is 75 mm over the hinge; 1 mm below are 10 N at 10 kN/m.
    down = Pose((HINGE[0] + 0.01, 0.0, HINGE[2] + 0.074), STRAIGHT)
    assert handle.move_with_gripper(down, -9.0) == pytest.approx(10.0)
    assert handle.angle == pi / 2
    assert handle.handle_force == pytest.approx(10.0)
    before = Pose((HINGE[0] - 0.01, 0.0, HINGE[2] + 0.05), STRAIGHT)
    assert handle.move_with_gripper(before, -9.0) == 0.0
    handle.move_with_gripper(down, -9.0)
    place = handle.pose
    handle.drop_onto_support(0.0)
    assert (handle.handle_force, handle.angle, handle.pose) == (0.0, pi / 2, place)


def _bench() -> tuple[DeclaredScene, ObjectSet, BenchLayout]:
    scene = DeclaredScene(shipped_scene("dumpling_bench"))
    return scene, scene.build(RandomSource(SEED)), bench_layout(SEED)


def _press(scene: DeclaredScene) -> FoldingPress:
    return scene.presses["folding_press"]


def _lay(scene: DeclaredScene, *, filled: bool, off: float = 0.0) -> None:
    """Lay the wrapper on the press, and the filling on it."""
    x, y, z = ALIGNED_POSITION
    scene._objects["wrapper"].pose = Pose((x + 0.022 + off, y, z), STRAIGHT)
    if filled:
        scene._objects["filling"].pose = Pose((x + 0.022 + off, y, z + 0.003 + 0.0085), STRAIGHT)


def _turn(scene: DeclaredScene, angle: float, force: float = 0.0) -> None:
    _press(scene).handle.angle, _press(scene).handle.handle_force = angle, force
    scene.tick(SOMEWHERE)


def test_everything_lies_on_its_support() -> None:
    scene, _, laid = _bench()
    assert scene.pose_of(BodyPart("wrapper")).position[2] == pytest.approx(0.06 + 0.003)
    filling = scene.pose_of(BodyPart("filling")).position
    assert filling == pytest.approx((*laid.filling.position[:2], 0.05 + 0.0085))
    assert scene.joint_position(BodyPart("wrapper", "fold")) == 0.0
    measured = scene.measure()
    assert measured["make_dumplings.press_handle_position"] == pytest.approx((0.425, 0.0, 0.094))
    assert measured["make_dumplings.press_force"] == 0.0


def test_objects_are_as_wide_as_they_are() -> None:
    _, things, laid = _bench()
    assert things.width_between(laid.filling) == pytest.approx(0.022)
    assert things.width_between(laid.wrapper) == pytest.approx(0.056)
    # The open wrapper reaches 65 mm from the middle of plate A over its hinge.
    for off, is_between in ((-0.064, True), (-0.066, False), (0.020, True), (0.022, False)):
        turned = laid.wrapper.orientation
        tool = Pose(to_world(laid.wrapper, (off, 0.0, 0.0)), turned)
        assert (things.width_between(tool) is not None) is is_between
    assert things.width_between(Pose((0.425, 0.0, 0.094), STRAIGHT)) == pytest.approx(0.044)


def test_a_press_and_a_pot_support_what_is_laid_on_them() -> None:
    scene, things, _ = _bench()
    for (x, y), top in (((0.524, 0.0), 0.08), ((0.55, 0.33), 0.005), ((0.8, -0.5), 0.0)):
        scene._objects["filling"].pose = Pose((x, y, 0.3), STRAIGHT)
        things.grip(scene._objects["filling"].pose)
        things.release()
        assert scene._objects["filling"].pose.position == pytest.approx((x, y, top + 0.0085))


def test_a_filling_is_carried_by_the_wrapper_under_it() -> None:
    scene, things, _ = _bench()
    _lay(scene, filled=True)
    things.grip(Pose(add(ALIGNED_POSITION, (0.022, 0.0, 0.0)), STRAIGHT))
    assert things.holds(scene._objects["filling"])


def test_the_lid_folds_an_aligned_wrapper_up_to_its_filling() -> None:
    scene, _, _ = _bench()
    _lay(scene, filled=True)
    _turn(scene, 1.0)
    assert _press(scene).fold == 1.0
    # The filling of 17 mm is 1 mm higher than the gap of 16 mm between the plates.
    assert _press(scene).handle.stop_angle == pytest.approx(pi - asin(0.001 / 0.022))
    empty, _, _ = _bench()
    _lay(empty, filled=False)
    _turn(empty, 1.0)
    assert _press(empty).handle.stop_angle == pi


@pytest.mark.parametrize(
    ("off", "folds"), [(0.0079, True), (-0.0079, True), (0.0081, False), (-0.0081, False)]
)
def test_only_a_wrapper_within_8_mm_is_folded(off: float, folds: bool) -> None:
    scene, _, _ = _bench()
    _lay(scene, filled=True, off=off)
    _turn(scene, 1.0)
    assert _press(scene).fold == (1.0 if folds else 0.0)
    assert (_press(scene).handle.stop_angle == 3.25) is not folds


def test_a_wrapper_in_the_hand_is_not_folded() -> None:
    scene, things, _ = _bench()
    _lay(scene, filled=True)
    things.grip(Pose(add(ALIGNED_POSITION, (0.022, 0.0, 0.0)), STRAIGHT))
    _turn(scene, 1.0)
    assert _press(scene).fold == 0.0


def test_an_open_plate_falls_to_the_side_that_it_leans_to() -> None:
    scene, _, _ = _bench()
    _lay(scene, filled=True)
    for lid, fold in ((1.5, 1.5), (1.0, 1.0), (1.6, 1.6), (1.0, 1.6), (2.0, 2.0)):
        _turn(scene, lid)
        assert _press(scene).fold == fold


def test_a_pressed_dumpling_is_sealed_and_wrapped() -> None:
    scene, _, _ = _bench()
    _lay(scene, filled=True)
    closed = pi - asin(0.001 / 0.022)
    # The lever from the handle to the plate is 75 mm to 22 mm: 0.3 N there are 1.02 N here.
    _turn(scene, closed, 0.2)
    assert scene.measure()["make_dumplings.press_force"] == pytest.approx(0.2 * 75 / 22)
    sealed = [scene.state.sealed["dough"]]
    _turn(scene, closed, 0.3)
    assert [*sealed, scene.state.sealed["dough"]] == [False, True]
    assert scene.truth()["make_dumplings.dumpling_wrapped"]


def test_force_on_an_open_or_an_empty_wrapper_seals_nothing() -> None:
    scene, _, _ = _bench()
    _lay(scene, filled=True)
    _turn(scene, 2.0, 5.0)
    assert not scene.state.sealed["dough"]
    empty, _, _ = _bench()
    _lay(empty, filled=False)
    _turn(empty, pi, 5.0)
    assert not empty.state.sealed["dough"]
    # The load cell feels the lid, and cannot tell that it presses on no filling.
    assert empty.measure()["make_dumplings.press_force"] == pytest.approx(5.0 * 75 / 22)
    assert not empty.truth()["make_dumplings.dumpling_wrapped"]


def test_a_sealed_dumpling_does_not_open_with_the_lid() -> None:
    scene, _, _ = _bench()
    _lay(scene, filled=True)
    closed = pi - asin(0.001 / 0.022)
    _turn(scene, closed, 5.0)
    _press(scene).fold = 1.5
    _turn(scene, 1.0)
    assert _press(scene).fold == 1.5
