from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from math import inf, nan
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.audit.check import Record
from aeros.runtime.audit.log import AuditLog, verify_log
from aeros.runtime.canonical_json import digest_of
from aeros.runtime.gate.configuration import (
    Configuration,
    FindConfiguration,
    UnknownConfigurationError,
    single_configuration,
)
from aeros.runtime.gate.decision import Caller, Decision, DecisionKind
from aeros.runtime.gate.gate import CompiledGate, GateDisagreementError, GateMode
from aeros.runtime.gate.quotas import ClockError, QuotaUsageCounter, clock_denial
from aeros.runtime.ports import Reading
from aeros.runtime.records.records import DecisionRecord, decision_details, session_details
from aeros.runtime.records.replay import LogReplay
from aeros.skill import Action
from tests.unit.runtime import bench

CALLER = Caller("handling", "quickly", {})


def decided(parameters: Mapping[str, Any], **state: Any) -> tuple[Decision, dict[str, Any]]:
    """Decide a `move`; return the decision and its record."""
    readings = bench.measured({**bench.STATE, **state})
    action = Action("move", dict(parameters))
    usage = dict.fromkeys((quota.id for quota in bench.configuration().site.quotas), 0)
    decision = bench.gate().decide(CALLER, readings, action, bench.NOW, usage)
    digest = bench.configuration().digest
    return decision, decision_details(
        DecisionRecord(decision, digest, bench.NOW, readings, CALLER, action, usage)
    )


OPENED = ("session-opened", session_details(bench.configuration()))


def replayed(
    *records: tuple[str, Mapping[str, Any]],
    mode: GateMode = GateMode.COMPILED,
    known: FindConfiguration | None = None,
    path: Path,
) -> LogReplay:
    """The records written to a log, in a session unless they are several, and decided again."""
    opened = () if any(event == "session-opened" for event, _ in records) else (OPENED,)
    with AuditLog(path) as log:
        for event, details in (*opened, *records):
            log.append(event, details)
    replay = LogReplay(known or single_configuration(bench.configuration()), mode)

    def take(record: Record, own: str) -> None:
        replay.replay_record(record)

    assert verify_log(path, take).is_sound
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


def test_every_request_is_decided_the_same_again(log: Path) -> None:
    made = [decided(parameters, **state) for parameters, state in requests()]
    verdicts = [decision.kind for decision, _ in made]
    assert {DecisionKind.ALLOW, DecisionKind.DENY} <= set(verdicts)
    replay = replayed(*(("decision", details) for _, details in made), path=log)
    assert replay.mismatches == []
    assert replay.matching_count == len(made)
    assert 0 < replay.verdict_only_count < len(made) / 2


@pytest.mark.parametrize("mode", [GateMode.Z3, GateMode.CHECKED])
def test_every_gate_decides_it_the_same_again(mode: GateMode, log: Path) -> None:
    made = [decided(parameters, **state)[1] for parameters, state in requests()[:8]]
    replay = replayed(*(("decision", one) for one in made), mode=mode, path=log)
    assert (replay.mismatches, replay.matching_count) == ([], len(made))


def test_a_request_too_large_to_record_is_compared_by_its_verdict(log: Path) -> None:
    _, details = decided({**bench.PARAMETERS["move"], "speed": "x" * 2_000_000})
    replay = replayed(("decision", details), path=log)
    assert (replay.matching_count, replay.verdict_only_count, replay.mismatches) == (1, 1, [])


ALTERED: list[tuple[str, dict[str, Any], str]] = [
    ("another verdict", {"verdict": "DENY"}, ""),
    ("another action executed", {"decided": {"kind": "move", "parameters": {}}}, ""),
    ("a reason too many", {"reasons": [["AE750", "x", "y"]]}, ""),
    ("another state", {"state": {}}, "the state does not match its recorded digest"),
    ("a state that denies", {"state": {}, "state_digest": digest_of({})}, ""),
    ("another configuration", {"configuration": "0" * 64}, "it names the configuration 000"),
    ("no usage", {"usage": None}, "the use of quotas must be recorded exactly if the clock was valid"),
    ("more used up", {"usage": {"carry-rate": 1}}, "the use of quotas differs: the earlier decisions"),
    ("another quota", {"usage": {"unheard": 5}}, "the use of quotas differs: the earlier decisions"),
    ("a motion", {"motion": {"motionless": "so"}}, "a motion must be recorded exactly if one was to be"),
    ("another caller", {"module": "unheard_of"}, ""),
    ("no action", {"asked": "move"}, "the record is not a decision"),
    ("no time", {"time": None}, "the record is not a decision"),
]


@pytest.mark.parametrize(
    ("changes", "why"), [case[1:] for case in ALTERED], ids=[case[0] for case in ALTERED]
)
def test_a_record_that_does_not_come_out_the_same_is_named(
    changes: dict[str, Any], why: str, log: Path
) -> None:
    _, details = decided(bench.PARAMETERS["move"])
    replay = replayed(("decision", {**details, **changes}), path=log)
    (found,) = replay.mismatches
    assert found.sequence == 1
    assert found.reason.startswith(why)
    assert (found.replayed is None) == bool(why)


@pytest.mark.parametrize("name", ["time", "state", "usage", "module", "skill", "inputs", "asked"])
def test_a_record_that_lacks_something_is_not_decided_again(name: str, log: Path) -> None:
    _, details = decided(bench.PARAMETERS["move"])
    del details[name]
    (found,) = replayed(("decision", details), path=log).mismatches
    assert found.reason == f"the record does not hold its {name}"


def test_a_clock_that_went_back_denies_again_and_a_new_session_has_a_new_clock(log: Path) -> None:
    decision, details = decided(bench.PARAMETERS["move"])
    assert decision.kind is DecisionKind.ALLOW
    clock = QuotaUsageCounter(())
    clock.usage_at(bench.NOW)
    with pytest.raises(ClockError) as wrong:
        clock.usage_at(bench.NOW - 1)
    readings = bench.measured(bench.STATE)
    denied = decision_details(DecisionRecord(
        clock_denial(wrong.value), details["configuration"], bench.NOW - 1, readings, CALLER,
        Action("move", {}), None,
    ))  # fmt: skip
    records = [("decision", details), ("decision", denied)]
    assert replayed(OPENED, *records, OPENED, records[0], path=log).mismatches == []
    (found,) = replayed(records[1], path=log.with_name("other")).mismatches
    assert found.reason.startswith("the use of quotas must be recorded exactly if")


def test_gates_that_disagree_are_named_with_the_record(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def disagree(*given: Any) -> Decision:
        raise GateDisagreementError(allowed, denied)

    allowed, denied = (Decision(kind, None, ()) for kind in (DecisionKind.ALLOW, DecisionKind.DENY))
    _, details = decided(bench.PARAMETERS["move"])
    monkeypatch.setattr(CompiledGate, "decide", disagree)
    (found,) = replayed(("decision", details), path=log).mismatches
    assert (found.sequence, found.reason) == (1, f"compiled gate: {allowed}; z3: {denied}")
    assert found.replayed is None


def test_readings_are_recorded_with_their_times(log: Path) -> None:
    _, details = decided(bench.PARAMETERS["move"])
    with AuditLog(log) as opened:
        opened.append("decision", details)
    state = json.loads(log.read_bytes())["details"]["state"]
    assert state["human_distance"] == [3.0, Reading(3.0, bench.NOW).time]


# Who governs.


def other() -> Configuration:
    """The same site and modules without what was proved: everything is decided at the gate."""
    return replace(bench.configuration(), certificates={}, digest="e" * 64)


def both(digest: str) -> Configuration:
    for one in (bench.configuration(), other()):
        if one.digest == digest:
            return one
    raise UnknownConfigurationError("nobody has it")


CHANGED = ("configuration-changed", session_details(other()))


def carried(used: int, configuration: Configuration, time: float = bench.NOW) -> tuple[str, dict[str, Any]]:
    """A `carry` that is decided after so many."""
    readings, action = bench.measured(bench.STATE, time), Action("carry", dict(bench.PARAMETERS["carry"]))
    usage = {"carry-rate": used}
    decision = CompiledGate(configuration).decide(CALLER, readings, action, time, usage)
    digest = configuration.digest
    return "decision", decision_details(
        DecisionRecord(decision, digest, time, readings, CALLER, action, usage)
    )


def test_a_log_is_decided_again_across_changes_of_the_configuration(log: Path) -> None:
    before, after = bench.configuration(), other()
    records = [carried(0, before), carried(1, before), CHANGED, carried(2, after), OPENED, carried(0, before)]
    asked: list[str] = []

    def known(digest: str) -> Configuration:
        asked.append(digest)
        return both(digest)

    replay = replayed(OPENED, *records, CHANGED, path=log, known=known)
    assert (replay.mismatches, replay.matching_count) == ([], 4)
    assert asked == [before.digest, after.digest]


def test_a_decision_under_another_configuration_than_the_one_in_force_is_named(log: Path) -> None:
    replay = replayed(carried(0, other()), CHANGED, carried(1, other()), path=log, known=both)
    (found,) = replay.mismatches
    assert found.sequence == 1
    assert (
        found.reason
        == f"it names the configuration {'e' * 64}, but {bench.configuration().digest} was in force"
    )
    assert replay.matching_count == 1


def test_a_configuration_that_is_not_to_be_had_is_named_and_nothing_is_agreed_to(log: Path) -> None:
    before, after = bench.configuration(), other()
    records = [carried(0, after), ("configuration-changed", OPENED[1]), carried(1, before)]
    replay = replayed(("session-opened", CHANGED[1]), *records, path=log, known=single_configuration(before))
    assert replay.matching_count == 0
    assert [found.reason for found in replay.mismatches] == [
        f"it was decided under the configuration {after.digest}, and the one given is {before.digest}",
        "the counts before it depend on an unknown configuration",
    ]


@pytest.mark.parametrize(
    ("changed", "sequences"),
    [
        ({"configuration": other().digest}, [1]),
        ({"configuration": "f" * 64}, [1]),
        ({"configuration": ["f"]}, [1]),
        ({"site": {"id": "bench", "digest": "f" * 64}}, [0]),
        ({"modules": {}}, [0]),
        ({"more": 1}, [0]),
    ],
)
def test_a_session_record_that_contradicts_its_configuration_is_a_mismatch(
    changed: dict[str, Any], sequences: list[int], log: Path
) -> None:
    opened = ("session-opened", {**OPENED[1], **changed})
    replay = replayed(opened, carried(0, bench.configuration()), path=log, known=both)
    assert [found.sequence for found in replay.mismatches] == sequences


def test_without_a_session_nothing_governs(log: Path) -> None:
    replay = replayed(carried(0, bench.configuration()), OPENED, path=log)
    (found,) = replay.mismatches
    assert found.reason == "no record before it says which configuration governs"


# What the quotas have counted.


def test_the_use_of_quotas_is_what_the_log_adds_up_to(log: Path) -> None:
    now, one = bench.NOW, bench.configuration()
    full = [carried(used, one, now + used) for used in (0, 1, 2, 3)]
    assert [details["verdict"] for _, details in full] == ["ALLOW", "ALLOW", "ALLOW", "DENY"]
    later = carried(2, one, now + 60.5)
    replay = replayed(*full, later, path=log)
    assert (replay.mismatches, replay.matching_count) == ([], 5)
    # The second is taken out, and the chain made anew.
    replay = replayed(full[0], *full[2:], path=log.with_name("other"))
    assert [found.sequence for found in replay.mismatches] == [2, 3]
    assert replay.mismatches[0].reason == (
        "the use of quotas differs: the earlier decisions give {'carry-rate': 1}, "
        "but {'carry-rate': 2} is recorded"
    )


def test_under_a_site_with_other_quotas_the_count_goes_on_as_it_did(log: Path) -> None:
    one = bench.configuration()
    (quota,) = one.site.quotas
    site = replace(one.site, quotas=(replace(quota, max_count=9),), digest="9" * 64)
    wider = replace(one, site=site, certificates={}, digest="8" * 64)
    changed = ("configuration-changed", session_details(wider))
    records = [carried(0, one), carried(1, one), changed, carried(0, wider), carried(1, wider)]
    found = {one.digest: one, wider.digest: wider}
    replay = replayed(*records, path=log, known=found.__getitem__)
    assert (replay.mismatches, replay.matching_count) == ([], 4)
