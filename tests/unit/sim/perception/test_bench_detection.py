"""Drawn pictures of the bench: a wrapper flat, closed, half hidden or on its edge, and its filling."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np
import pytest

from aeros.sim.bullet.renderer import Image
from aeros.sim.geometry import Camera
from aeros.sim.layouts.dumpling_bench import CLOSED_HEIGHT, HINGE_TO_PLATE, PLATE_HALF, WrapperDetection
from aeros.sim.perception.bench_detection import BenchDetection, detect_bench, is_filling_visible
from aeros.sim.perception.detection import camera_points
from tests.unit.sim.perception.drawn import Top, draw

CAMERA = Camera(eye=(0.5, 0.0, 1.0), target=(0.5, 0.0, 0.0), up=(1.0, 0.0, 0.0), field_of_view=16.0)
"""1.2 mm a pixel."""

DOUGH, GLAZE, GREEN = (220, 200, 80), (200, 115, 60), (60, 180, 70)
HINGE = (0.48, 0.03, 0.063)
"""Of a wrapper whose plates are 3 mm thick to each side of it."""


def plate(along: float, colour: tuple[int, int, int], yaw: float, **more: float) -> Top:
    """A plate with its middle this far from the hinge along the wrapper's heading."""
    x, y = HINGE[0] + along * cos(yaw), HINGE[1] + along * sin(yaw)
    top = Top(x, y, HINGE[2] + PLATE_HALF[2], PLATE_HALF[:2], colour, yaw)
    return top._replace(**more)  # type: ignore[arg-type]


def opened(yaw: float) -> list[Top]:
    return [plate(HINGE_TO_PLATE, DOUGH, yaw), plate(-HINGE_TO_PLATE, GLAZE, yaw)]


def seen(*tops: Top) -> BenchDetection:
    return detect_bench(draw(CAMERA, tops), CAMERA)


def wrapper(*tops: Top) -> WrapperDetection:
    found = seen(*tops).wrapper
    assert found is not None
    return found


def test_an_empty_bench_shows_nothing() -> None:
    assert seen() == BenchDetection(None, None)


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


def test_a_wrapper_with_a_hidden_upper_plate_is_detected_by_the_lower_one() -> None:
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
        half=(PLATE_HALF[0] * cos(fold), PLATE_HALF[1]),  # type: ignore[arg-type]
        slope=float(np.tan(fold)),
    )
    found = wrapper(plate(HINGE_TO_PLATE, DOUGH, 0.0), b)
    assert found.fold == pytest.approx(fold, abs=0.06)
    assert found.yaw == pytest.approx(0.0, abs=0.05)


def test_a_wrapper_on_its_edge_has_no_fold_and_half_its_height() -> None:
    narrow = {"half": (0.006, PLATE_HALF[1]), "z": 0.05}
    a, b = plate(0.008, DOUGH, 0.0, **narrow), plate(-0.008, GLAZE, 0.0, **narrow)  # type: ignore[arg-type]
    found = wrapper(a, b)
    assert found.fold is None
    assert found.hinge == pytest.approx((HINGE[0], HINGE[1], 0.025), abs=0.002)
    assert found.yaw == pytest.approx(0.0, abs=0.05)
    alone = wrapper(a)
    assert alone.fold is None
    assert alone.hinge == pytest.approx((HINGE[0] + 0.008, HINGE[1], 0.025), abs=0.002)
    assert abs(cos(alone.yaw)) == pytest.approx(1.0, abs=0.01)


def test_a_filling_is_green_and_located_by_its_top() -> None:
    found = seen(*opened(0.0), Top(0.55, -0.06, 0.067, (0.011, 0.011), GREEN, 0.3)).filling
    assert found == pytest.approx((0.55, -0.06, 0.067 - 0.017 / 2.0), abs=0.002)
    assert seen(*opened(0.0)).filling is None


def test_points_higher_than_20_cm_belong_to_the_arm() -> None:
    high = [top._replace(z=0.21) for top in (*opened(0.0), Top(0.55, -0.06, 0.067, (0.011, 0.011), GREEN))]
    assert seen(*high) == BenchDetection(None, None)


def test_a_few_pixels_are_no_plate() -> None:
    assert seen(plate(HINGE_TO_PLATE, DOUGH, 0.0, half=(0.002, 0.002))).wrapper is None  # type: ignore[arg-type]


# From the side.

SIDE = Camera(eye=(0.6, 0.0, 0.1), target=(0.5, 0.0, 0.1), field_of_view=60.0, width=100, height=100)
CLOSED = WrapperDetection((0.45, 0.0, 0.09), 0.0, pi)
"""Its plates reach from x = 0.451 to 0.493, and from z = 0.09 to 0.115."""


def filled(
    x: float, y: tuple[float, float], z: tuple[float, float], wrapper: WrapperDetection = CLOSED
) -> bool:
    """A side picture in which all is grey but a green patch at depth 0.6 - x."""
    depth = np.full((100, 100), 0.6 - x)
    points = camera_points(depth, SIDE)
    green = (points[:, :, 1] > y[0]) & (points[:, :, 1] < y[1])
    green &= (points[:, :, 2] > z[0]) & (points[:, :, 2] < z[1])
    rgb = np.full((100, 100, 3), 128, np.uint8)
    rgb[green] = GREEN
    return is_filling_visible(Image(rgb, depth), SIDE, wrapper)


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
    turned = WrapperDetection((0.47, -0.02, 0.09), pi / 2.0, pi)
    assert filled(0.47, (-0.01, 0.01), (0.095, 0.11), turned)
    assert not filled(0.47, (-0.01, 0.01), (0.095, 0.11), turned._replace(hinge=(0.47, 0.03, 0.09)))
