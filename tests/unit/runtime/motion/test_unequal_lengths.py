"""Sequences of unequal length are refused, so that no joint and no axis is left out of a decision."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, cast

import pytest

from aeros.runtime.motion import base_contact, bezier, kinematic_bounds, nearest_approach, swept_volume
from aeros.runtime.motion.detour import find_base_detour
from aeros.runtime.motion.link_distance import find_link_contact, hull_pairs
from aeros.runtime.motion.obstacle_contact import ends_at_obstacle, trim_held_space
from aeros.runtime.motion.trajectory import MotionDecider
from aeros.runtime.ports import Hull, Obstacle
from tests.unit.runtime.motion.test_trajectory import APART, BODY, FOLDING, POLICY, decided, motion, servo

POINT: Any = (0.0, 0.0, 0.0)
FOUR: Any = (1.0, 1.0, 1.0, 1.0)
RAGGED: Any = ((0.0, 0.0), (0.0,), (0.0, 0.0), (0.0, 0.0))
"""A piece of a path whose second control point has one joint, and the others two."""
LONG: Any = ((0.0,),) * 5
"""A piece with a control point too many."""
BOX = swept_volume.BarrierBox("box", (1.0, 1.0, 1.0), FOUR, False, False, None)
BALL = swept_volume.Enclosure(POINT, POINT, 0.0)


def obstacle(lower: Any = POINT, upper: Any = (1.0, 1.0, 1.0)) -> Obstacle:
    return Obstacle("crate", lower, upper, 1.0, "camera", "bench")


def swept(**changed: Any) -> swept_volume.SweptMotion:
    line = bezier.remaining_path(motion().joint_paths[0], 0.0)
    return swept_volume.SweptMotion(FOLDING, (line,), (0.0,), POINT, POINT, True)._replace(**changed)


def travel(path: Any) -> base_contact.BaseTravel:
    return base_contact.BaseTravel((POINT, POINT), POINT, path)


@pytest.mark.parametrize(
    "call",
    [
        lambda: travel(FOUR).at_end(),
        lambda: base_contact.find_base_contact(travel(FOUR), [obstacle()], 0.0),
        lambda: base_contact.enlarged_obstacle((POINT, POINT), obstacle(lower=FOUR), 0.0),
        lambda: base_contact.enlarged_obstacle((POINT, POINT), obstacle(upper=FOUR), 0.0),
        lambda: bezier.joint_box([RAGGED]),
        lambda: bezier.path_chord([RAGGED]),
        lambda: bezier.path_chord([LONG]),
        lambda: bezier.split_in_half(RAGGED),
        lambda: bezier.remaining_path((RAGGED,), 0.5),
        lambda: bezier.derivatives(RAGGED),
        lambda: find_base_detour((-1.0, 0.0, 0.0), (3.0, 0.0, 0.0), [BOX], lambda _: True, lambda _: None),
        lambda: find_base_detour((1.0, -1.0, 1.0), (3.0, 1.0, 1.0), [BOX], lambda _: False, lambda _: None),
        lambda: kinematic_bounds.chord_terms((1.0, 1.0), (1.0,), (False, False)),
        lambda: kinematic_bounds.is_c2_continuous((RAGGED, RAGGED)),
        lambda: kinematic_bounds.joint_rates((((0.0,),) * 4, ((0.0, 0.0),) * 4), 1.0),
        lambda: kinematic_bounds.add_rates(cast("Any", FOUR), kinematic_bounds.MotionRates(1.0, 1.0, 1.0)),
        lambda: hull_pairs(replace(FOLDING, hulls=(FOLDING.hulls[0], Hull("post", 0, (POINT, FOUR), 0.0)))),
        lambda: find_link_contact(swept(joint_tolerance=(0.0, 0.0)), 0.0),
        lambda: nearest_approach.shifted(BALL, FOUR),
        lambda: nearest_approach.find_nearest_approach(swept(body=BODY), BOX, "arm"),
        lambda: ends_at_obstacle(swept(base_path=FOUR), [obstacle()], 0.0),
        lambda: trim_held_space(swept(), Hull("held", 1, (POINT, FOUR), 0.0), [], 0.0),
        lambda: trim_held_space(swept(), Hull("held", 1, (FOUR,), 0.0), [], 0.0),
        lambda: swept_volume.find_breach(swept(joint_tolerance=(0.0, 0.0)), [BOX], 0.0),
        lambda: MotionDecider(replace(POLICY, joint_limits=(*POLICY.joint_limits[:2], ()))),
        lambda: decided(motion(), policy=replace(POLICY, joint_limits=two_joints())),
        lambda: decided(motion(), "turn", angle=0.5, policy=turning_two_joints()),
        lambda: decided(motion(), joint=cast("Any", (0.0, 0.0))),
    ],
)
def test_sequences_of_unequal_length_are_refused(call: Callable[[], object]) -> None:
    with pytest.raises(ValueError, match=r"zip\(\) argument"):
        call()


def two_joints() -> Any:
    return tuple(limits * 2 for limits in POLICY.joint_limits)


def turning_two_joints() -> Any:
    turn = replace(POLICY.kinds["turn"], joint_target=("angle", "speed"))
    return replace(POLICY, kinds={**POLICY.kinds, "turn": turn})


def test_the_same_calls_with_equal_lengths_are_answered() -> None:
    assert travel(POINT).at_end() == travel(POINT)
    assert not ends_at_obstacle(swept(), [obstacle((3.0, 3.0, 3.0), (4.0, 4.0, 4.0))], 0.0)
    assert decided(motion(joint_paths=motion().joint_paths, servo=servo())) == []
    assert decided(motion(), "turn", angle=0.5) == []
    assert decided(motion(-0.5, body=FOLDING), "slide", APART) == []
