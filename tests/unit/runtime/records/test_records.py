"""A motion read back from a record equals the plant's, or the record says that it does not."""

from __future__ import annotations

import json
from dataclasses import replace
from math import inf, nan
from typing import Any

import pytest

from aeros.runtime.canonical_json import digest_of, to_canonical_json
from aeros.runtime.gate.decision import Reason
from aeros.runtime.ports import Ball, MotionCompletion, NoMotion, RobotBody, ServoBounds, Trajectory
from aeros.runtime.records.records import body_to_json, format_reasons, motion_from_json, motion_to_json
from aeros.spec.expr.shortfall import UnmetBound
from aeros.spec.model.cause import Cause
from tests.unit.runtime import motions

NOWHERE = (0.0, 0.0, 0.0)


def test_a_denial_is_formatted_with_the_values_that_broke_the_rule() -> None:
    near = UnmetBound("human_distance", 0.61, "at least", 0.89, "m")
    reasons = (Reason("AE750", "separation", "somebody is near"), Reason("AE710", "worn", "a finger is worn"))
    causes = (Cause("rule", "separation", "", shortfalls=(near,)), Cause("gate", "worn", ""))
    denied = "AE750 separation: human_distance is 0.61 m (at least 0.89 m)"
    assert format_reasons(reasons, causes) == f"{denied}; also worn"
    assert format_reasons(reasons[::-1], causes[::-1]) == f"{denied}; also worn"
    assert format_reasons(reasons[:1], causes[:1]) == denied
    assert format_reasons(reasons[1:]) == "AE710 worn: a finger is worn"
    assert format_reasons(()) == "the gate gave no reason"


def motion(seed: int = 0, pieces: int = 3, lanes: int = 1, **changed: Any) -> Trajectory:
    chance = motions.chance_of(seed)
    body = motions.body(chance)
    found = tuple(motions.path(chance, pieces) for _ in range(lanes))
    return replace(Trajectory(body, found, NOWHERE, (0.1, -0.2, 0.0), 2.5), **changed)


def servo() -> ServoBounds:
    row = (0.1,) * motions.JOINTS
    return ServoBounds(row, row, row, row, 0.1, 0.2, 0.3)


def encoded(plan: Any) -> tuple[Any, dict[str, Any]]:
    """Return the JSON of a plan in a log, and the bodies in the log by digest."""
    held = body_to_json(plan.body) if type(plan) is Trajectory else None
    message = motion_to_json(plan, digest_of(held))
    return json.loads(to_canonical_json(message)), {digest_of(held): json.loads(to_canonical_json(held))}


def read(plan: Any) -> Any:
    return motion_from_json(*encoded(plan))


@pytest.mark.parametrize("seed", range(10))
def test_a_motion_comes_back_as_it_was(seed: int) -> None:
    pieces, lanes = 1 + seed % 4, 1 + seed % 3
    one = motion(seed, pieces, lanes, servo=servo() if lanes > 1 else None)
    # Each point that two pieces share is written once, and so has to be the same.
    joined = replace(one, joint_paths=tuple(map(_joined, one.joint_paths)))
    again = read(joined)
    assert again == joined
    assert repr(again) == repr(joined)
    assert all(type(path) is dict for path in encoded(joined)[0]["paths"])


def _joined(path: Any) -> Any:
    found = [path[0]]
    for piece in path[1:]:
        found.append((found[-1][3], *piece[1:]))
    return tuple(found)


@pytest.mark.parametrize(
    "plan",
    [
        NoMotion("it waits"),
        MotionCompletion(False, "unreachable"),
        MotionCompletion(True),
        None,
        5,
        "motion",
        [1.0],
    ],
)
def test_other_answers_of_a_plant_come_back_too(plan: Any) -> None:
    assert read(plan) == plan
    assert type(read(plan)) is type(plan)


BODY = motion().body
NO_BALLS: dict[str, Any] = {"balls": None}
MALFORMED: list[dict[str, Any]] = [
    {"joint_paths": ()},
    {"joint_paths": ((),)},
    {"joint_paths": None},
    {"joint_paths": (None,)},
    {"joint_paths": (((1.0,) * 4,),)},
    {"joint_paths": ((((1.0,), (1.0,), (1.0,)),),)},
    {"joint_paths": ((((1,), (1,), (1,), (1,)),),)},
    {"joint_paths": ((((True,), (1.0,), (1.0,), (1.0,)),),)},
    {"joint_paths": ((((), (), (), ()),),)},
    {"joint_paths": ((((1.0,), (1.0, 2.0), (1.0,), (1.0,)),),)},
    {"joint_paths": ((((1.0,),) * 4, ((2.0,),) * 4),)},
    {"base": (1, 2)},
    {"duration": inf},
    {"duration": "long"},
    {"servo": 5},
    {"servo": replace(servo(), joint_tolerance=())},
    {"body": None},
    {"body": RobotBody((), NOWHERE, ())},
    {"body": replace(BODY, **NO_BALLS)},
    {"body": replace(BODY, balls=(Ball("arm", 1, NOWHERE, -1.0),))},
]


@pytest.mark.parametrize("changed", MALFORMED, ids=str)
def test_malformed_motions_decode_to_what_they_were(changed: dict[str, Any]) -> None:
    one = motion(**changed)
    assert repr(read(one)) == repr(one)


@pytest.mark.parametrize("number", [nan, inf, -0.0, 5e-324])
def test_every_double_comes_back(number: float) -> None:
    one = motion(joint_paths=((((number,), (1.0,), (1.0,), (number,)), ((number,), (1.0,), (1.0,), (2.0,))),))
    assert repr(read(one)) == repr(one)


def test_any_planned_motion_can_be_encoded() -> None:
    for strange in (object(), {1: 2}, [1.0], b"x"):
        for changed, written in (
            ("joint_paths", {"paths"}),
            ("base", {"base"}),
            ("base_path", {"way"}),
            ("duration", {"duration"}),
            ("servo", {"servo"}),
            ("body", set()),
        ):
            malformed: dict[str, Any] = {changed: strange}
            assert json.loads(to_canonical_json(motion_to_json(motion(**malformed), ""))).keys() > written
            json.loads(to_canonical_json(body_to_json(strange)))
        assert json.loads(to_canonical_json(motion_to_json(strange, ""))) is not None


@pytest.mark.parametrize(
    "changed",
    [
        {"paths": [{"joints": 4, "points": "*"}]},
        {"paths": [{"joints": 4, "points": "AAAA"}]},
        {"paths": [{"joints": 3, "points": "AAAAAAAAAAA="}]},
        {"paths": [{"joints": 0, "points": ""}]},
        {"body": "unheard of"},
        {"body": []},
        {"servo": {"slack": [1.0]}, "more": 1},
    ],
    ids=str,
)
def test_a_changed_motion_is_another_motion_or_malformed(changed: dict[str, Any]) -> None:
    message, bodies = encoded(motion())
    try:
        found = motion_from_json({**message, **changed}, bodies)
    except (KeyError, TypeError, ValueError):
        return
    assert found != motion()


@pytest.mark.parametrize("message", [None, [], {}, {"body": "x"}, "motion"])
def test_a_message_that_is_no_motion_is_refused(message: Any) -> None:
    with pytest.raises(ValueError, match="it is not a motion"):
        motion_from_json(message, {})


def test_a_path_takes_eleven_characters_for_each_number() -> None:
    one = motion(pieces=40)
    one = replace(one, joint_paths=tuple(map(_joined, one.joint_paths)))
    numbers = motions.JOINTS * (1 + 3 * 40)
    assert len(to_canonical_json(encoded(one)[0])) < 11 * numbers + 300
