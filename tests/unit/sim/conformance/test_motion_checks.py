"""Each of these checks accepts a whole twin of a plant and refuses one that breaks its promise."""

from __future__ import annotations

import pytest

from aeros.runtime.ports import JointPath, RobotBody, Trajectory
from aeros.sim.conformance import motion_checks
from aeros.sim.conformance.suite import Check
from tests.unit.sim.conformance.broken import Twin
from tests.unit.sim.conformance.twins import accept, broken_twins, refuse, whole_twins


@pytest.mark.parametrize(("check", "twin"), whole_twins(motion_checks))
def test_the_twin_that_is_not_broken_passes(check: Check, twin: type[Twin]) -> None:
    accept(check, twin)


@pytest.mark.parametrize(("check", "twin", "why"), broken_twins(motion_checks))
def test_a_broken_twin_is_refused(check: Check, twin: type[Twin], why: str) -> None:
    refuse(check, twin, why)


# Plans at a time, by hand.

PIECES: JointPath = (
    ((0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (3.0, 0.0)),
    ((3.0, 0.0), (3.0, 0.0), (3.0, 0.0), (3.0, 8.0)),
)
"""Joint 1 goes straight to 3 in the first half; joint 2 goes to 8 by 8u³ in the second."""


@pytest.mark.parametrize(
    ("s", "q"),
    [(0.0, [0.0, 0.0]), (0.25, [1.5, 0.0]), (0.5, [3.0, 0.0]), (0.75, [3.0, 1.0]), (1.0, [3.0, 8.0])],
)
def test_a_point_of_a_path_is_on_its_own_piece(s: float, q: list[float]) -> None:
    assert motion_checks.path_point(PIECES, s) == q


def test_a_point_of_a_piece_is_bernsteins() -> None:
    piece: JointPath = (((1.0,), (2.0,), (4.0,), (8.0,)),)
    # At 1/4: (27·1 + 27·2 + 9·4 + 1·8)/64.
    assert motion_checks.path_point(piece, 0.25) == [1.953125]


def test_joints_and_base_are_as_far_as_the_profile() -> None:
    body = RobotBody(((0.0, 0.0, 0.0),) * 2, (0.0, 0.0, 0.0), ())
    plan = Trajectory(body, (PIECES,), (1.0, 2.0, 0.0), (4.0, -2.0, 0.0), 9.0)
    assert motion_checks.expected_position(plan, 0.0) == ([0.0, 0.0], [1.0, 2.0, 0.0])
    assert motion_checks.expected_position(plan, 0.5) == ([3.0, 0.0], [3.0, 1.0, 0.0])
    assert motion_checks.expected_position(plan, 1.0) == ([3.0, 8.0], [5.0, 0.0, 0.0])
    joints, base = motion_checks.expected_position(plan, 0.25)  # s = 0.103515625
    assert joints == pytest.approx([0.62109375, 0.0])
    assert base == pytest.approx([1.4140625, 1.79296875, 0.0])
