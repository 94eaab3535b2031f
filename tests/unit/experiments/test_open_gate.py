"""The gate that allows everything, and a site without rules."""

from __future__ import annotations

from math import nan

import pytest

from aeros.experiments.open_gate import OpenGate, without_policy
from aeros.runtime.gate.compiled.rules import MonitorRules
from aeros.runtime.gate.decision import Caller, Decision, DecisionKind, Reason
from aeros.skill import act
from tests.unit.runtime.bench import configuration


@pytest.mark.parametrize("action", [act("move", speed=1e9), act("throw", force=nan), act("fly"), act("stop")])
def test_every_action_is_allowed_as_it_is(action: object) -> None:
    decision = OpenGate(configuration()).decide(Caller("nobody", "x", {}), {}, action, nan, {})  # type: ignore[arg-type]
    assert decision == Decision(DecisionKind.ALLOW, action, ())  # type: ignore[arg-type]


def test_others_change_no_decision() -> None:
    denied = Decision(DecisionKind.DENY, None, (Reason("AE751", "far", "too near"),))
    assert OpenGate(configuration()).decide_jointly(denied, {}, 0.0, ()) is denied


def test_another_configuration_makes_another_open_gate() -> None:
    gate = OpenGate(configuration())
    other = gate.with_configuration(without_policy(configuration()))
    assert type(other) is OpenGate
    assert other is not gate
    assert other.decide(Caller("m", "s", {}), {}, act("stop"), 0.0, {}).kind is DecisionKind.ALLOW


def test_its_monitor_rules_are_made_once() -> None:
    gate = OpenGate(configuration())
    assert isinstance(gate.monitor_rules, MonitorRules)
    assert gate.monitor_rules is gate.monitor_rules


def test_a_site_without_policy_keeps_its_vocabulary_and_modules() -> None:
    given = configuration()
    bare = without_policy(given)
    assert bare.modules is given.modules
    site = bare.site
    assert (site.rules, site.joint_rules, site.blocks, site.quotas, site.histories) == ((), (), (), (), ())
    assert site.motion is None
    assert (site.state, site.kinds, site.limits) == (given.site.state, given.site.kinds, given.site.limits)
    assert given.site.rules != ()
