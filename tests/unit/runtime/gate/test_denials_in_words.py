"""Texts of denials: each objection of the gate says in words what is wrong, with the names concerned."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from aeros.runtime.gate.decision import Caller
from aeros.runtime.gate.gate import CompiledGate, GateMode
from aeros.runtime.ports import Reading
from aeros.skill import Action
from aeros.spec.model.policy import OperatorOverride
from aeros.spec.model.rules import Risk
from tests.unit.runtime.bench import NOW, Request, gate, request, without
from tests.unit.runtime.gate.test_gate import changed, skill_changed


def _texts(asked: Request, by: CompiledGate) -> list[str]:
    return [reason.text for reason in asked.decided_by(by).reasons]


def _asked(caller: Caller | None = None, action: Action | None = None, **more: Any) -> Request:
    asked = request()
    fields = {"caller": caller or asked.caller, "action": action or asked.action}
    return replace(asked, **fields, **more)


_MOVE = request().action.parameters
_READINGS = request().readings

_REQUESTS: dict[str, tuple[Callable[[], Request], list[str]]] = {
    "caller": (lambda: replace(request(), caller=None), ["the caller is not a module's skill"]),
    "action": (lambda: replace(request(), action=None), ["the action is not an action of some kind"]),
    "mapping": (lambda: replace(request(), usage=None), ["`usage` is not a mapping by name"]),
    "time": (
        lambda: replace(request(), now=None),
        ["the time of the request is not a number of seconds on a clock"],
    ),
    "kind": (
        lambda: _asked(action=Action("fly", {})),
        ["`fly` is not an action kind of this site"],
    ),
    "module": (
        lambda: _asked(Caller("handlin", "quickly", {})),
        ["`handlin` is not an active module", "`move` is not in the envelope of the skill"],
    ),
    "skill": (
        lambda: _asked(Caller("handling", "fast", {})),
        ["`handling` has no skill `fast`", "`move` is not in the envelope of the skill"],
    ),
    "envelope": (lambda: request("slowly", speed=0.125), ["outside the envelope of the skill"]),
    "rule": (
        lambda: request(stop_pressed=True),
        ["breaks `not stop_pressed`: nothing goes on"],
    ),
    "unknown parameter": (
        lambda: _asked(action=Action("move", {**_MOVE, "haste": 1.0})),
        ["`haste` is not declared of `move`"],
    ),
    "unknown input": (
        lambda: _asked(Caller("handling", "quickly", {"limit": 0.1})),
        ["`inputs.limit` is not declared of `quickly`"],
    ),
    "missing parameter": (
        lambda: _asked(action=Action("move", {"speed": 0.0625})),
        ["`target` of `move` is missing"],
    ),
    "unknown reading": (
        lambda: _asked(readings={**_READINGS, "mood": Reading(1.0, NOW)}),
        ["`mood` is not a state variable of this site"],
    ),
    "missing reading": (lambda: without(request(), "human_distance"), ["`human_distance` is not measured"]),
    "bare reading": (
        lambda: _asked(readings={**_READINGS, "load": 3.0}),
        ["`load` is not a value with a time"],
    ),
    "unknown quota": (
        lambda: _asked(usage={**request().usage, "others": 0}),
        ["`others` is not a quota of this site"],
    ),
    "count": (
        lambda: _asked(usage=dict.fromkeys(request().usage, -1)),
        ["the use of `carry-rate` is not a whole number of at least 0"],
    ),
    "unknown count": (
        lambda: replace(request("quickly", "carry"), usage={}),
        ["the use of the quota `carry-rate` is unknown"],
    ),
    "used up": (
        lambda: replace(request("quickly", "carry"), usage={"carry-rate": 3}),
        ["the quota `carry-rate` of 3 is used up"],
    ),
}


@pytest.mark.parametrize("name", _REQUESTS)
@pytest.mark.parametrize("mode", [GateMode.COMPILED, GateMode.Z3])
def test_an_objection_to_a_request_is_in_words(name: str, mode: GateMode) -> None:
    make, expected = _REQUESTS[name]
    assert _texts(make(), gate(mode)) == expected


_GATES: dict[str, tuple[Callable[[], CompiledGate], str]] = {
    "blocked": (
        lambda: changed(site={"blocks": (OperatorOverride("lent", "it is lent", "handling", None, None),)}),
        "the operator blocks it: it is lent",
    ),
    "no permission": (
        lambda: changed(ecm={"permitted_actions": {}}),
        "outside the permission of the module",
    ),
    "actuator": (
        lambda: skill_changed("quickly", actuators=frozenset()),
        "`quickly` may not move `arm`",
    ),
    "risk of the kind": (
        lambda: skill_changed("quickly", risk=Risk.LOW),
        "`move` carries more risk than `quickly` declares",
    ),
    "risk of the skill": (
        lambda: changed(site={"risk_ceiling": Risk.LOW}),
        "`quickly` carries more risk than the site allows",
    ),
}


@pytest.mark.parametrize("name", _GATES)
def test_an_objection_of_the_policy_is_in_words(name: str) -> None:
    make, expected = _GATES[name]
    assert _texts(request(), make()) == [expected]
