"""The force of a contact from joint torques: hypotheses about the link, posture and error of the torques."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.kinematic_chain import Triple, frames_of, mounting_of
from aeros.sim.robot.contact_estimate import DAMPING, estimate_contact_force
from tests.unit.sim.robot.panda import CAPSULES, PANDA, PANDA_BODY, READY_POSTURE, TORQUE_THRESHOLDS

MOUNTINGS = [mounting_of(row) for row in PANDA_BODY.dh_rows]
LINKS = {capsule.link: capsule for capsule in CAPSULES}

near_ready = st.lists(st.floats(-0.4, 0.4), min_size=7, max_size=7).map(
    lambda turns: [float(q) + turn for q, turn in zip(READY_POSTURE, turns, strict=True)]
)
directions = st.tuples(st.floats(-math.pi, math.pi), st.floats(-1.0, 1.0)).map(
    lambda at: (
        math.cos(at[0]) * math.sqrt(1.0 - at[1] ** 2),
        math.sin(at[0]) * math.sqrt(1.0 - at[1] ** 2),
        at[1],
    )
)
shares = st.floats(0.0, 1.0)


def torques_of(q: list[float], link: str, share: float, force: tuple[float, ...]) -> list[float]:
    """External torques of a force at a point of a capsule's axis, by the definition: Jᵀ·f."""
    capsule, frames = LINKS[link], frames_of(MOUNTINGS, q)
    place: Triple = tuple(a + share * (b - a) for a, b in zip(capsule.a, capsule.b, strict=True))  # type: ignore[assignment]
    point = np.array(frames[capsule.joint].to_base(place))
    found = [
        float(np.cross(frame.z, point - np.array(frame.origin)) @ np.array(force)) for frame in frames[1:]
    ]
    return [torque if joint <= capsule.joint else 0.0 for joint, torque in enumerate(found, 1)]


@given(near_ready, st.sampled_from(["hand", "fingers", "link5"]), shares, directions)
def test_a_hit_of_forearm_or_hand_is_not_seen_as_much_less(
    q: list[float], link: str, share: float, way: tuple[float, ...]
) -> None:
    torques = torques_of(q, link, share, tuple(65.0 * part for part in way))
    assert 0.6 * 65.0 < estimate_contact_force(PANDA, q, torques) < 3.0 * 65.0


@given(near_ready, directions, st.floats(8.0, 200.0))
def test_a_force_at_the_tool_is_seen_at_least(q: list[float], way: tuple[float, ...], size: float) -> None:
    frames = frames_of(MOUNTINGS, q)
    tool = np.array(frames[-1].to_base(PANDA_BODY.tool_offset))
    force = size * np.array(way)
    torques = [float(np.cross(one.z, tool - np.array(one.origin)) @ force) for one in frames[1:]]
    assert estimate_contact_force(PANDA, q, torques) > 0.9 * size


@given(
    st.lists(st.floats(-2.8, 2.8), min_size=7, max_size=7),
    st.lists(st.floats(-0.3, 0.3), min_size=7, max_size=7),
)
def test_errors_of_torques_below_the_thresholds_are_bounded_in_every_posture(
    q: list[float], torques: list[float]
) -> None:
    """Also in singular ones: damping bounds what an error can become."""
    assert estimate_contact_force(PANDA, q, torques) <= math.hypot(*torques) / (2.0 * DAMPING) + 1e-9


def test_a_stretched_arm_feels_less_of_a_push_along_it() -> None:
    """It cannot be seen, and is not made up: only the elbow's offset of 82 mm gives it a lever."""
    stretched = [0.0, 0.0, 0.0, -0.0698, 0.0, 0.0, 0.0]
    pushed = estimate_contact_force(PANDA, stretched, torques_of(stretched, "link5", 0.0, (0.0, 0.0, -65.0)))
    assert 20.0 < pushed < 55.0


def test_a_torque_of_the_wrist_is_on_no_link_before_it() -> None:
    q = READY_POSTURE.tolist()
    torques = [-8.0, 0.0, -8.5, 0.0, 0.0, 0.0, 0.0]
    felt = [*torques[:6], 1.001 * TORQUE_THRESHOLDS[6]]
    assert estimate_contact_force(PANDA, q, felt) < estimate_contact_force(PANDA, q, torques)


def test_no_torque_is_no_force() -> None:
    assert estimate_contact_force(PANDA, READY_POSTURE.tolist(), [0.0] * 7) == pytest.approx(0.0)
