"""Duration and effects of actions on the symbolic plant, and refused parameters."""

from __future__ import annotations

from fractions import Fraction
from math import inf, nan
from typing import Any

import pytest

from aeros.sim.robot.errors import ActionRejectedError
from aeros.sim.symbolic.motions import check_parameters, plan_motion
from aeros.skill import act
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL, EnumType, RealType, Type, VectorType
from aeros.spec.expr.units import LENGTH
from aeros.spec.model.rules import ActionKind, Risk
from aeros.spec.model.variables import Declared
from tests.unit.agent.dumplings import SPAN
from tests.unit.sim.robot.panda import PANDA

TICK = 1.0 / 240.0
PEAK_TO_MEAN = 1.875
HERE = {"tool_position": (0.0, 0.0, 0.5), "base_position": (1.0, 2.0, 0.25)}


def declared(name: str, type_: Type) -> Declared:
    return Declared(
        t.Variable(name, type_, t.VariableRole.PARAMETER), SPAN, range=(Fraction(-1), Fraction(1))
    )


WHISTLE = ActionKind(
    "whistle",
    frozenset(),
    Risk.LOW,
    False,
    {
        "pitch": declared("pitch", RealType(LENGTH)),
        "at": declared("at", VectorType(LENGTH)),
        "tune": declared("tune", EnumType("tunes", ("low", "high"))),
        "softly": declared("softly", BOOL),
    },
    SPAN,
)
"""A kind that this plant does not plan, with a parameter of each type."""

GIVEN: dict[str, Any] = {"pitch": 0.5, "at": (0.0, 0.5, 1.0), "tune": "low", "softly": True}


@pytest.mark.parametrize(
    "changed", [{}, {"pitch": 1}, {"at": (0, 1, 0.5)}, {"tune": "high"}, {"softly": False}]
)
def test_parameters_of_their_types_are_taken(changed: dict[str, Any]) -> None:
    check_parameters(WHISTLE, {**GIVEN, **changed})


@pytest.mark.parametrize(
    ("changed", "why"),
    [
        ({"pitch": "high"}, "`pitch` is not a finite number"),
        ({"pitch": True}, "`pitch` is not a finite number"),
        ({"pitch": inf}, "`pitch` is not a finite number"),
        ({"pitch": 10**400}, "`pitch` is not a finite number"),
        ({"at": (0.0, 0.5)}, "`at` is not a 3-tuple"),
        ({"at": [0.0, 0.5, 1.0]}, "`at` is not a 3-tuple"),
        ({"at": (0.0, nan, 1.0)}, "`at` is not a finite number"),
        ({"at": (0.0, 0.5, "x")}, "`at` is not a finite number"),
        ({"tune": "middle"}, "`tune` is none of low, high"),
        ({"softly": 1}, "`softly` is not true or false"),
        ({"loudly": True}, "unknown parameter: `loudly`"),
    ],
)
def test_other_parameters_are_refused(changed: dict[str, Any], why: str) -> None:
    with pytest.raises(ActionRejectedError, match=why):
        check_parameters(WHISTLE, {**GIVEN, **changed})


@pytest.mark.parametrize("name", GIVEN)
def test_a_missing_parameter_is_refused(name: str) -> None:
    with pytest.raises(ActionRejectedError, match=f"missing parameter: `{name}`"):
        check_parameters(WHISTLE, {key: value for key, value in GIVEN.items() if key != name})


@pytest.mark.parametrize("kind", ["move_tool", "slide"])
def test_the_tool_goes_straight_at_a_mean_speed_below_its_peak(kind: str) -> None:
    motion = plan_motion(act(kind, target=(0.3, 0.4, 0.5), speed=0.25), HERE)
    assert motion.duration == pytest.approx(TICK + PEAK_TO_MEAN * 0.5 / 0.25)
    assert motion.values_during == {"tool_speed": 0.25}
    assert motion.values_after == {"tool_position": (0.3, 0.4, 0.5), "tool_speed": 0.0}


def test_an_unmeasured_tool_reaches_its_target_at_once() -> None:
    assert plan_motion(act("move_tool", target=(0.3, 0.4, 0.5), speed=0.25), {}).duration == TICK


def test_the_base_takes_the_arm_along() -> None:
    motion = plan_motion(act("move_base", x=4.0, y=6.0, speed=0.5), HERE)
    assert motion.duration == pytest.approx(TICK + PEAK_TO_MEAN * 5.0 / 0.5)
    assert motion.values_during == {}
    assert motion.values_after == {"base_position": (4.0, 6.0, 0.25), "tool_position": (3.0, 4.0, 0.5)}
    alone = plan_motion(act("move_base", x=4.0, y=6.0, speed=0.5), {})
    assert (alone.duration, alone.values_after) == (TICK, {"base_position": (4.0, 6.0, 0.0)})


def test_joint_moves_put_the_tool_at_its_forward_kinematics() -> None:
    chain = pytest.importorskip("aeros.sim.kinematic.tool_kinematics")
    q = (0.1, -0.3, 0.2, -1.9, 0.3, 1.9, 0.2)
    joints = {f"q{number}": value for number, value in enumerate(q, 1)}
    motion = plan_motion(act("move_joints", **joints, speed=0.5), HERE)
    place = chain.tool_kinematics(PANDA, q).position
    expected = tuple(a + b for a, b in zip(place, HERE["base_position"], strict=True))
    assert motion.values_after["tool_position"] == pytest.approx(expected)
    assert motion.duration > TICK


def test_durations_of_grip_look_wait_and_unknown_kinds() -> None:
    grip = plan_motion(act("grip", width=0.03, force=5.0), HERE)
    assert (grip.duration, grip.values_after) == (0.5, {"finger_gap": 0.03})
    look = plan_motion(act("look"), HERE)
    assert (look.duration, look.values_after) == (0.1, {})
    waits = [plan_motion(act("wait", duration=duration), HERE).duration for duration in (3.0, 0, -1.0)]
    assert waits == [3.0, TICK, TICK]
    assert plan_motion(act("whistle"), HERE) == (TICK, {}, {})


@pytest.mark.parametrize(
    ("action", "why"),
    [
        (act("move_tool", target=(0.0, 0.0, 0.0), speed=0.0009), "`speed` = 0.0009 is below 0.001"),
        (act("move_tool", target=(0.0, 0.0), speed=0.1), "`target` is not a 3-tuple"),
        (act("move_base", x=0.0, speed=0.1), "`y` is not a finite number"),
        (act("move_base", x=0.0, y=0.0, speed=-1.0), "is below"),
        (act("grip", width=0.0, force=nan), "`force` is not a finite number"),
        (act("wait"), "`duration` is not a finite number"),
    ],
)
def test_a_motion_that_cannot_be_made_is_refused(action: Any, why: str) -> None:
    with pytest.raises(ActionRejectedError, match=why):
        plan_motion(action, HERE)
