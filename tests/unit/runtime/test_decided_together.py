"""Actions of two steps are decided together, each allowed alone, and replayed so."""

from __future__ import annotations

from collections.abc import Callable
from math import nan
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.audit.check import Record
from aeros.runtime.audit.log import verify_log
from aeros.runtime.gate.configuration import single_configuration
from aeros.runtime.gate.decision import Decision, DecisionKind
from aeros.runtime.gate.gate import CompiledGate, GateMode
from aeros.runtime.gate.joint_rules import ActiveAction
from aeros.runtime.ports import Reading, StepRequest, StepStatus
from aeros.runtime.records.replay import LogReplay
from aeros.skill import act
from aeros.spec.diagnostics.errors import InternalError
from tests.unit.runtime.together import MakeCart, asking, configuration, move, roll

FINISHED = StepStatus.FINISHED


def replayed(
    log: Path,
    mode: GateMode = GateMode.COMPILED,
    change: Callable[[Record], Record | None] = lambda record: record,
) -> LogReplay:
    """The decisions of a log decided again, each as `change` makes it."""
    replay = LogReplay(single_configuration(configuration()), mode)

    def take(record: Record, own: str) -> None:
        changed = change(record)
        if changed is not None:
            replay.replay_record(changed)

    assert verify_log(log, take).is_sound
    return replay


def _alone(details: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in details.items() if name != "beside"}


@pytest.mark.parametrize("mode", GateMode)
@pytest.mark.parametrize(
    ("first", "second", "values", "reason"),
    [
        ("reach", "drive", {}, None),
        ("drive", "reach", {}, None),
        ("reach", "drive", {"charge": 0.1}, "AE751 charge-for-both"),
        ("drive", "reach", {"charge": 0.1}, "AE751 charge-for-both"),
        ("reach", "drive", {"fast": True}, "AE751 not-fast-together"),
        ("drive", "reach", {"fast": True}, "AE751 not-fast-together"),
        ("reach", "drive", {"charge": nan}, "AE704 charge"),
        ("reach", "drive", {"charge": None}, "AE703 charge"),
        ("drive", "reach", {"hand": None}, "AE703 hand"),
    ],
)
def test_actions_allowed_alone_are_decided_together(
    cart: MakeCart, mode: GateMode, first: str, second: str, values: dict[str, Any], reason: str | None
) -> None:
    speed = 0.75 if values.get("fast") else 0.25
    one = cart(mode=mode, reach=asking(move(speed)), drive=asking(roll(speed)))
    one.plant.values |= {name: value for name, value in values.items() if name in one.plant.values}
    one.plant.values = {name: value for name, value in one.plant.values.items() if value is not None}
    alone = one.executor.run_step(StepRequest("cart", second, {}))
    # A reading that is no value is denied to every skill.
    assert (alone.status is FINISHED) == (values.get("charge") is not nan)
    if values.get("charge") is nan:
        return
    started, beside = one.start(first), one.start(second)
    results = one.ends(2)
    assert results[started].status is FINISHED
    if reason is None:
        assert results[beside].status is FINISHED
    else:
        assert results[beside].status is StepStatus.DENIED
        assert results[beside].reason.startswith(reason)
    assert one.calls("skill_ended").count((f"cart.{second}", reason is None)) == 1 + (reason is None)
    one.assert_nothing_is_held()
    for again in GateMode:
        replay = replayed(one.log, again)
        assert (replay.mismatches, replay.matching_count) == ([], 3)


def test_a_replay_notices_a_decision_that_was_not_of_both(cart: MakeCart) -> None:
    one = cart(reach=asking(move(0.75)), drive=asking(roll(0.75)))
    one.start("reach")
    one.start("drive")
    one.ends(2)
    replay = replayed(one.log, change=lambda record: {**record, "details": _alone(record["details"])})
    (found,) = replay.mismatches
    assert (found.recorded["verdict"], (found.replayed or {})["verdict"]) == ("DENY", "ALLOW")


def test_a_replay_says_what_it_lacks(cart: MakeCart) -> None:
    one = cart(reach=asking(move()), drive=asking(roll()))
    one.start("reach")
    one.start("drive")
    one.ends(2)
    replay = replayed(
        one.log,
        change=lambda record: (
            record if record["event"] != "decision" or "beside" in record["details"] else None
        ),
    )
    (found,) = replay.mismatches
    assert "which is not an action that began" in found.reason


def test_a_gate_whose_ways_disagree_about_both_halts_everything(
    cart: MakeCart, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = cart(mode=GateMode.CHECKED, reach=asking(move()), drive=asking(roll()))
    gate = one.executor._pipeline._gate
    assert isinstance(gate, CompiledGate)
    checker = gate._checker
    assert checker is not None

    def denying(*_: Any) -> Decision:
        return Decision(DecisionKind.DENY, None, ())

    monkeypatch.setattr(checker, "decide_jointly", denying)
    one.start("reach")
    one.start("drive")
    with pytest.raises(InternalError, match="compiled gate"):
        one.executor.wait()
    assert one.calls("skill_ended") == [("cart.reach", False), ("cart.drive", False)]


def test_two_actions_on_one_actuator_are_denied_for_every_holder(cart: MakeCart) -> None:
    readings = {"stop_pressed": Reading(False, 1.0)}
    lift = ActiveAction(act("lift", height=1.0), readings, 1.0, 7)
    for mode in GateMode:
        gate = CompiledGate(configuration(), mode)
        decided = gate.decide_jointly(Decision(DecisionKind.ALLOW, move(), ()), readings, 1.0, [lift])
        assert [(reason.code, reason.rule) for reason in decided.reasons] == [("AE752", "arm")]
        denied = Decision(DecisionKind.DENY, None, ())
        assert gate.decide_jointly(denied, readings, 1.0, [lift]) == denied
