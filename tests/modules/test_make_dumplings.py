"""The perceiver of `make_dumplings`: wrapper and filling in pictures, and what becomes of them."""

from __future__ import annotations

from dataclasses import replace
from math import cos, dist, pi, sin
from typing import Any

import numpy as np
import pytest

from aeros.perception import Picture, View
from aeros.perception.points import point_cloud
from aeros.sim.geometry import Camera, Pose, Vector3, add, to_world, yaw_of, yaw_orientation
from ecms.make_dumplings.bench import LEANING
from ecms.make_dumplings.bench import Bench as KnownBench
from ecms.make_dumplings.following import with_press
from ecms.make_dumplings.hand import has_room
from ecms.make_dumplings.measures import CLOSED_HEIGHT, HINGE_TO_PLATE, PLATE_HALF
from ecms.make_dumplings.perceivers import UNSEEN
from ecms.make_dumplings.pictures import (
    find_hidden_place,
    level_points,
    look_from_above,
    shows_filling,
    square_heading,
)
from ecms.make_dumplings.room import with_rim
from ecms.make_dumplings.values import covered_values, pot_values, remaining_values
from ecms.make_dumplings.wrappers import Piece, Wrapper, is_in_pot, is_near
from tests.modules.looking import Put, Top, Watched, as_picture, draw

PRESS, POT = (0.5, 0.0, 0.083), (0.55, 0.33, 0.055)
CAMERA = Camera(eye=(0.5, 0.0, 1.0), target=(0.5, 0.0, 0.0), up=(1.0, 0.0, 0.0), field_of_view=16.0)
"""1.2 mm a pixel."""

DOUGH, GLAZE, GREEN = (220, 200, 80), (200, 115, 60), (60, 180, 70)
HINGE = (0.48, 0.03, 0.063)
"""Of a wrapper whose plates are 3 mm thick to each side of it."""


def plate(along: float, colour: tuple[int, int, int], yaw: float, **more: Any) -> Top:
    """A plate with its middle this far from the hinge along the wrapper's heading."""
    x, y = HINGE[0] + along * cos(yaw), HINGE[1] + along * sin(yaw)
    return Top(x, y, HINGE[2] + PLATE_HALF[2], PLATE_HALF[:2], colour, yaw)._replace(**more)


def opened(yaw: float) -> list[Top]:
    return [plate(HINGE_TO_PLATE, DOUGH, yaw), plate(-HINGE_TO_PLATE, GLAZE, yaw)]


def seen(*tops: Top) -> tuple[Any, Vector3 | None]:
    """Wrapper and filling in a drawn picture."""
    picture = draw(CAMERA, tops)
    shown = look_from_above(picture, level_points(picture)[0], [], None)
    assert max(len(shown.wrappers), len(shown.fillings)) <= 1
    return next(iter(shown.wrappers), None), next((one.middle for one in shown.fillings), None)


def wrapper(*tops: Top) -> Any:
    found = seen(*tops)[0]
    assert found is not None
    return found


def test_an_empty_bench_shows_nothing() -> None:
    assert seen() == (None, None)


@pytest.mark.parametrize("yaw", [0.0, 0.4, -0.8, 1.6, 3.0, -2.5])
def test_an_open_wrapper_is_located_by_its_hinge_and_heading(yaw: float) -> None:
    found = wrapper(*opened(yaw))
    assert found.hinge == pytest.approx(HINGE, abs=0.002)
    assert (cos(found.yaw), sin(found.yaw)) == pytest.approx((cos(yaw), sin(yaw)), abs=0.04)
    assert -pi <= found.yaw <= pi
    assert found.fold == pytest.approx(0.0, abs=0.05)
    assert not found.is_closed


@pytest.mark.parametrize("yaw", [0.0, 0.5, -0.9])
def test_a_closed_wrapper_shows_its_upper_plate(yaw: float) -> None:
    # The outside of plate B is 25 mm above the middle of plate A.
    upper = plate(HINGE_TO_PLATE, GLAZE, yaw, z=HINGE[2] + CLOSED_HEIGHT)
    found = wrapper(upper)
    assert found.hinge == pytest.approx(HINGE, abs=0.003)
    assert found.yaw == pytest.approx(yaw, abs=0.04)
    assert found.fold == pytest.approx(pi, abs=0.05)
    assert found.is_closed
    # An edge of plate A that looks out from under it changes nothing.
    edge = plate(HINGE_TO_PLATE + 0.002, DOUGH, yaw)
    assert wrapper(upper, edge).hinge == pytest.approx(HINGE, abs=0.003)


def test_a_wrapper_with_a_hidden_upper_plate_is_found_by_the_lower_one() -> None:
    found = wrapper(plate(HINGE_TO_PLATE, DOUGH, 0.3))
    assert found.hinge == pytest.approx(HINGE, abs=0.003)
    assert found.yaw == pytest.approx(0.3, abs=0.04)
    assert found.fold == 0.0


def test_a_single_plate_is_taken_to_point_away_from_the_robot() -> None:
    assert wrapper(plate(HINGE_TO_PLATE, DOUGH, 0.3 + pi)).yaw == pytest.approx(0.3, abs=0.04)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_half_hidden_plate_does_not_shift_the_wrapper(side: float) -> None:
    # The arm over one half of plate A, seen 0.93/0.79 as far from the picture's middle.
    arm = Top(0.515, (0.0254, 0.0254 + 0.06)[side > 0] - 0.03, 0.21, (0.03, 0.03), (40, 40, 40))
    found = wrapper(*opened(0.0), arm)
    assert found.hinge == pytest.approx(HINGE, abs=0.003)
    assert found.yaw == pytest.approx(0.0, abs=0.05)


def test_a_folded_plate_is_seen_by_its_slope() -> None:
    # Plate B is folded up by 0.5 rad: its middle is nearer to the hinge and higher, and it looks shorter.
    fold = 0.5
    b = plate(
        -HINGE_TO_PLATE * cos(fold),
        GLAZE,
        0.0,
        z=HINGE[2] + HINGE_TO_PLATE * sin(fold) + PLATE_HALF[2] * cos(fold),
        half=(PLATE_HALF[0] * cos(fold), PLATE_HALF[1]),
        slope=float(np.tan(fold)),
    )
    found = wrapper(plate(HINGE_TO_PLATE, DOUGH, 0.0), b)
    assert found.fold == pytest.approx(fold, abs=0.06)
    assert found.yaw == pytest.approx(0.0, abs=0.05)


def test_a_wrapper_on_its_edge_has_no_fold_and_half_its_height() -> None:
    narrow = {"half": (0.006, PLATE_HALF[1]), "z": 0.05}
    a, b = plate(0.008, DOUGH, 0.0, **narrow), plate(-0.008, GLAZE, 0.0, **narrow)
    found = wrapper(a, b)
    assert found.fold is None
    assert found.hinge == pytest.approx((HINGE[0], HINGE[1], 0.025), abs=0.002)
    assert found.yaw == pytest.approx(0.0, abs=0.05)
    alone = wrapper(a)
    assert alone.fold is None
    assert alone.hinge == pytest.approx((HINGE[0] + 0.008, HINGE[1], 0.025), abs=0.002)
    assert abs(cos(alone.yaw)) == pytest.approx(1.0, abs=0.01)


def test_a_filling_is_green_and_located_by_its_top() -> None:
    found = seen(*opened(0.0), Top(0.55, -0.06, 0.067, (0.011, 0.011), GREEN, 0.3))[1]
    assert found == pytest.approx((0.55, -0.06, 0.067 - 0.017 / 2.0), abs=0.002)
    assert seen(*opened(0.0))[1] is None


def test_points_higher_than_20_cm_belong_to_the_arm() -> None:
    high = [top._replace(z=0.21) for top in (*opened(0.0), Top(0.55, -0.06, 0.067, (0.011, 0.011), GREEN))]
    assert seen(*high) == (None, None)


def test_a_few_pixels_are_no_plate() -> None:
    assert seen(plate(HINGE_TO_PLATE, DOUGH, 0.0, half=(0.002, 0.002)))[0] is None


# From the side.

SIDE = Camera(eye=(0.6, 0.0, 0.1), target=(0.5, 0.0, 0.1), field_of_view=60.0, width=100, height=100)
CLOSED = Wrapper((0.45, 0.0, 0.09), 0.0, pi)
"""Its plates reach from x = 0.451 to 0.493, and from z = 0.09 to 0.115."""


def filled(x: float, y: tuple[float, float], z: tuple[float, float], wrapper: Any = CLOSED) -> bool:
    """A side picture in which all is grey but a green patch at depth 0.6 - x."""
    depth = np.full((100, 100), 0.6 - x)
    points = point_cloud(depth, SIDE.eye, SIDE.target, SIDE.up, SIDE.field_of_view)
    green = (points[:, :, 1] > y[0]) & (points[:, :, 1] < y[1])
    green &= (points[:, :, 2] > z[0]) & (points[:, :, 2] < z[1])
    rgb = np.full((100, 100, 3), 128, np.uint8)
    rgb[green] = GREEN
    return bool(shows_filling(as_picture(SIDE, rgb, depth, "side"), wrapper))


def test_filling_shows_between_the_plates_and_none_outside() -> None:
    between, inside = (0.095, 0.11), (-0.01, 0.01)
    assert filled(0.47, inside, between)
    assert not filled(0.47, inside, (0.116, 0.13))
    assert not filled(0.47, inside, (0.07, 0.089))
    assert not filled(0.47, (0.0, 0.001), (0.1, 0.101))
    # Beyond the plates' sides and edges, up to 1 cm: it sticks out.
    assert not filled(0.47, (-0.01, 0.033), between)
    assert not filled(0.494, inside, between)
    # Farther off it is another filling.
    assert not filled(0.43, inside, between)


def test_the_wrapper_may_be_turned() -> None:
    turned = Wrapper((0.47, -0.02, 0.09), pi / 2.0, pi)
    assert filled(0.47, (-0.01, 0.01), (0.095, 0.11), turned)
    assert not filled(0.47, (-0.01, 0.01), (0.095, 0.11), turned._replace(hinge=(0.47, 0.03, 0.09)))


# What a wrapper and a filling are.


@pytest.mark.parametrize(
    ("fold", "is_closed"), [(None, True), (0.0, False), (2.79, False), (2.80, True), (pi, True)]
)
def test_a_wrapper_is_closed_from_160_degrees_on_or_on_its_edge(fold: float | None, is_closed: bool) -> None:
    assert CLOSED._replace(fold=fold).is_closed is is_closed


# Over the middle of a plate at (1.022, 2, 3), a filling of 17 mm rests at 3 + 3 mm + 8.5 mm.
@pytest.mark.parametrize(
    ("filling", "is_carried"),
    [
        ((1.022, 2.0, 3.0115), True),
        ((1.042, 2.0, 3.0115), True),
        ((1.044, 2.0, 3.0115), False),
        ((1.000, 2.0, 3.0115), False),
        ((1.022, 2.027, 3.0115), True),
        ((1.022, 2.029, 3.0115), False),
        ((1.022, 2.0, 3.017), True),
        ((1.022, 2.0, 3.018), False),
        ((1.022, 2.0, 3.005), False),
    ],
)
def test_a_plate_carries_a_filling_that_lies_over_it(filling: Vector3, is_carried: bool) -> None:
    assert Wrapper((1.0, 2.0, 3.0), 0.0, 0.0).carries(filling) is is_carried
    turned = Wrapper((1.0, 2.0, 3.0), pi / 2, 0.0)
    x, y, z = filling
    assert turned.carries((1.0 - (y - 2.0), 2.0 + (x - 1.0), z)) is is_carried


# Scenes, in which the wrapper is put and folded.


class Bench:
    """The scene `dumpling_bench`, with one wrapper and filling or two, and the perceiver that looks at it."""

    def __init__(self, seed: int = 3, *, second: bool = False) -> None:
        self.scene = Put("dumpling_bench", seed)
        if not second:
            self.scene.remove("wrapper_2", "filling_2")
        self.watched = Watched(
            "make_dumplings", "see_dumpling", {"press_position": PRESS, "pot_position": POT, "holding": False}
        )

    def put(
        self, hinge: Vector3, fold: float, yaw: float = 0.0, filling: Vector3 | None = (9.0, 9.0, 9.0)
    ) -> None:
        """Put the wrapper's hinge somewhere, and the filling on plate A, or somewhere."""
        turn = yaw_orientation(yaw)
        self.scene.poses["wrapper"] = Pose(to_world(Pose(hinge, turn), (HINGE_TO_PLATE, 0.0, 0.0)), turn)
        self.scene.joints["wrapper.fold"] = fold
        on_plate = to_world(self.scene.poses["wrapper"], (0.0, 0.0, PLATE_HALF[2] + 0.0085))
        self.scene.poses["filling"] = Pose(on_plate if filling is None else filling, turn)

    def look(self, time: float, camera: str = "overhead", force: float = 0.0) -> dict[str, Any]:
        found: dict[str, Any] = self.watched.see(
            time, self.scene.look(camera, time), samples={"press_force": [force, 0.0]}
        )
        return found


@pytest.mark.parametrize("seed", range(6))
def test_wrapper_and_filling_are_seen_where_they_are(seed: int) -> None:
    bench = Bench(seed)
    found, poses = bench.look(0.0), bench.scene.poses
    hinge = to_world(poses["wrapper"], (-HINGE_TO_PLATE, 0.0, 0.0))
    assert dist(found["wrapper_position"], hinge) < 0.003
    assert found["wrapper_yaw"] == pytest.approx(yaw_of(poses["wrapper"].orientation), abs=0.05)
    assert found["wrapper_fold"] == pytest.approx(0.0, abs=0.02)
    assert dist(found["filling_position"], poses["filling"].position) < 0.003
    assert (found["dough_on_workspace"], found["filling_on_workspace"], found["wrapper_aligned"]) == (
        False,
    ) * 3


@pytest.mark.parametrize(
    ("off", "yaw", "is_aligned", "is_dough_there"),
    [
        ((0.0, 0.0, 0.0), 0.0, True, True),
        ((0.006, 0.008, 0.0), 0.10, True, True),
        ((-0.011, 0.0, 0.0), 0.0, False, True),
        ((0.0, -0.013, 0.0), 0.0, False, True),
        ((0.0, 0.0, -0.009), 0.0, False, True),
        ((0.0, 0.0, 0.0), -0.18, False, True),
        ((0.0, 0.037, 0.012), 0.0, False, True),
        ((0.033, 0.033, 0.0), 0.0, False, False),
        ((0.0, 0.0, 0.019), 0.0, False, False),
    ],
)
def test_a_wrapper_is_aligned_with_the_press_or_only_on_it(
    off: Vector3, yaw: float, is_aligned: bool, is_dough_there: bool
) -> None:
    bench = Bench()
    bench.scene.remove("press")
    bench.put(add(PRESS, off), 0.0, yaw)
    found = bench.look(0.0)
    assert (found["wrapper_aligned"], found["dough_on_workspace"]) == (is_aligned, is_dough_there)
    assert found["filling_position"] is None


def closed_dumpling(force: float = 3.1) -> Bench:
    """A filled wrapper that was closed and pressed, and looked at from above and from the side."""
    bench = Bench()
    bench.put(PRESS, 0.0, filling=None)
    assert bench.look(0.0)["filling_on_workspace"] is True
    bench.put(PRESS, pi, filling=None)
    assert bench.look(1.0, force=force)["filling_on_workspace"] is True
    bench.look(2.0, "side")
    return bench


def test_an_open_wrapper_shows_if_there_is_a_filling_on_it() -> None:
    for filling, is_there in ((None, True), ((0.36, 0.24, 0.0595), False), ((9.0, 9.0, 9.0), False)):
        bench = Bench()
        bench.put(PRESS, 0.0, filling=filling)
        assert bench.look(0.0)["filling_on_workspace"] is is_there


def test_a_picture_without_a_wrapper_says_nothing_of_it() -> None:
    bench = Bench()
    bench.put(PRESS, 0.0, filling=(0.36, 0.24, 0.0595))
    bench.look(0.0)
    bench.scene.remove("wrapper")
    found = bench.look(1.0)
    assert found["filling_position"] is not None
    for name in UNSEEN:
        if not name.startswith(
            (
                "filling_position",
                "filling_yaw",
                "filling_has_room",
                "filling_free_across",
                "press_free",
                "pot_",
                "aside",
                "bench_hidden",
                "wrappers_suffice",  # a wrapper is lost once two pictures miss it
                "fillings_suffice",
            )
        ):
            assert found[name] is None
    assert (found["dumpling_wrapped"], bench.watched.answer["dumpling_wrapped"].time) == (False, 0.0)


@pytest.mark.parametrize(("force", "is_wrapped"), [(3.1, True), (3.0, False)])
def test_a_dumpling_is_wrapped_if_it_is_closed_filled_and_was_pressed(force: float, is_wrapped: bool) -> None:
    assert closed_dumpling(force).watched.answer["dumpling_wrapped"].value is is_wrapped


def test_an_empty_or_open_wrapper_is_no_dumpling() -> None:
    for fold, filling in ((pi, (9.0, 9.0, 9.0)), (0.0, None)):
        bench = Bench()
        bench.put(PRESS, fold, filling=filling)
        bench.look(0.0, force=3.1)
        assert bench.look(1.0, "side")["dumpling_wrapped"] is False


def test_a_filling_that_sticks_out_after_the_lid_has_pressed_twice_spoils_the_wrapper() -> None:
    bench = Bench(second=True)
    bench.put(PRESS, 0.0, filling=None)
    bench.look(0.0)
    bench.put(PRESS, pi, filling=add(PRESS, (HINGE_TO_PLATE + 0.015, 0.0, 0.012)))
    for at, (is_supplied, number) in ((1.0, (True, 0)), (3.0, (False, 1))):
        bench.look(at, force=3.1)
        assert bench.look(at + 0.5, "side")["dumpling_wrapped"] is False
        assert bench.look(at + 1.0)["wrappers_shut"] == number
        assert bench.watched.answer["dough_on_workspace"].value is is_supplied
    assert bench.watched.answer["wrappers_suffice"].value is True, "there is another one"


def test_a_dumpling_that_opens_is_no_longer_wrapped_and_was_not_pressed() -> None:
    bench = closed_dumpling()
    assert bench.look(3.0)["dumpling_wrapped"] is True
    bench.put(PRESS, 0.0, filling=None)
    assert bench.look(4.0)["dumpling_wrapped"] is False
    bench.put(PRESS, pi, filling=None)
    bench.look(5.0)
    assert bench.look(6.0, "side")["dumpling_wrapped"] is False


def test_a_wrapped_dumpling_is_supplied_wherever_it_is() -> None:
    bench = closed_dumpling()
    bench.put((0.4, -0.1, 0.003), pi, filling=None)
    assert bench.look(3.0)["dough_on_workspace"] is True
    fresh = Bench()
    fresh.put((0.4, -0.1, 0.003), pi, filling=None)
    assert fresh.look(0.0)["dough_on_workspace"] is False


IN_POT = (0.528, 0.33, 0.009)


def test_a_wrapped_dumpling_is_cooked_after_5_s_in_the_pot() -> None:
    bench = closed_dumpling()
    bench.put(IN_POT, pi, filling=None)
    assert [bench.look(at)["dumpling_cooked"] for at in (10.0, 14.9, 15.0)] == [False, False, True]
    bench.put(PRESS, pi, filling=None)
    assert bench.look(16.0)["dumpling_cooked"] is True
    raw = Bench()
    raw.put(IN_POT, pi, filling=None)
    assert [raw.look(at)["dumpling_cooked"] for at in (10.0, 20.0)] == [False, False]


def test_cooking_starts_anew_after_a_look_outside_the_pot() -> None:
    bench = closed_dumpling()
    cooked = []
    for at, hinge in ((10.0, IN_POT), (12.0, PRESS), (13.0, IN_POT), (17.0, IN_POT), (18.0, IN_POT)):
        bench.put(hinge, pi, filling=None)
        cooked.append(bench.look(at)["dumpling_cooked"])
    assert cooked == [False, False, False, False, True]


@pytest.mark.parametrize(
    ("place", "is_inside"),
    [
        ((0.55, 0.33, 0.02), True),
        ((0.629, 0.33, 0.02), True),
        ((0.631, 0.33, 0.02), False),
        ((0.55, 0.414, 0.02), True),
        ((0.55, 0.416, 0.02), False),
        ((0.55, 0.33, 0.054), True),
        ((0.55, 0.33, 0.056), False),
        ((0.55, 0.33, 0.004), False),
    ],
)
def test_the_pot_is_from_its_floor_to_its_opening(place: Vector3, is_inside: bool) -> None:
    assert is_in_pot(place, POT) is is_inside
    assert is_in_pot(place, None) is False


@pytest.mark.parametrize(
    ("away", "is_settled"), [(0.0, True), (0.066, True), (0.072, False), (-0.072, False)]
)
def test_a_dumpling_that_may_lean_at_the_pot_from_outside_is_not_settled_in_it(
    away: float, is_settled: bool
) -> None:
    x, y, z = POT
    place = (x, y + away, z - 0.02)
    assert is_in_pot(place, POT)
    assert is_in_pot(place, POT, LEANING) is is_settled


def test_neither_grip_nor_push_leads_through_the_side_of_the_pot() -> None:
    rim = with_rim(KnownBench(), np.empty((0, 3)))
    assert len(rim) == 0, "no pot is known"
    rim = with_rim(KnownBench(pot=POT), np.empty((0, 3)))
    x, y, z = POT
    # Fingers that close along the pot's side, on it and clear of it.
    for away, is_free in ((0.0825, False), (0.12, True)):
        assert has_room(rim, (x, y - away, z - 0.02), pi / 2.0) is is_free


@pytest.mark.parametrize(
    ("lid", "height", "is_covered"),
    [
        ((0.20, 0.21), 0.095, True),  # a box on the pot
        ((0.20, 0.21), 0.065, False),  # the pot's own edges, and a dumpling that leans at them
        ((0.07, 0.21), 0.095, False),  # it leaves room for a dumpling beside it
        ((0.0, 0.0), 0.095, False),
    ],
)
def test_a_pot_is_covered_if_no_dumpling_can_be_let_go_over_it(
    lid: tuple[float, float], height: float, *, is_covered: bool
) -> None:
    x, y = (np.arange(-half / 2.0, half / 2.0, 0.003) for half in lid)
    u, v = np.meshgrid(POT[0] + 0.03 * (lid[0] < 0.1) + x, POT[1] + y)
    points = np.stack((u.ravel(), v.ravel(), np.full(u.size, height)), axis=1)
    found = pot_values(KnownBench(pot=POT, surroundings=points))
    assert found["pot_covered"] == (is_covered,)
    wrapper = Wrapper((POT[0] - HINGE_TO_PLATE, POT[1], height), 0.0, pi)
    small = points[np.hypot(points[:, 0] - POT[0], points[:, 1] - POT[1]) < 0.05]
    on_edge = KnownBench(pot=POT, surroundings=small, pieces=(Piece(wrapper),))
    assert pot_values(on_edge)["pot_covered"] == (False,)


@pytest.mark.parametrize(
    ("half", "height", "is_covered"),
    [
        (0.03, 0.1, True),
        (0.05, 0.07, True),
        (0.02, 0.05, False),  # over the wrapper, as one that stands on its edge
        (0.05, 0.04, False),  # no higher than a wrapper that lies on a filling
    ],
)
def test_wrappers_and_fillings_do_not_cover_the_press(half: float, height: float, is_covered: bool) -> None:
    x, y = np.meshgrid(np.arange(-half, half, 0.003), np.arange(-half, half, 0.003))
    box = np.stack((PRESS[0] + x.ravel(), PRESS[1] + y.ravel(), np.full(x.size, PRESS[2] + height)), axis=1)
    pieces = (Piece(Wrapper((PRESS[0] - HINGE_TO_PLATE, PRESS[1], PRESS[2]), 0.0, 0.0)),)
    bench = KnownBench(pot=POT, press=PRESS, surroundings=box, pieces=pieces, is_lid_open=True)
    found = covered_values(bench)
    assert (found["press_covered"], found["place_covered"]) == ((is_covered,), (is_covered,))
    assert ("covered_place" in found) == is_covered
    beside = replace(bench, surroundings=box + np.array((0.0, 0.2, 0.0)))
    assert covered_values(beside)["press_covered"] == (False,)
    # Where the lid stands in the picture, nothing is known of the press.
    assert not {"press_covered", "place_covered"} & covered_values(replace(bench, is_lid_open=False)).keys()


@pytest.mark.parametrize(("angle", "is_open"), [(0.0, True), (10.0, True), (20.0, False), (90.0, False)])
def test_a_lid_that_may_cover_the_press_itself_is_not_open(angle: float, is_open: bool) -> None:
    to_handle, at_rest = 0.0758, 8.3  # from the hinge, m and degrees
    turned = (angle + at_rest) * pi / 180.0
    handle = (PRESS[0] - to_handle * cos(turned), PRESS[1], PRESS[2] + to_handle * sin(turned))
    samples: dict[str, tuple[Any, ...]] = {"press_force": ()}
    view = View(0.0, {}, {"press_position": PRESS, "press_handle_position": handle}, samples)
    assert with_press(KnownBench(), view).is_lid_open is is_open
    assert not with_press(KnownBench(is_lid_open=True), View(0.0, {}, {}, samples)).is_lid_open


def test_each_value_has_the_time_of_the_picture_that_shows_it() -> None:
    bench = closed_dumpling()
    times = {name: one.time for name, one in bench.watched.answer.items() if one is not None}
    assert times.pop("dumpling_wrapped") == 2.0
    assert set(times.values()) == {1.0}
    assert isinstance(bench.watched.pictures["side"], Picture)


@pytest.mark.parametrize("seed", [1, 2])
def test_a_wrapper_that_is_missed_may_be_behind_a_high_box_or_in_the_dark(seed: int) -> None:
    picture = Put("dumpling_bench", seed).look("overhead")
    points, lift = level_points(picture)
    assert lift is not None
    assert find_hidden_place(points, picture.rgb.astype(np.float64), lift) is None, (
        "stands, press and pot hide no wrapper"
    )
    x, y = 0.6, -0.3
    hides = (np.abs(points[:, :, 0] - x) < 0.04) & (np.abs(points[:, :, 1] - y) < 0.04)
    dark = np.where(hides[:, :, None], picture.rgb / 4.0, picture.rgb)
    in_shade = find_hidden_place(points, dark, lift)
    points[hides, 2] = 0.3
    place = find_hidden_place(points, picture.rgb.astype(np.float64), lift)
    for one in (place, in_shade):
        assert one is not None
        assert dist(one[:2], (x, y)) < 0.02
    seen_once = Piece(CLOSED, looks=3)
    for pieces, hidden, suffice in (
        ((seen_once,), place, (True,)),
        ((replace(seen_once, unseen=2),), place, None),
        ((replace(seen_once, unseen=2),), None, (False,)),
        ((), place, None),
        ((), None, (False,)),
    ):
        values = remaining_values(KnownBench(pieces=pieces, hidden_place=hidden))
        assert values.get("wrappers_suffice") == suffice
        assert values["bench_hidden"] == (hidden is not None,)


# Two dumplings.


def cooked_with_another() -> Bench:
    """A bench for two, on which the first dumpling is cooked."""
    bench = Bench(second=True)
    bench.look(0.0)
    bench.put(PRESS, 0.0, filling=None)
    assert bench.look(1.0)["filling_on_workspace"] is True
    bench.put(PRESS, pi, filling=None)
    bench.look(2.0, force=3.1)
    assert bench.look(3.0, "side")["dumpling_wrapped"] is True
    bench.put(IN_POT, pi, filling=None)
    assert bench.look(10.0)["dumplings_cooked"] == 0
    assert bench.look(15.0)["dumplings_cooked"] == 1
    return bench


@pytest.mark.parametrize("seed", range(4))
def test_the_first_wrapper_that_is_chosen_stays_chosen_until_one_is_on_the_press(seed: int) -> None:
    bench = Bench(seed, second=True)
    first = bench.look(0.0)["wrapper_position"]
    hinges = {
        name: to_world(bench.scene.poses[name], (-HINGE_TO_PLATE, 0.0, 0.0))
        for name in ("wrapper", "wrapper_2")
    }
    chosen = min(hinges, key=lambda name: dist(hinges[name], first))
    assert dist(first, hinges[chosen]) < 0.004
    assert dist(bench.look(1.0)["wrapper_position"], first) < 0.004
    bench.scene.put(chosen, 0.522, 0.0, 0.083)
    assert dist(bench.look(2.0)["wrapper_position"], PRESS) < 0.004


def test_a_filling_that_a_closed_wrapper_hides_is_inside_though_another_is_seen() -> None:
    bench = Bench(second=True)
    bench.look(0.0)
    bench.put(PRESS, pi, filling=None)
    assert bench.look(1.0)["filling_on_workspace"] is True
    # Both fillings are seen beside a closed wrapper: it is empty.
    bench.put(PRESS, pi, filling=(0.36, 0.24, 0.0595))
    assert bench.look(2.0)["filling_on_workspace"] is False


def test_after_a_cooked_dumpling_the_next_wrapper_is_worked_on() -> None:
    bench = cooked_with_another()
    found, poses = bench.look(16.0), bench.scene.poses
    assert (found["dumpling_cooked"], found["dumplings_cooked"], found["dumpling_wrapped"]) == (
        True,
        1,
        False,
    )
    assert (found["dough_on_workspace"], found["filling_on_workspace"]) == (False, False)
    hinge = to_world(poses["wrapper_2"], (-HINGE_TO_PLATE, 0.0, 0.0))
    assert dist(found["wrapper_position"], hinge) < 0.004
    assert dist(found["filling_position"], poses["filling_2"].position) < 0.004


def test_a_second_dumpling_beside_the_first_is_counted_and_then_no_wrapper_is_left() -> None:
    bench = cooked_with_another()
    scene = bench.scene
    scene.put("wrapper_2", PRESS[0] + HINGE_TO_PLATE, PRESS[1], PRESS[2])
    scene.put("filling_2", PRESS[0] + HINGE_TO_PLATE, PRESS[1], PRESS[2] + PLATE_HALF[2] + 0.0085)
    assert bench.look(20.0)["filling_on_workspace"] is True
    scene.joints["wrapper_2.fold"] = pi
    bench.look(21.0, force=3.1)
    assert bench.look(22.0, "side")["dumpling_wrapped"] is True
    scene.put("wrapper_2", 0.55 + 0.045, 0.33, 0.009)
    scene.put("filling_2", 0.55 + 0.045, 0.33, 0.0205)
    assert [bench.look(at)["dumplings_cooked"] for at in (30.0, 34.9, 35.0)] == [1, 1, 2]
    found = bench.look(36.0)
    assert (found["dumplings_cooked"], found["wrapper_position"]) == (2, None)


# Knocked about.


def test_a_dumpling_whose_filling_is_seen_elsewhere_is_empty_for_good() -> None:
    bench = closed_dumpling()
    bench.put(IN_POT, pi, filling=None)
    assert bench.look(10.0)["dumpling_wrapped"] is True
    bench.put(IN_POT, pi, filling=(0.50, 0.36, 0.0135))
    found = bench.look(11.0)
    assert (found["dumpling_wrapped"], found["filling_on_workspace"]) == (False, False)
    assert (found["wrappers_shut"], found["wrappers_suffice"], found["fillings_lost"]) == (1, False, 0)
    # The wrapper hides the filling in the pot: it is none the fuller for that.
    bench.put(IN_POT, pi, filling=None)
    for at in (12.0, 18.0, 24.0):
        found = bench.look(at)
        assert (found["dumpling_wrapped"], found["dumpling_cooked"]) == (False, False)


def test_a_dumpling_that_moved_in_the_pot_cooks_anew() -> None:
    bench = closed_dumpling()
    cooked = []
    for at, x in ((10.0, 0.528), (15.5, 0.545), (20.0, 0.545), (20.5, 0.545)):
        bench.put((x, 0.33, 0.009), pi, filling=None)
        cooked.append(bench.look(at)["dumpling_cooked"])
    assert cooked == [False, False, False, True]


def test_a_dumpling_that_two_pictures_miss_is_lost_and_the_other_wrapper_is_worked_on() -> None:
    bench = Bench(second=True)
    bench.look(0.0)
    bench.put(PRESS, 0.0, filling=None)
    assert dist(bench.look(1.0)["wrapper_position"], PRESS) < 0.004
    bench.scene.remove("wrapper", "filling")
    found = bench.look(2.0)
    assert (found["wrapper_position"], found["wrappers_lost"], found["fillings_lost"]) == (None, 0, 1)
    found, poses = bench.look(3.0), bench.scene.poses
    assert dist(found["wrapper_position"], to_world(poses["wrapper_2"], (-HINGE_TO_PLATE, 0.0, 0.0))) < 0.004
    assert (found["wrappers_lost"], found["wrappers_suffice"], found["fillings_suffice"]) == (1, True, True)
    assert dist(found["wrapper_last_seen"], PRESS) < 0.004
    bench.watched.readings["count"] = 2
    found = bench.look(4.0)
    assert (found["wrappers_suffice"], found["fillings_suffice"]) == (False, False)
    bench.watched.readings["holding"] = True
    found = bench.look(5.0)
    assert (found["wrappers_suffice"], found["fillings_suffice"]) == (True, True), "the hand holds one"
    bench.watched.readings["finger_gap"] = 0.023
    found = bench.look(6.0)
    assert (found["wrappers_suffice"], found["fillings_suffice"]) == (False, True), "it holds a filling"


def test_a_wrapper_that_stays_open_under_the_lid_twice_does_not_fold() -> None:
    bench = Bench()
    bench.watched.readings["press_handle_position"] = (0.425, 0.0, 0.094)
    bench.put(PRESS, 0.0)
    assert bench.look(0.0)["wrappers_not_folding"] == 0
    for at, (is_useful, number) in ((1.0, (True, 0)), (2.0, (False, 1))):
        bench.watched.readings["press_handle_position"] = (0.575, 0.0, 0.094)
        bench.watched.see(at - 0.5, samples={"press_force": []})
        bench.watched.readings["press_handle_position"] = (0.425, 0.0, 0.094)
        found = bench.look(at)
        assert (found["wrappers_suffice"], found["wrappers_not_folding"]) == (is_useful, number)


def test_both_wrappers_and_both_fillings_are_known_things() -> None:
    bench = Bench(second=True)
    found, poses = bench.look(0.0), bench.scene.poses
    hinges = [to_world(poses[name], (-HINGE_TO_PLATE, 0.0, 0.0)) for name in ("wrapper", "wrapper_2")]
    seen = [found["wrapper_position"], found["other_wrapper_position"]]
    fillings = [found["filling_position"], found["other_filling_position"]]
    for places, known in (
        (hinges, seen),
        ([poses[one].position for one in ("filling", "filling_2")], fillings),
    ):
        assert all(min(dist(place, one) for one in known) < 0.004 for place in places)


def alone(filling: Vector3) -> dict[str, Any]:
    """Values seen of a bench with a filling, a stand at (0.45, 0.15) and the pot."""
    bench = Bench()
    bench.scene.remove("wrapper", "tray", "tray_2", "stand_2", "press")
    bench.scene.put("stand", 0.45, 0.15, 0.025)
    bench.put((9.0, 9.0, 9.0), 0.0, filling=filling)
    return bench.look(0.0)


def test_a_hand_turns_or_pushes_where_something_is_in_its_way() -> None:
    free = alone((0.45, -0.1, 0.0085))
    assert (free["filling_has_room"], free["filling_yaw"], free["push_start"]) == (True, 0.0, None)
    # The stand is 50 mm high, and hands are 40 mm over what they grip on the bench: 20 cm wide, 7 cm thick.
    beside = alone((0.45, 0.07, 0.0085))
    assert beside["filling_has_room"] is True
    assert abs(beside["filling_yaw"]) == pytest.approx(pi / 2.0, abs=0.1)
    between = alone((0.46, 0.185, 0.0085))
    assert between["filling_has_room"] is False
    start, end = between["push_start"], between["push_end"]
    assert dist(start, (0.46, 0.185, 0.02)) < 0.05
    assert dist(start, end) > 0.03
    # Near the arm there is room, too, as far as the arm reaches.
    assert alone((0.33, 0.0, 0.0085))["filling_has_room"] is True
    assert alone((0.25, 0.0, 0.0085))["fillings_out_of_reach"] == 1


def test_a_wrapper_beside_the_press_is_another_one() -> None:
    for fold in (0.0, pi):
        bench = Bench(second=True)
        bench.look(0.0)
        bench.put(PRESS, fold, filling=None)
        bench.scene.put("wrapper_2", 0.545, 0.062, 0.003)
        found = bench.look(1.0)
        assert dist(found["wrapper_position"], PRESS) < 0.005
        assert dist(found["other_wrapper_position"], (0.545 - HINGE_TO_PLATE, 0.062, 0.003)) < 0.005


def test_the_filling_on_the_wrapper_comes_before_one_that_lies_below_the_press() -> None:
    bench = Bench(second=True)
    laid = (PRESS[0] + HINGE_TO_PLATE, PRESS[1], PRESS[2] + PLATE_HALF[2] + 0.0085)
    bench.put(PRESS, 0.0, filling=laid)
    bench.scene.put("filling_2", PRESS[0] + 0.012, PRESS[1] + 0.044, 0.0085)
    found = bench.look(0.0)
    assert dist(found["filling_position"], laid) < 0.005
    assert found["filling_on_workspace"] is True


def test_a_filling_far_below_a_wrapper_is_not_in_it() -> None:
    wrapper = Wrapper(PRESS, 0.0, pi)
    x, y, z = wrapper.middle
    assert is_near((x, y, z + 0.01), wrapper)
    assert not is_near((x, y, z - 0.075), wrapper)


def on_its_side(place: Vector3, *, second: bool) -> dict[str, Any]:
    """Values seen of a wrapper on the press, with a filling at `place` that lies on its side."""
    bench = Bench(second=second)
    bench.put(PRESS, 0.0, filling=None)
    bench.scene.poses["filling"] = Pose(place, (0.5**0.5, 0.0, 0.0, 0.5**0.5))
    return bench.look(0.0)


def test_a_filling_on_its_side_gives_way_to_one_that_lies_flat() -> None:
    # It is 22 mm by 22 mm by 17 mm.
    laid = (PRESS[0] + HINGE_TO_PLATE, PRESS[1], PRESS[2] + PLATE_HALF[2] + 0.011)
    found = on_its_side(laid, second=True)
    assert (found["press_free"], found["blocker_is_filling"]) == (False, True)
    assert dist(found["blocker_position"], laid) < 0.005
    assert dist(found["filling_position"], laid) > 0.1
    # It is better than none.
    alone_there = on_its_side(laid, second=False)
    assert alone_there["press_free"] is True
    assert dist(alone_there["filling_position"], laid) < 0.005
    beside = (0.40, 0.10, 0.011)
    assert dist(on_its_side(beside, second=True)["filling_position"], beside) > 0.1


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("yaw", [0.0, 0.4, -0.7])
def test_the_heading_of_a_filling_of_few_pixels_is_no_stray_one(yaw: float, seed: int) -> None:
    # A filling of 7 by 7 points, 3 mm apart, some of them a point off.
    chance = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(np.arange(-12, 13), np.arange(-12, 13)), axis=-1).reshape(-1, 2) * 0.003
    c, s = cos(yaw), sin(yaw)
    inside = (np.abs(grid @ np.array(((c, -s), (s, c)))) < 0.011).all(axis=1)
    points = np.column_stack((grid[inside], np.full(inside.sum(), 0.06)))
    points[chance.integers(len(points))] += (0.003, -0.003, 0.0)
    off = square_heading(points) - yaw
    assert abs((off + pi / 4.0) % (pi / 2.0) - pi / 4.0) < 0.15


@pytest.mark.parametrize("scale", [0.85, 1.2])
@pytest.mark.parametrize("is_open", [True, False])
def test_the_size_of_a_wrapper_is_measured(scale: float, is_open: bool) -> None:
    tops = opened(0.3) if is_open else [plate(HINGE_TO_PLATE, GLAZE, 0.3)]
    x, y, z = HINGE
    larger = [
        one._replace(
            x=x + (one.x - x) * scale,
            y=y + (one.y - y) * scale,
            z=z + scale * (PLATE_HALF[2] if is_open else CLOSED_HEIGHT),
            half=(one.half[0] * scale, one.half[1] * scale),
        )
        for one in tops
    ]
    found = wrapper(*larger)
    assert found.scale == pytest.approx(scale, abs=0.05)
    assert found.hinge == pytest.approx(HINGE, abs=0.003)
    half = (0.043, 0.028) if is_open else PLATE_HALF[:2]
    assert found.half == pytest.approx((scale * half[0], scale * half[1]), abs=0.003)


def test_the_size_of_a_half_hidden_wrapper_is_not_known() -> None:
    assert wrapper(plate(HINGE_TO_PLATE, DOUGH, 0.3, half=(PLATE_HALF[0], 0.6 * PLATE_HALF[1]))).scale is None
    assert wrapper(*opened(0.3)).scale == 1.0


@pytest.mark.parametrize(("scale", "left_over"), [(1.1, 0), (1.2, 1)])
def test_a_wrapper_that_the_press_does_not_close_over_is_given_up(scale: float, left_over: int) -> None:
    sized = Wrapper(HINGE, 0.0, 0.0, scale)
    bench = KnownBench(pieces=(Piece(sized, looks=2),))
    values = remaining_values(bench)
    assert values["wrappers_too_large"] == (left_over,)
    assert values["wrappers_suffice"] == (left_over == 0,)
