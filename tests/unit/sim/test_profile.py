from __future__ import annotations

import numpy as np
import pytest

from aeros.sim.kinematics import READY, forward
from aeros.sim.limits import QD_MAX, QDD_MAX
from aeros.sim.profile import TICK, UnreachableError, straight_profile

START = (forward(READY[None, :])[0][0], 0.0)


@pytest.mark.parametrize("speed", [0.05, 0.25, 1.7])
def test_every_tick_of_a_profile_keeps_the_joint_limits(speed: float) -> None:
    profile = straight_profile(READY, START, (np.array([0.5, 0.3, 0.05]), 1.0), speed)
    rate = np.diff(np.vstack((READY, profile.sample()[0])), axis=0) / TICK
    change = np.diff(np.vstack((np.zeros(7), rate)), axis=0) / TICK
    assert (np.abs(rate) <= 0.51 * QD_MAX).all()
    assert (np.abs(change) <= 0.6 * QDD_MAX).all()


def test_the_tool_stays_on_the_line_and_below_the_asked_speed() -> None:
    target = np.array([0.5, 0.3, 0.05])
    profile = straight_profile(READY, START, (target, 0.0), 0.25)
    places = np.vstack((START[0], forward(profile.sample()[0])[0]))
    way = (target - START[0]) / np.linalg.norm(target - START[0])
    along = (places - START[0]) @ way
    off = np.linalg.norm(places - START[0] - along[:, None] * way, axis=1)
    assert off.max() < 1e-4
    assert np.linalg.norm(np.diff(places, axis=0), axis=1).max() / TICK < 0.2501
    assert np.allclose(places[-1], target, atol=1e-4)


def test_a_profile_ends_at_rest() -> None:
    profile = straight_profile(READY, START, (np.array([0.5, 0.0, 0.3]), 0.0), 0.25)
    assert np.abs(profile.sample()[1][-1]).max() < 1e-9


def test_a_line_out_of_reach_is_refused_with_a_reason() -> None:
    with pytest.raises(UnreachableError, match="no joint position puts the tool"):
        straight_profile(READY, START, (np.array([0.9, 0.5, 0.3]), 0.0), 0.25)
