from __future__ import annotations

import json
from collections.abc import Mapping
from math import inf, nan
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.audit import AuditLog, verify_log
from aeros.runtime.audit_check import Record
from aeros.runtime.canonical import digest_of
from aeros.runtime.decision import Caller, Decision, Verdict
from aeros.runtime.gate import Gate, GateDisagreementError, GateMode
from aeros.runtime.ports import Reading
from aeros.runtime.records import decision_details, session_details
from aeros.runtime.replay import Replay
from aeros.runtime.usage import ClockError, Usage, denied_by_clock
from aeros.skill import Action
from tests.unit.runtime import bench

CALLER = Caller("handling", "quickly", {})


def decided(parameters: Mapping[str, Any], **state: Any) -> tuple[Decision, dict[str, Any]]:
    """What the gate says of a `move`, and what the record says of that."""
    readings = bench.measured({**bench.STATE, **state})
    action = Action("move", dict(parameters))
    usage = dict.fromkeys((quota.id for quota in bench.configuration().site.quotas), 0)
    decision = bench.gate().decide(CALLER, readings, action, bench.NOW, usage)
    digest = bench.configuration().digest
    return decision, decision_details(decision, digest, bench.NOW, readings, CALLER, action, usage)


def replayed(*records: tuple[str, Mapping[str, Any]], gate: Gate | None = None, path: Path) -> Replay:
    """The records written to a log and decided again."""
    with AuditLog(path) as log:
        for event, details in records:
            log.append(event, details)
    replay = Replay(bench.configuration(), gate or bench.gate())

    def take(record: Record, own: str) -> None:
        replay.take(record)

    assert verify_log(path, take).sound
    return replay


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return tmp_path / "audit.jsonl"


def requests() -> list[tuple[dict[str, Any], dict[str, Any]]]:
    good: dict[str, Any] = dict(bench.PARAMETERS["move"])
    strange: list[Any] = [
        nan, inf, -inf, -0.0, 5e-324, True, "fast", None, 10**400, 1j, b"x", [0.1], {"float": "nan"},
        {"unencodable": "complex"}, {"dict": {"float": "nan"}}, {1: 2}, "\ud800", object(),
    ]  # fmt: skip
    return [
        (good, {}),
        ({**good, "speed": 1.0}, {}),
        ({**good, "target": (9.0, nan, 0.25)}, {}),
        ({}, {}),
        ({**good, "zeal": 1, "aim": 2}, {}),
        (good, {"stop_pressed": True}),
        (good, {"human_distance": 0.25}),
        (good, {"human_distance": nan, "dirt": "much", "unheard_of": 1.0}),
        *(({**good, "speed": value}, {}) for value in strange),
        *((good, {"human_distance": value}) for value in strange if type(value) is not object),
    ]


def test_whatever_was_asked_for_is_decided_the_same_again(log: Path) -> None:
    made = [decided(parameters, **state) for parameters, state in requests()]
    verdicts = [decision.verdict for decision, _ in made]
    assert {Verdict.ALLOW, Verdict.DENY} <= set(verdicts)
    replay = replayed(*(("decision", details) for _, details in made), path=log)
    assert replay.disagreements == []
    assert replay.agreed == len(made)
    assert 0 < replay.verdict_only < len(made) / 2


@pytest.mark.parametrize("mode", [GateMode.Z3, GateMode.SHADOW])
def test_every_gate_decides_it_the_same_again(mode: GateMode, log: Path) -> None:
    made = [decided(parameters, **state)[1] for parameters, state in requests()[:8]]
    replay = replayed(*(("decision", one) for one in made), gate=bench.gate(mode), path=log)
    assert (replay.disagreements, replay.agreed) == ([], len(made))


def test_a_request_too_large_to_record_is_compared_by_its_verdict(log: Path) -> None:
    _, details = decided({**bench.PARAMETERS["move"], "speed": "x" * 2_000_000})
    replay = replayed(("decision", details), path=log)
    assert (replay.agreed, replay.verdict_only, replay.disagreements) == (1, 1, [])


ALTERED: list[tuple[str, dict[str, Any], str]] = [
    ("another verdict", {"verdict": "DENY"}, ""),
    ("another action executed", {"decided": {"kind": "move", "parameters": {}}}, ""),
    ("a reason too many", {"reasons": [["AE750", "x", "y"]]}, ""),
    ("another state", {"state": {}}, "the state is not the one whose digest is recorded"),
    ("a state that denies", {"state": {}, "state_digest": digest_of({})}, ""),
    ("another configuration", {"configuration": "0" * 64}, "it was decided under the configuration 000"),
    ("no usage", {"usage": None}, "the use of quotas is recorded if and only if the clock was in order"),
    ("more used up", {"usage": {"unheard": 5}}, ""),
    ("another caller", {"module": "unheard_of"}, ""),
    ("no action", {"asked": "move"}, "the record is not one of a decision"),
    ("no time", {"time": None}, "the record is not one of a decision"),
]


@pytest.mark.parametrize(
    ("changes", "why"), [case[1:] for case in ALTERED], ids=[case[0] for case in ALTERED]
)
def test_a_record_that_does_not_come_out_the_same_is_named(
    changes: dict[str, Any], why: str, log: Path
) -> None:
    _, details = decided(bench.PARAMETERS["move"])
    replay = replayed(("note", {}), ("decision", {**details, **changes}), path=log)
    (found,) = replay.disagreements
    assert found.sequence == 1
    assert found.why.startswith(why)
    assert (found.again is None) == bool(why)


@pytest.mark.parametrize("name", ["time", "state", "usage", "module", "skill", "inputs", "asked"])
def test_a_record_that_lacks_something_is_not_decided_again(name: str, log: Path) -> None:
    _, details = decided(bench.PARAMETERS["move"])
    del details[name]
    (found,) = replayed(("decision", details), path=log).disagreements
    assert found.why == f"the record does not hold its {name}"


def test_a_clock_that_went_back_denies_again_and_a_new_session_has_a_new_clock(log: Path) -> None:
    decision, details = decided(bench.PARAMETERS["move"])
    assert decision.verdict is Verdict.ALLOW
    clock = Usage(())
    clock.count(bench.NOW)
    with pytest.raises(ClockError) as wrong:
        clock.count(bench.NOW - 1)
    readings = bench.measured(bench.STATE)
    denied = decision_details(
        denied_by_clock(wrong.value), details["configuration"], bench.NOW - 1, readings, CALLER,
        Action("move", {}), None,
    )  # fmt: skip
    opened = session_details(bench.configuration())
    records = [("decision", details), ("decision", denied)]
    assert replayed(*records, ("session-opened", opened), records[0], path=log).disagreements == []
    (found,) = replayed(("session-opened", opened), records[1], path=log.with_name("other")).disagreements
    assert found.why.startswith("the use of quotas is recorded if and only if")


def test_gates_that_disagree_are_named_with_the_record(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    gate = Gate(bench.configuration())

    def disagree(*given: Any) -> Decision:
        raise GateDisagreementError("compiled gate: ALLOW; z3: DENY")

    monkeypatch.setattr(gate, "decide", disagree)
    _, details = decided(bench.PARAMETERS["move"])
    (found,) = replayed(("decision", details), gate=gate, path=log).disagreements
    assert (found.sequence, found.why, found.again) == (0, "compiled gate: ALLOW; z3: DENY", None)


def test_readings_are_recorded_with_their_times(log: Path) -> None:
    _, details = decided(bench.PARAMETERS["move"])
    with AuditLog(log) as opened:
        opened.append("decision", details)
    state = json.loads(log.read_bytes())["details"]["state"]
    assert state["human_distance"] == [3.0, Reading(3.0, bench.NOW).time]
