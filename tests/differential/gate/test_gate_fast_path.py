"""The fast path of a decision agrees with the full path in every bit of its answer."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import event, given

from aeros.runtime.gate.compiled import fast_path
from aeros.runtime.gate.decision import Decision, DecisionKind
from aeros.runtime.gate.gate import CompiledGate
from tests.differential.gate.test_gate_modes import fast_requests, requests
from tests.differential.gate.test_gate_residue import shipped
from tests.property.test_gate_corruption import COUNT, corruptions
from tests.unit.runtime.bench import ALLOWED, Request, configuration, request


def in_full(gate: CompiledGate, asked: Request) -> Decision:
    """Decide without the fast path."""
    return gate._decider._decide_slow_path(asked.caller, asked.readings, asked.action, asked.now, asked.usage)


def shortly(gate: CompiledGate, asked: Request) -> Decision | dict[str, Any] | None:
    """Decide by the fast path alone."""
    functions = gate._decider._fast_paths
    return fast_path.decide_fast(
        functions, asked.caller, asked.readings, asked.action, asked.now, asked.usage
    )


def differs(gate: CompiledGate, asked: Request) -> bool:
    """Return true if the gate decides otherwise with its fast path than without."""
    if shortly(gate, asked) is None:
        return False
    # The text distinguishes 0.0 from -0.0, 1 from 1.0 and a list from a tuple.
    return repr(asked.decided_by(gate)) != repr(in_full(gate, asked))


GATE = CompiledGate(configuration())


@given(requests() | fast_requests())
def test_the_short_way_answers_as_the_full_way_on_well_formed_requests(asked: Request) -> None:
    assert not differs(GATE, asked)
    decided = in_full(GATE, asked)
    event(decided.kind.value)
    answer = shortly(GATE, asked)
    assert (answer is not None) is _gives_every_input(asked)
    if type(answer) is Decision:
        assert repr(answer) == repr(decided)
    elif answer is not None:
        assert {reason.code for reason in decided.reasons} == {"AE750"}  # a reduced action may be left


@pytest.mark.parametrize("every", [pytest.param(1, marks=pytest.mark.deep), 16])
def test_the_short_way_answers_as_the_full_way_on_the_shipped_modules(every: int) -> None:
    configuration, requested = shipped()
    asked = requested[::every]
    gate = CompiledGate(configuration)
    answers = [shortly(gate, one) for one in asked]
    denied = [one for one in answers if type(one) is Decision and one.kind is DecisionKind.DENY]
    assert len({one.reasons for one in denied}) > 20
    assert None not in answers
    assert not any(differs(gate, one) for one in asked)


def _gives_every_input(asked: Request) -> bool:
    """A step fills in the defaults, so the short way need not."""
    skill = configuration().modules[asked.caller.module].skills[asked.caller.skill]
    return set(asked.caller.inputs) == set(skill.inputs)


@pytest.mark.parametrize(("skill", "kind"), [one for one in ALLOWED if one[0] != "paced"])
def test_the_fast_path_allows_usual_actions(skill: str, kind: str) -> None:
    answer = shortly(GATE, request(skill, kind))
    assert type(answer) is Decision
    assert answer.kind is DecisionKind.ALLOW


def test_the_fast_path_denies_actions_that_break_rules() -> None:
    asked = request(stop_pressed=True, human_distance=0.0)
    answer = shortly(GATE, asked)
    assert type(answer) is Decision
    assert answer.kind is DecisionKind.DENY
    assert repr(answer) == repr(in_full(GATE, asked))


@pytest.mark.parametrize("used", [0, 1, 3, 4, 10**30])
def test_the_fast_path_decides_within_quotas(used: int) -> None:
    asked = replace(request("quickly", "carry"), usage={"carry-rate": used})
    assert type(shortly(GATE, asked)) is Decision
    assert not differs(GATE, asked)


def test_the_fast_path_allows_no_corrupted_request_that_the_full_path_refuses() -> None:
    answered: Counter[DecisionKind] = Counter()
    for asked in corruptions(seed=3, count=COUNT):
        assert not differs(GATE, asked)
        answer = shortly(GATE, asked)
        if type(answer) is Decision:
            answered[answer.kind] += 1
    # Zeros, whole numbers, lists, state that no rule reads.
    assert answered[DecisionKind.ALLOW] > COUNT / 100
    assert answered[DecisionKind.DENY] > COUNT / 1000


Mistake = Callable[[pytest.MonkeyPatch], None]


def _without(part: str, instead: str = "True") -> Mistake:
    """A short way whose checks leave out those that hold `part`."""
    right = fast_path._FastPathWriter.write_guard

    def require(writer: fast_path._FastPathWriter, code: str) -> None:
        right(writer, code.replace(part, instead))

    return lambda patch: patch.setattr(fast_path._FastPathWriter, "write_guard", require)


MISTAKES: dict[str, Mistake] = {
    "a future reading": _without("<= number <= exactly", "<= number"),
    "a stale reading": _without("age <", "-1.0 <"),
    "no reading at all": _without("type(reading) is Reading"),
    "a reading of any length": _without("len(reading) == 2"),
    "an unknown reading": _without("not others"),
    "a subclass of dict": _without("type(readings) is dict"),
    "a value out of range": _without("-2.0 <= "),
    "no truth value": _without("is True or", "is not None or"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_check_left_out_of_the_short_way_is_noticed(mistake: str, monkeypatch: pytest.MonkeyPatch) -> None:
    MISTAKES[mistake](monkeypatch)
    twin = CompiledGate(configuration())

    def is_noticed(asked: Request) -> bool:
        try:
            return differs(twin, asked)
        except Exception:  # it must never raise either
            return True

    assert any(is_noticed(asked) for asked in corruptions(seed=4, count=20_000))


def test_conditions_left_out_of_the_short_way_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        fast_path._FastPathWriter, "condition_codes", lambda _, terms, __: ["True"] * len(terms)
    )
    twin = CompiledGate(configuration())
    assert differs(twin, request(speed=5.0))


def test_reasons_left_out_of_the_short_way_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    right = fast_path._FastPathWriter.write_deny

    def deny(writer: fast_path._FastPathWriter, conditions: Sequence[str], criteria: Any, read: Any) -> None:
        right(writer, ["True"] * len(conditions), criteria, read)

    monkeypatch.setattr(fast_path._FastPathWriter, "write_deny", deny)
    twin = CompiledGate(configuration())
    assert differs(twin, replace(request("quickly", "carry"), usage={"carry-rate": 10**30}))


def test_a_denial_that_no_reading_changes_is_on_the_fast_path_with_every_reason() -> None:
    old = configuration()
    site: Any = replace(old.site, access=replace(old.site.access, actuators=frozenset()))
    gate = CompiledGate(replace(old, site=site))
    for asked in (request(), request(stop_pressed=True), request("quickly", "carry")):
        answer = shortly(gate, asked)
        assert type(answer) is Decision
        assert answer.reasons[0].code == "AE740"
        assert repr(answer) == repr(in_full(gate, asked))
