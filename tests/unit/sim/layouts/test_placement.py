"""Start poses: within their spreads, each drawn by itself, the same for the same seed."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.sim.geometry import to_world, yaw_of
from aeros.sim.layouts.placement import place_things
from aeros.sim.randomness import RandomSource
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.start_layouts import bench_layout, room_layout, table_layout


@given(st.integers(0, 10_000))
def test_a_room_is_drawn_within_its_spreads(seed: int) -> None:
    laid = room_layout(seed)
    x, y, z = laid.station
    assert abs(x + 0.05) <= 0.08
    assert abs(y - 2.40) <= 0.08
    assert z == 0.0
    pick, place = laid.stands
    assert pick == pytest.approx((x + 0.58, y, -0.1))
    # The can stands 1 mm over its stand of 0.4 m, with its middle 40 mm higher.
    assert abs(laid.can[0] - pick[0]) <= 0.05
    assert abs(laid.can[1] - pick[1]) <= 0.12
    assert laid.can[2] == pytest.approx(0.141)
    # The decoy stands on the other side of the stand's middle.
    assert laid.decoy == pytest.approx((pick[0], y - 0.17 if laid.can[1] > y else y + 0.17, 0.126))
    assert abs(laid.delivery[0] - 0.48) <= 0.05
    assert abs(laid.delivery[1] - 1.10) <= 0.05
    assert laid.delivery[2] == pytest.approx(0.14)
    assert place == pytest.approx((laid.delivery[0], laid.delivery[1], -0.1))


def test_each_seed_has_a_room_of_its_own() -> None:
    first, again, other = (room_layout(seed) for seed in (3, 3, 4))
    assert first == again
    for one, another in zip(first[:4], other[:4], strict=True):
        assert one[:2] != another[:2]
    # Station, can and delivery are drawn each by itself, in x and in y.
    off = [first.station[0] + 0.05, first.station[1] - 2.40]
    off += [first.can[0] - first.station[0] - 0.58, first.can[1] - first.station[1]]
    off += [first.delivery[0] - 0.48, first.delivery[1] - 1.10]
    assert len({round(one, 6) for one in off}) == 6


def test_draws_are_spread_to_both_sides() -> None:
    rooms = [room_layout(seed) for seed in range(40)]
    for values in zip(*(one.station[:2] for one in rooms), strict=True):
        assert max(values) - min(values) > 0.1


@given(st.integers(0, 10_000))
def test_a_table_is_laid_within_its_spreads(seed: int) -> None:
    laid = table_layout(seed)
    assert abs(laid.rest[0] - 0.45) <= 0.03
    assert abs(laid.rest[1] + 0.86) <= 0.03
    assert laid.rest[2] == pytest.approx(0.015)
    assert laid.sponge.position == pytest.approx((laid.rest[0], laid.rest[1], 0.016))
    assert abs(yaw_of(laid.sponge.orientation)) <= 0.1
    for pose, x, z, turn in ((laid.cube, 0.38, 0.021, 0.5), (laid.can, 0.56, 0.026, 1e-9)):
        assert abs(pose.position[0] - x) <= 0.03
        assert abs(pose.position[1] + 1.455) <= 0.03
        assert pose.position[2] == pytest.approx(z)
        assert abs(yaw_of(pose.orientation)) <= turn


def test_each_coordinate_of_a_table_is_drawn_by_itself() -> None:
    tables = [table_layout(seed) for seed in range(40)]
    assert tables[3] == table_layout(3)
    for one in tables[:5]:
        off = [one.rest[0] - 0.45, one.rest[1] - 0.34, one.cube.position[0] - 0.38]
        off += [one.cube.position[1] + 0.255, one.can.position[0] - 0.56, one.can.position[1] + 0.255]
        assert len({round(part, 6) for part in off}) == 6
    for turns, most in (
        ([yaw_of(one.sponge.orientation) for one in tables], 0.1),
        ([yaw_of(one.cube.orientation) for one in tables], 0.5),
    ):
        assert max(turns) > 0.6 * most
        assert min(turns) < -0.6 * most


@given(st.integers(0, 10_000))
def test_a_bench_is_laid_within_its_spreads(seed: int) -> None:
    laid = bench_layout(seed)
    x, y, z = laid.tray.position
    assert abs(x - 0.43) <= 0.03
    assert abs(y + 0.28) <= 0.03
    assert z == pytest.approx(0.03)
    turn = yaw_of(laid.tray.orientation)
    assert abs(turn) <= 0.4
    assert abs(yaw_of(laid.wrapper.orientation) - turn) <= 0.05 + 1e-9
    hinge = to_world(laid.wrapper, (-0.022, 0.0, 0.0))
    assert abs(hinge[0] - x) <= 0.003 + 1e-9
    assert abs(hinge[1] - y) <= 0.003 + 1e-9
    assert hinge[2] == pytest.approx(0.064)
    u, v, w = laid.stand.position
    assert abs(u - 0.36) <= 0.03
    assert abs(v - 0.24) <= 0.03
    assert w == pytest.approx(0.025)
    assert laid.filling.position == pytest.approx((u, v, 0.0595))
    assert abs(yaw_of(laid.filling.orientation)) <= 0.05


def test_each_coordinate_of_a_bench_is_drawn_by_itself() -> None:
    benches = [bench_layout(seed) for seed in range(40)]
    assert benches[3] == bench_layout(3)
    for one in benches[:5]:
        off = [
            one.tray.position[0] - 0.43,
            one.tray.position[1] + 0.28,
            one.stand.position[0] - 0.36,
            one.stand.position[1] - 0.24,
        ]
        assert len({round(part, 6) for part in off}) == 4
    tilts = [yaw_of(one.wrapper.orientation) - yaw_of(one.tray.orientation) for one in benches]
    for turns, most in (
        ([yaw_of(one.tray.orientation) for one in benches], 0.4),
        ([yaw_of(one.filling.orientation) for one in benches], 0.05),
        (tilts, 0.05),
    ):
        assert max(turns) > 0.6 * most
        assert min(turns) < -0.6 * most


def test_another_thing_changes_the_start_of_no_other() -> None:
    alone = shipped_scene("table")
    jug = replace(alone.bodies["cube"], name="jug")
    jug = replace(jug, placement=jug.placement._replace(stream="jug"))
    amid = replace(alone, bodies={"jug": jug, **alone.bodies})
    first, second = (place_things(scene, RandomSource(5)) for scene in (alone, amid))
    assert second.pop("jug").position[:2] != first["cube"].position[:2]
    assert second == first
