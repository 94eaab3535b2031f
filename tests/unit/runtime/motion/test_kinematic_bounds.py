"""Bounds of rates in time, worked out by hand for straight paths and one joint."""

from __future__ import annotations

from itertools import pairwise, product
from math import dist, hypot, pi, prod, sqrt

import pytest

from aeros.kinematic_chain import PRISMATIC
from aeros.runtime.motion.bezier import Piece, derivatives, split_in_half
from aeros.runtime.motion.kinematic_bounds import (
    TIMING_PEAKS,
    ForwardKinematics,
    MotionRates,
    add_rates,
    base_rates,
    is_c2_continuous,
    joint_rates,
    piece_speeds,
    rates_in_time,
    tool_rates,
)
from aeros.runtime.ports import RobotBody
from tests.unit.runtime.motions import at, body, chance_of, path, with_slides

HALF_METRE = RobotBody(((0.0, 0.0, 0.0),), (0.5, 0.0, 0.0), ())
"""One joint about z, whose tool is half a metre from it."""


SLIDE = RobotBody(((0.0, 0.0, 0.0, 0.0, PRISMATIC),), (0.5, 0.0, 0.0), ())
"""One joint that slides along z."""


def line(*ends: float) -> Piece:
    """From 0 to these, straight."""
    a, b, c, d = (tuple(end * third / 3.0 for end in ends) for third in range(4))
    return a, b, c, d


def near(speed: float, acceleration: float, jerk: float) -> object:
    """Up to the factor that covers rounding, which makes no bound smaller."""
    return pytest.approx((speed, acceleration, jerk), rel=1e-8)


def test_the_peaks_are_those_of_the_profile() -> None:
    def s(u: float) -> float:
        return 10.0 * u**3 - 15.0 * u**4 + 6.0 * u**5

    steps = [i / 1000.0 for i in range(1001)]
    first = [30.0 * u**2 - 60.0 * u**3 + 30.0 * u**4 for u in steps]
    second = [60.0 * u - 180.0 * u**2 + 120.0 * u**3 for u in steps]
    third = [60.0 - 360.0 * u + 360.0 * u**2 for u in steps]
    assert (s(0.0), s(1.0)) == (0.0, 1.0)
    for values, peak in zip((first, second, third), TIMING_PEAKS, strict=True):
        assert peak * (1.0 - 1e-5) <= max(map(abs, values)) <= peak


def test_a_straight_path_of_one_metre() -> None:
    assert rates_in_time(1.0, 0.0, 0.0, 1.0) == near(1.875, 10.0 / sqrt(3.0), 60.0)
    assert rates_in_time(1.0, 0.0, 0.0, 2.0) == near(0.9375, 2.5 / sqrt(3.0), 7.5)
    assert base_rates((3.0, 4.0, 0.0), 2.0) == near(4.6875, 12.5 / sqrt(3.0), 37.5)


def test_a_bend_of_the_path_adds_to_acceleration_and_jerk() -> None:
    assert rates_in_time(0.0, 1.0, 0.0, 1.0) == near(0.0, 1.875**2, 3.0 * 1.875 * 10.0 / sqrt(3.0))
    assert rates_in_time(0.0, 0.0, 1.0, 2.0) == near(0.0, 0.0, 0.9375**3)
    parts = [rates_in_time(*one, 2.0) for one in ((1.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 3.0))]
    assert rates_in_time(1.0, 2.0, 3.0, 2.0) == near(*(sum(column) for column in zip(*parts, strict=True)))


def test_bounds_are_never_below_the_exact_value() -> None:
    found = rates_in_time(1.0, 1.0, 1.0, 1.0)
    assert found.speed > 1.875
    assert found.acceleration > 1.875**2 + 5.7735026919
    assert found.jerk > 1.875**3 + 3.0 * 1.875 * 5.7735026919 + 60.0
    # A joint that slides straight: the bound by derivatives is exact but for rounding.
    (along,) = piece_speeds(SLIDE, (line(1.0),), 2.0)
    assert 0.9375 < along == pytest.approx(0.9375, rel=1e-8)


def test_rates_of_a_carried_point_add_up() -> None:
    assert add_rates(MotionRates(1.0, 2.0, 3.0), MotionRates(0.5, 0.25, 0.125)) == (1.5, 2.25, 3.125)


def test_joints_are_bounded_each_by_itself() -> None:
    first, second = joint_rates((line(1.0, -2.0),), 2.0)
    assert first == near(0.9375, 2.5 / sqrt(3.0), 7.5)
    assert second == near(1.875, 5.0 / sqrt(3.0), 15.0)


def test_the_number_of_pieces_does_not_change_a_straight_path() -> None:
    third = tuple(tuple((q + start,) for (q,) in line(1.0 / 3.0)) for start in (0.0, 1.0 / 3.0, 2.0 / 3.0))
    (found,) = joint_rates(third, 2.0)  # type: ignore[arg-type]
    assert found == near(0.9375, 2.5 / sqrt(3.0), 7.5)


def test_the_fastest_piece_counts_and_its_derivatives_scale_with_the_number_of_pieces() -> None:
    # 8x³ in the second of two pieces: by s, q' is at most 2·24, q'' 4·48 and q''' 8·48.
    cube: Piece = ((0.0,), (0.0,), (0.0,), (8.0,))
    (found,) = joint_rates((line(0.0), cube), 2.0)
    assert found == near(*rates_in_time(48.0, 192.0, 384.0, 2.0))


@pytest.mark.parametrize(
    ("second", "meets"),
    [
        ((3.0, 4.0, 5.0, 6.0), True),
        # The third derivative may jump.
        ((3.0, 4.0, 5.0, 9.0), True),
        ((3.1, 4.1, 5.1, 6.1), False),
        ((3.0, 4.1, 5.2, 6.3), False),
        ((3.0, 3.9, 4.8, 5.7), False),
        ((3.0, 4.0, 5.1, 6.0), False),
        ((3.0, 4.0, 4.9, 6.0), False),
        ((3.0, 4.0, 5.0 + 1e-10, 6.0), True),
        ((float("nan"), 4.0, 5.0, 6.0), False),
    ],
)
def test_pieces_meet_in_position_slope_and_bend(
    second: tuple[float, float, float, float], meets: bool
) -> None:
    a, b, c, d = ((0.0, q) for q in second)
    first = line(0.0, 3.0)
    assert is_c2_continuous((first, (a, b, c, d))) is meets


def test_seams_differ_by_no_more_than_rounding_explains() -> None:
    most = 1e-9
    still: Piece = ((0.0,),) * 4
    for place, slope, bend in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)):
        for size, meets in ((most, True), (-most, True), (1.01 * most, False), (-1.01 * most, False)):
            e = place * size
            f = e + slope * size
            g = f + slope * size + bend * size
            for seam in ((still, ((e,), (f,), (g,), (g,))), (((g,), (g,), (f,), (e,)), still)):
                assert is_c2_continuous(seam) is meets


@pytest.mark.parametrize("seed", range(12))
def test_on_a_short_path_the_bounds_are_the_exact_derivatives(seed: int) -> None:
    """By the path's parameter, compared with differences; the bounds exceed them by a share of the length."""
    chance, length = chance_of(seed), 1e-3
    robot = with_slides(body(chance), chance) if seed % 2 else body(chance)
    rows = [
        (chance.uniform(-1.0, 1.0), chance.uniform(-1.0, 1.0) * length, chance.uniform(-1.0, 1.0) * length**2)
        for _ in robot.dh_rows
    ]
    a, b, c, d = (
        tuple(q + slope * third / 3.0 + bend * share for q, slope, bend in rows)
        for third, share in enumerate((0.0, 0.0, 1.0 / 3.0, 1.0))
    )
    moving, turning = tool_rates(robot, ((a, b, c, d),), 1.0, 0.0)
    postures = [ForwardKinematics(robot, at(((a, b, c, d),), s)).frames[-1] for s in (0.0, 0.5, 1.0)]
    start, middle, end = ([*frame.to_base(robot.tool_offset)] for frame in postures)
    slope = hypot(*(y - x for x, y in zip(start, end, strict=True)))
    bend = 4.0 * hypot(*(x - 2.0 * y + z for x, y, z in zip(start, middle, end, strict=True)))
    # |ω|² is half the sum of the squared rates of the three axes.
    turn = sqrt(sum(dist(x, y) ** 2 for x, y in zip(postures[0][1:], postures[2][1:], strict=True)) / 2.0)
    peak, second_peak, _ = TIMING_PEAKS
    assert moving.speed / peak == pytest.approx(slope, rel=0.01)
    assert turning.speed / peak == pytest.approx(turn, rel=0.01)
    first = moving.speed / peak / (1.0 + 1e-9)
    second = (moving.acceleration / (1.0 + 1e-9) - first * second_peak) / peak**2
    assert second == pytest.approx(bend, rel=0.02)


@pytest.mark.parametrize("seed", range(8))
def test_the_third_derivative_is_bounded_by_sums_over_all_pairs_and_triples_of_joints(seed: int) -> None:
    """L = Σρ_i·C_i + 3·ΣΣρ_max(i,j)·B_i·A_j + ΣΣΣρ_max(i,j,k)·A_i·A_j·A_k, as in the module.

    A prismatic joint counts only as the outermost of a pair or triple.
    """
    chance = chance_of(seed)
    robot, (piece,) = body(chance), path(chance, 1)
    robot = with_slides(robot, chance) if seed % 2 else robot
    moving, _ = tool_rates(robot, (piece,), 1.0, 0.0)
    speed, acceleration, jerk = TIMING_PEAKS
    first = moving.speed / speed
    second = (moving.acceleration - first * acceleration) / speed**2
    third = (moving.jerk - 3.0 * second * speed * acceleration - first * jerk) / speed**3
    known = derivatives(piece)
    middle = [(a + 3.0 * (b + c) + d) / 8.0 for a, b, c, d in zip(*piece, strict=True)]
    width = [max(abs(q - m) for q in column) for m, *column in zip(middle, *piece, strict=True)]
    posture = ForwardKinematics(robot, middle)
    tool = posture.frames[-1].to_base(robot.tool_offset)
    _, reach = posture.displacement_bound(4, tool, width)
    a, b, c = known.max_first, known.max_second, known.third
    groups = [
        group
        for count in (1, 2, 3)
        for group in product(range(4), repeat=count)
        if not any(posture.slides[joint] for joint in sorted(group)[:-1])
    ]
    bound = sum(reach[i] * c[i] for i in range(4))
    bound += sum(3.0 * reach[max(group)] * b[group[0]] * a[group[1]] for group in groups if len(group) == 2)
    bound += sum(reach[max(group)] * prod(a[i] for i in group) for group in groups if len(group) == 3)
    assert third == pytest.approx(bound, rel=1e-6)
    backwards = tool_rates(robot, (piece[::-1],), 1.0, 0.0)
    assert [near(*one) for one in tool_rates(robot, (piece,), 1.0, 0.0)] == [*backwards]


def test_a_path_of_one_piece_is_continuous_and_every_seam_counts() -> None:
    assert is_c2_continuous((line(3.0),))
    assert is_c2_continuous(split_in_half(((1.0,), (0.0,), (0.0,), (8.0,))))
    onwards: Piece = ((3.0,), (4.0,), (5.0,), (6.0,))
    assert not is_c2_continuous((line(3.0), onwards, line(3.0)))


def test_the_tool_of_a_joint_by_taylor_without_halving() -> None:
    # By s: p' = 0.5·0.5 along y, p'' = 0.5·0.5² towards the axis, |p'''| <= L = 0.5·0.5³.
    moving, turning = tool_rates(HALF_METRE, (line(0.5),), 2.0, 0.0)
    first, second, third = hypot(0.25, 0.0625) + 0.0625 / 8.0, 0.125 + 0.0625 / 2.0, 0.0625
    assert moving == near(*rates_in_time(first, second, third, 2.0))
    # Rotation: 0.5 in the middle; its slope is bounded by half of 0.5², its bend by 1.5·0.5³.
    assert turning == near(*rates_in_time(0.5 + 0.125 / 2.0, 0.125, 0.1875, 2.0))


@pytest.mark.parametrize("count", [2, 3])
def test_the_tool_on_a_path_of_several_pieces_by_taylor_without_halving(count: int) -> None:
    angle = 0.5 / count
    path = tuple(tuple((q + number * angle,) for (q,) in line(angle)) for number in range(count))
    moving, turning = tool_rates(HALF_METRE, path, 2.0, 0.0)  # type: ignore[arg-type]
    third = 0.5 * angle**3
    first, second = hypot(0.5 * angle, 0.25 * angle**2) + third / 8.0, 0.5 * angle**2 + third / 2.0
    assert moving == near(*rates_in_time(count * first, count**2 * second, count**3 * third, 2.0))
    first, second, third = angle + angle**2 / 4.0, angle**2 / 2.0, 1.5 * angle**3
    assert turning == near(*rates_in_time(count * first, count**2 * second, count**3 * third, 2.0))


def test_halving_comes_close_to_the_exact_speed_and_stops_below_the_limit() -> None:
    exact = 0.25 * 0.9375
    tight, turning = tool_rates(HALF_METRE, (line(0.5),), 2.0, 1e-9)
    assert exact <= tight.speed <= exact * 1.002
    assert 0.5 * 0.9375 <= turning.speed <= 0.5 * 0.9375 * 1.01
    enough, _ = tool_rates(HALF_METRE, (line(0.5),), 2.0, exact * 1.02)
    assert tight.speed < enough.speed <= exact * 1.02
    whole, _ = tool_rates(HALF_METRE, (line(0.5),), 2.0, 0.0)
    assert enough.speed < whole.speed
    # Of derivatives by s of 0.25, 0.125 and 0.0625.
    for found, least in zip(tight, rates_in_time(0.25, 0.125, 0.0625, 2.0), strict=True):
        assert least <= found * (1.0 + 1e-9) <= least * 1.01
    # Only what is below the limit is left whole, rounding included.
    assert tool_rates(HALF_METRE, (line(0.5),), 2.0, whole.speed * (1.0 + 1e-12))[0] == whole
    assert (
        tool_rates(HALF_METRE, (line(0.5),), 2.0, whole.speed / (1.0 + 1e-9))[0].speed < enough.speed * 1.02
    )
    halves = tuple(((q,), (q + 1.0 / 12.0,), (q + 1.0 / 6.0,), (q + 0.25,)) for q in (0.0, 0.25))
    for limit in (1.002, 1.01):
        assert tool_rates(HALF_METRE, halves, 2.0, exact * limit)[0].speed <= exact * limit


def test_a_tool_on_the_axis_turns_and_does_not_move() -> None:
    moving, turning = tool_rates(RobotBody(((0.0, 0.0, 0.0),), (0.0, 0.0, 1.0), ()), (line(0.5),), 2.0, 1.0)
    assert moving == near(0.0, 0.0, 0.0)
    assert turning.speed >= 0.5 * 0.9375


def test_joints_that_turn_against_each_other_leave_the_tool_where_it_is() -> None:
    # Two joints at one place about one axis.
    twins = RobotBody(((0.0, 0.0, 0.0),) * 2, (0.5, 0.0, 0.0), ())
    still, _ = tool_rates(twins, (line(0.5, -0.5),), 2.0, 1e-9)
    both, _ = tool_rates(twins, (line(0.25, 0.25),), 2.0, 1e-9)
    assert still.speed <= 0.01
    assert 0.25 * 0.9375 <= both.speed <= 0.25 * 0.9375 * 1.01


def test_a_tilted_joint_is_bounded_as_an_upright_one() -> None:
    tilted = RobotBody(((0.0, pi / 2, 0.0),), (0.5, 0.0, 0.0), ())
    assert tool_rates(tilted, (line(0.5),), 2.0, 0.0)[0] == near(
        *tool_rates(HALF_METRE, (line(0.5),), 2.0, 0.0)[0]
    )


@pytest.mark.parametrize("turn", [pi / 2.0, pi, -0.4])
def test_the_posture_of_joints_that_stand_does_not_matter(turn: float) -> None:
    planar = RobotBody(((0.0, 0.0, 0.0), (0.5, 0.0, 0.0)), (0.25, 0.125, 0.0), ())

    def second_turns(first: float) -> Piece:
        a, b, c, d = ((first, q / 3.0) for q in (0.0, 0.5, 1.0, 1.5))
        return a, b, c, d

    moving, turning = tool_rates(planar, (second_turns(0.0),), 2.0, 0.0)
    turned, turned_turning = tool_rates(planar, (second_turns(turn),), 2.0, 0.0)
    assert turned == near(*moving)
    assert turned_turning == near(*turning)
    # Joint 2 goes 0.5 rad at hypot(0.25, 0.125) m from its axis.
    tight, _ = tool_rates(planar, (second_turns(turn),), 2.0, 1e-9)
    exact = 0.5 * hypot(0.25, 0.125) * 0.9375
    assert exact <= tight.speed <= exact * 1.01


def test_a_bent_path_of_one_joint_by_taylor_without_halving() -> None:
    # 0.8x³: q' is 0.6 in the middle and at most 2.4, q'' 2.4 and at most 4.8, q''' 4.8.
    cube: Piece = ((0.0,), (0.0,), (0.0,), (0.8,))
    moving, turning = tool_rates(HALF_METRE, (cube,), 2.0, 0.0)
    bend = 4.8 + 0.5 * 2.4**2
    assert turning == near(*rates_in_time(0.6 + bend / 2.0, bend, 4.8 + 3.0 * 2.4 * 4.8 + 1.5 * 2.4**3, 2.0))
    # p' = 0.3 along the circle; p'' = 1.2 along it and 0.5·0.6² towards its centre.
    third = 0.5 * (4.8 + 3.0 * 2.4 * 4.8 + 2.4**3)
    first = hypot(0.3 + 0.6, 0.09) + third / 8.0
    assert moving == near(*rates_in_time(first, hypot(1.2, 0.18) + third / 2.0, third, 2.0))


def test_a_path_of_two_pieces_has_the_rates_of_the_same_path_in_one() -> None:
    """Rates of an angle of 0.8s³ by differences in time, and of the tool half a metre from the axis."""
    cube: Piece = ((0.0,), (0.0,), (0.0,), (0.8,))

    def angle(step: int) -> float:
        u = min(max(step / 400.0, 0.0), 1.0)
        s = u**3 * (10.0 - 15.0 * u + 6.0 * u * u)
        return 0.8 * s**3

    rows = [[angle(step) for step in range(401)]]
    for _ in range(3):
        rows.append([(later - earlier) * 200.0 for earlier, later in pairwise(rows[-1])])
    exact = [max(map(abs, row)) for row in rows[1:]]  # in 2 s
    (moving, turning), (moving_halves, turning_halves) = (
        tool_rates(HALF_METRE, path, 2.0, 0.0) for path in ((cube,), split_in_half(cube))
    )
    for order in range(3):
        assert exact[order] <= turning_halves[order] <= turning[order]
        assert 0.5 * exact[order] <= moving_halves[order] <= moving[order]


def test_speeds_on_pieces_bound_the_speed_there_and_nowhere_else() -> None:
    path = tuple(
        (((3 * n) / 24.0,), ((3 * n + 1) / 24.0,), ((3 * n + 2) / 24.0,), ((3 * n + 3) / 24.0,))
        for n in range(8)
    )
    bounds = piece_speeds(HALF_METRE, path, 2.0)
    speeds = [0.0] * 8
    for step in range(2000):
        u = step / 2000.0
        s = u**3 * (10.0 - 15.0 * u + 6.0 * u * u)
        speeds[int(8.0 * s)] = max(speeds[int(8.0 * s)], 0.5 * 30.0 * u * u * (1.0 - u) ** 2 / 2.0)
    for bound, speed in zip(bounds, speeds, strict=True):
        assert speed <= bound <= 1.01 * speed


def test_the_speed_on_a_long_piece_is_bounded_closely() -> None:
    (bound,) = piece_speeds(HALF_METRE, (line(0.5),), 2.0)
    assert 0.25 * 0.9375 <= bound <= 1.01 * 0.25 * 0.9375


def test_the_displacement_of_a_point_by_hand() -> None:
    """Two joints about z, half a metre apart, and a point 0.25 m beyond: ρ grows by what lies beyond."""
    planar = RobotBody(((0.0, 0.0, 0.0), (0.5, 0.0, 0.0)), (0.25, 0.0, 0.0), ())
    posture = ForwardKinematics(planar, (0.0, 0.0))
    total, reaches = posture.displacement_bound(2, (0.75, 0.0, 0.0), (0.1, 0.2))
    assert reaches == pytest.approx([0.75 + 0.2 * 0.25, 0.25])
    assert total == pytest.approx(0.2 * 0.25 + 0.1 * 0.8)
    assert posture.displacement_bound(1, (0.5, 0.0, 0.0), (0.1,)) == (0.05, [0.5])
    assert posture.displacement_bound(0, (0.5, 0.0, 0.0), ()) == (0.0, [])
