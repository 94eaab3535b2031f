"""The text of a decision equals the encoding of its details."""

from __future__ import annotations

from math import nan
from pathlib import Path
from random import Random
from typing import Any

from aeros.runtime.audit.log import AuditLog, verify_log
from aeros.runtime.canonical_json import Encoded, to_canonical_json
from aeros.runtime.gate.decision import Caller, Decision, DecisionKind, Reason
from aeros.runtime.ports import (
    ColumnNames,
    MotionCompletion,
    NoMotion,
    PlannedMotion,
    Reading,
    Readings,
    Snapshot,
)
from aeros.runtime.records.encode_decisions import IncrementalDecisionEncoder, IncrementalReadingsEncoder
from aeros.runtime.records.records import DecisionRecord, decision_details, motion_details, motion_to_json
from aeros.skill import Action

_VALUES: tuple[Any, ...] = (
    0.0, -0.0, 0.25, 1, True, nan, "open", "é", (0.1, -0.0), (0.1, 1), (), [1.0], None, {"float": "nan"},
    10**400, "x" * 2000,
)  # fmt: skip
_NAMES = ("float", "aim", "é", "speed")
_STILL = NoMotion("it has no body")


def _mapping(chance: Random) -> dict[str, Any]:
    values = chance.choice((_VALUES, (0.0, -0.0, 0.25, True, "open", (0.1, -0.0))))
    return {name: chance.choice(values) for name in chance.sample(_NAMES, chance.randint(0, 3))}


def _readings(chance: Random, time: float) -> Readings:
    values = {name: chance.choice((0.1, True, (0.1, 0.2), "open")) for name in ("lid", "pot", "tool")}
    if chance.random() < 0.5:
        order = ColumnNames(values)
        return Snapshot(order, tuple(values[name] for name in order.names), time)
    return {name: Reading(value, time) for name, value in values.items()}


def _decision(chance: Random, asked: Action) -> Decision:
    match chance.randint(0, 4):
        case 0:
            return Decision(DecisionKind.DENY, None, (Reason("AE750", "slow", "too fast"),))
        case 1:
            return Decision(
                DecisionKind.ATTENUATE, Action("move", {"speed": 0.1}), (Reason("AE750", "slow", "so"),)
            )
        case 2 | 3:
            same = {name: tuple(one) if type(one) is tuple else one for name, one in asked.parameters.items()}
            return Decision(DecisionKind.ALLOW, Action(asked.kind, same), ())
        case _:
            return Decision(DecisionKind.ALLOW, Action(asked.kind, _mapping(chance)), ())


def _encoded(
    now: float, readings: Readings, caller: Caller, asked: Action, usage: Any, beside: list[int]
) -> dict[str, Any]:
    return {
        "configuration": "c0ffee",
        "now": now,
        "readings": readings,
        "caller": caller,
        "requested_action": asked,
        "usage": usage,
        "concurrent_records": beside,
        "halting_records": [],
    }


def test_incremental_encoding_equals_decision_details(tmp_path: Path) -> None:
    chance = Random(7)  # noqa: S311 - a test, the same every time
    encoder, one_by_one = IncrementalDecisionEncoder(), IncrementalReadingsEncoder()
    callers = [
        Caller("make dumplings", "wrap", {}),
        Caller("é", "wrap", {"aim": (0.1, 0.2), "float": 1.0}),
        Caller("make dumplings", "wrap", {"float": 1.0}),
        Caller("make dumplings", "wrap", {"pieces": 2}),
    ]
    as_text = 0
    with (
        AuditLog(tmp_path / "incremental", lambda: 1.5) as incremental,
        AuditLog(tmp_path / "usual", lambda: 1.5) as usual,
    ):
        for _ in range(3000):
            asked, time = Action("move", _mapping(chance)), chance.choice((0.0, -0.0, 2.5, 2.5, nan))
            decision, readings, caller = (
                _decision(chance, asked),
                _readings(chance, time),
                chance.choice(callers),
            )
            plan: PlannedMotion = chance.choice(
                (_STILL, NoMotion("it waits"), MotionCompletion(False, "unreachable"))
            )
            usage = chance.choice((None, {}, {"grip": 1}, {"grip": 1}, {"grip": 2, "arm": 0}))
            beside = chance.choice(([], [], [3]))
            moved = chance.random() < 0.5
            before = Decision(DecisionKind.ALLOW, asked, ()) if chance.random() < 0.2 else decision
            motion = encoder.encode_motion(plan, "", before, decision) if moved else {}
            same = motion_details(before, decision, motion_to_json(plan, "")) if moved else {}
            message = _encoded(time, readings, caller, asked, usage, beside)
            details = encoder.encode(DecisionRecord(decision, **message, motion=motion))
            as_text += type(details) is Encoded
            incremental.append("decision", details)
            usually = DecisionRecord(decision, **message, motion=same)
            usual.append("decision", decision_details(usually, one_by_one.encode))
    assert (tmp_path / "incremental").read_bytes() == (tmp_path / "usual").read_bytes()
    assert verify_log(tmp_path / "incremental").is_sound
    assert 200 < as_text < 2700


def test_an_encoded_decision_takes_as_much_room_as_it_needs_at_most() -> None:
    asked = Action("move", {"aim": (0.1, 0.2), "speed": 0.25})
    readings = {"lid": Reading(True, 1.0), "pot": Reading((0.1, 0.2), 1.0)}
    message = _encoded(1.0, readings, Caller("make dumplings", "wrap", {}), asked, {"grip": 1}, [])
    decision = Decision(DecisionKind.ALLOW, asked, ())
    made = DecisionRecord(decision, **message)
    incremental = IncrementalDecisionEncoder().encode(made)
    assert type(incremental) is Encoded
    assert (
        incremental.text.encode() == to_canonical_json({"details": decision_details(made)}, ["state"])[11:-1]
    )
    assert incremental.size >= len(incremental.text)
