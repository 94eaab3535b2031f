"""A gate for programs: who asks, how old values are, and what was used of a quota."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from aeros.runtime.gate.decision import Decision, DecisionKind
from aeros.runtime.ports import Reading
from aeros.session.skill_gate import SkillGate, load_gate
from aeros.skill import Action, act
from aeros.spec.diagnostics.errors import MisuseError, UserError
from tests.unit.runtime.bench import MODULE, PARAMETERS, SITE, STATE, configuration, gate

MOVE = act("move", **PARAMETERS["move"])
CARRY = act("carry", **PARAMETERS["carry"])


def by(skill: str | None = None) -> SkillGate:
    return SkillGate(configuration(), gate(), skill)


def reasons(decision: Decision) -> list[str]:
    return [one.rule for one in decision.reasons]


class Recording:
    """A gate that keeps what it is asked."""

    def __init__(self) -> None:
        self.asked: tuple[Any, ...] = ()

    def decide(self, *asked: Any) -> Decision:
        self.asked = asked
        return Decision(DecisionKind.DENY, None, ())


def recorded(action: Action = MOVE, observation: Any = None, **more: Any) -> tuple[Any, ...]:
    recording = Recording()
    SkillGate(configuration(), recording, "slowly").decide(action, observation or {}, **more)  # type: ignore[arg-type]
    return recording.asked


def test_every_skill_is_named_with_its_module() -> None:
    assert by().skills == ("handling.slowly", "handling.quickly", "handling.paced")


def test_the_skill_is_named_once_or_each_time_and_the_last_word_counts() -> None:
    carry = act("carry", gait=0.05)  # more than `slowly` may, and within what `quickly` may
    assert by("quickly").decide(carry, STATE).kind is DecisionKind.ALLOW
    assert by("handling.slowly").decide(carry, STATE).kind is DecisionKind.DENY
    assert by("handling.slowly").decide(carry, STATE, skill="quickly").kind is DecisionKind.ALLOW
    assert by().decide(carry, STATE, skill="handling.slowly").kind is DecisionKind.DENY


def test_among_several_skills_one_must_be_named() -> None:
    with pytest.raises(MisuseError, match=r"name one as `skill`, of handling\.slowly, handling\.quickly"):
        by().decide(MOVE, STATE)


def test_a_single_skill_need_not_be_named() -> None:
    ecm = configuration().modules["handling"]
    only = replace(ecm, skills={"slowly": ecm.skills["slowly"]})
    single = SkillGate(replace(configuration(), modules={"handling": only}), gate())
    assert single.skills == ("handling.slowly",)
    assert single.decide(MOVE, STATE).kind is DecisionKind.ALLOW


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("slowli", "there is no skill `slowli`; did you mean `slowly`?"),
        ("zzz", "there is no skill `zzz`; there are handling.slowly, handling.quickly, handling.paced"),
        ("handling", "there is no skill `handling`; "),
        ("", "there is no skill ``; "),
    ],
)
def test_an_unknown_skill_is_reported_with_the_known_ones(name: str, message: str) -> None:
    with pytest.raises(MisuseError) as refused:
        by(name)
    assert str(refused.value).startswith(message)


def test_a_name_in_several_modules_is_ambiguous() -> None:
    modules = configuration().modules
    two = replace(configuration(), modules={**modules, "second": modules["handling"]})
    with pytest.raises(
        MisuseError, match=r"several modules have a skill `paced`: name one of handling\.paced, second"
    ):
        SkillGate(two, gate(), "paced")
    assert SkillGate(two, gate(), "second.paced").skills[-1] == "second.paced"


def test_values_are_of_now_unless_their_age_is_given() -> None:
    caller, readings, action, now, _ = recorded(
        MOVE, {"load": 0.5, "wind": 1.0}, time=10.0, ages={"wind": 0.25}
    )
    assert (caller.module, caller.skill, caller.inputs) == ("handling", "slowly", {})
    assert readings == {"load": Reading(0.5, 10.0), "wind": Reading(1.0, 9.75)}
    assert (action, now) == (MOVE, 10.0)
    assert recorded(MOVE, {"load": 0.5})[1] == {"load": Reading(0.5, 0.0)}


def test_inputs_are_passed_on() -> None:
    assert recorded(inputs={"limit": 0.1})[0].inputs == {"limit": 0.1}


def test_a_quota_is_unused_unless_a_count_is_given() -> None:
    assert recorded()[4] == {"carry-rate": 0}
    assert recorded(usage={"carry-rate": 2})[4] == {"carry-rate": 2}
    assert recorded(usage={"other": 2})[4] == {"carry-rate": 0, "other": 2}
    assert recorded()[4] == {"carry-rate": 0}  # the last call has changed nothing


def test_decisions_are_those_of_the_gate() -> None:
    asked = by("slowly")
    assert asked.decide(MOVE, STATE).action == MOVE
    assert reasons(asked.decide(MOVE, {**STATE, "human_distance": 0.25})) == ["separation"]
    assert reasons(asked.decide(MOVE, STATE, time=5.0, ages={"human_distance": 1.0})) == ["human_distance"]
    assert reasons(asked.decide(CARRY, STATE, usage={"carry-rate": 3})) == ["carry-rate"]
    assert asked.decide(MOVE, {}).kind is DecisionKind.DENY


# Loaded from files.


def test_a_gate_is_loaded_from_files_in_each_mode() -> None:
    for mode in ("compiled", "z3", "checked"):
        loaded = load_gate(str(MODULE), skill="slowly", site=str(SITE), mode=mode)
        assert loaded.skills == by().skills
        assert loaded.decide(act("stop"), STATE).kind is DecisionKind.ALLOW


def test_a_mode_that_is_none_is_refused_before_anything_is_read() -> None:
    with pytest.raises(MisuseError, match="there is no mode `fast`; there are compiled, z3, checked"):
        load_gate("nowhere", mode="fast")  # type: ignore[arg-type]


def test_unproved_claims_are_reported_in_full() -> None:
    with pytest.raises(UserError, match=r"^error\[AE130\] no-module: "):
        load_gate("nowhere", site=SITE)
