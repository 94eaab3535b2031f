"""The short way to ALLOW against the full way: what it answers is what the full way answers, to the bit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import event, given

from aeros.runtime import straight
from aeros.runtime.decision import Decision, Verdict
from aeros.runtime.gate import Gate
from tests.differential.test_gate_modes import fast_requests, requests
from tests.property.test_gate_corruption import COUNT, corruptions
from tests.unit.runtime.bench import ALLOWED, Request, configuration, request


def in_full(gate: Gate, asked: Request) -> Decision:
    """What the gate decides without its short way."""
    return gate._decider._in_full(asked.caller, asked.readings, asked.action, asked.now, asked.usage)


def shortly(gate: Gate, asked: Request) -> Decision | None:
    """What the short way answers."""
    functions = gate._decider._straight
    return straight.decide_straight(
        functions, asked.caller, asked.readings, asked.action, asked.now, asked.usage
    )


def differs(gate: Gate, asked: Request) -> bool:
    """Whether the short way allows what the full way does not, or another action."""
    answer = shortly(gate, asked)
    # The text tells 0.0 from -0.0, 1 from 1.0 and a list from a tuple.
    return answer is not None and repr(answer) != repr(in_full(gate, asked))


GATE = Gate(configuration())


@given(requests() | fast_requests())
def test_the_short_way_answers_as_the_full_way_on_well_formed_requests(asked: Request) -> None:
    assert not differs(GATE, asked)
    allowed = in_full(GATE, asked).verdict is Verdict.ALLOW
    event(f"allowed: {allowed}")
    assert (shortly(GATE, asked) is not None) is (allowed and _gives_every_input(asked))


def _gives_every_input(asked: Request) -> bool:
    """A step fills in the defaults, so the short way need not."""
    skill = configuration().modules[asked.caller.module].skills[asked.caller.skill]
    return set(asked.caller.inputs) == set(skill.inputs)


@pytest.mark.parametrize(("skill", "kind"), [one for one in ALLOWED if one[0] != "paced"])
def test_what_is_usual_is_allowed_the_short_way(skill: str, kind: str) -> None:
    assert shortly(GATE, request(skill, kind)) is not None


def test_the_short_way_takes_no_corrupted_request_that_the_full_way_refuses() -> None:
    answered = 0
    for asked in corruptions(seed=3, count=COUNT):
        assert not differs(GATE, asked)
        answered += shortly(GATE, asked) is not None
    assert answered > COUNT / 100  # zeros, whole numbers, lists, state that no rule reads


Mistake = Callable[[pytest.MonkeyPatch], None]


def _without(part: str, instead: str = "True") -> Mistake:
    """A short way whose checks leave out those that hold `part`."""
    right = straight._Writer._require

    def require(writer: straight._Writer, code: str) -> None:
        right(writer, code.replace(part, instead))

    return lambda patch: patch.setattr(straight._Writer, "_require", require)


MISTAKES: dict[str, Mistake] = {
    "a future reading": _without("<= time <= exactly", "<= time"),
    "a stale reading": _without("age <", "-1.0 <"),
    "no reading at all": _without("type(reading) is Reading"),
    "an unknown reading": _without("not others"),
    "a subclass of dict": _without("type(readings) is dict"),
    "a value out of range": _without("-2.0 <= "),
    "no truth value": _without("is True or", "is not None or"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_check_left_out_of_the_short_way_is_noticed(mistake: str, monkeypatch: pytest.MonkeyPatch) -> None:
    MISTAKES[mistake](monkeypatch)
    twin = Gate(configuration())

    def is_noticed(asked: Request) -> bool:
        try:
            return differs(twin, asked)
        except Exception:  # it must never raise either
            return True

    assert any(is_noticed(asked) for asked in corruptions(seed=4, count=20_000))


def test_conditions_left_out_of_the_short_way_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(straight._Writer, "condition", lambda *_: None)
    twin = Gate(configuration())
    assert differs(twin, request(speed=5.0))


def test_a_configuration_that_always_denies_has_no_short_way() -> None:
    old = configuration()
    site: Any = replace(old.site, access=replace(old.site.access, actuators=frozenset()))
    gate = Gate(replace(old, site=site))
    assert {kind for _, _, kind in gate._decider._straight} == {"stop"}
