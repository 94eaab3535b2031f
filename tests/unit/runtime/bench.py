"""The site and the module of the gate's tests, proved once, and requests that are allowed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import Caller, Decision, DecisionKind
from aeros.runtime.gate.gate import CompiledGate, GateMode
from aeros.runtime.ports import Reading
from aeros.runtime.proving import prove_configuration
from aeros.skill import Action
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.verification.reports import Report

SITE = Path(__file__).parent / "data" / "bench.yaml"
MODULE = Path(__file__).parent / "data" / "handling"
NOW = 100.0

STATE: Mapping[str, Any] = {
    "human_distance": 3.0,
    "stop_pressed": False,
    "fitted": "brush",
    "joint_angle": (0.25, -0.5),
    "joint_ready": (True, False),
    "hand": (0.25, 0.0, 0.25),
    "load": 0.5,
    "wind": 0.0,
    "gust": 10.0,
    "dirt": 0.5,
}
PARAMETERS: Mapping[str, Mapping[str, Any]] = {
    "move": {"target": (0.25, 0.125, 0.25), "speed": 0.0625},
    "carry": {"gait": 0.0078125},
    "sweep": {"tool": "knife", "wet": True, "pace": 1.0},
    "stop": {},
}
ALLOWED = (
    ("slowly", "move"),
    ("slowly", "carry"),
    ("slowly", "stop"),
    ("quickly", "move"),
    ("quickly", "carry"),
    ("quickly", "sweep"),
    ("paced", "carry"),
)


@cache
def proved() -> tuple[Configuration, Report]:
    return prove_configuration([MODULE], SITE, certified=False)


@cache
def unproved() -> Configuration:
    """The same site and module without a certificate, for tests that need no solver."""
    sink = Diagnostics()
    site = load_site(SITE, sink)
    assert site is not None, list(sink)
    loaded = load_ecm(MODULE, site, sink)
    assert loaded is not None, list(sink)
    return Configuration(site, {"handling": loaded.ecm}, {}, "c" * 64)


def configuration() -> Configuration:
    return proved()[0]


@cache
def gate(mode: GateMode = GateMode.COMPILED) -> CompiledGate:
    return CompiledGate(configuration(), mode)


def measured(values: Mapping[str, Any], time: Any = NOW) -> dict[str, Reading]:
    return {name: Reading(value, time) for name, value in values.items()}


@dataclass(frozen=True)
class Request:
    """Arguments of `decide`; every field may be anything."""

    caller: Any
    readings: Any
    action: Any
    now: Any = NOW
    usage: Any = field(default_factory=lambda: {"carry-rate": 0})

    def decided_by(self, gate: CompiledGate) -> Decision:
        return gate.decide(self.caller, self.readings, self.action, self.now, self.usage)


def request(skill: str = "quickly", kind: str = "move", **changed: Any) -> Request:
    """An allowed request; `changed` are parameters and state variables by name."""
    parameters = {**PARAMETERS[kind], **{n: v for n, v in changed.items() if n in PARAMETERS[kind]}}
    values = {**STATE, **{name: value for name, value in changed.items() if name not in parameters}}
    inputs = {"tool": "brush"} if skill == "paced" else {}
    return Request(Caller("handling", skill, inputs), measured(values), Action(kind, parameters))


def without(asked: Request, name: str) -> Request:
    """The request with that state variable not measured."""
    return replace(asked, readings={key: one for key, one in asked.readings.items() if key != name})


def codes(decision: Decision) -> list[tuple[str, str]]:
    return [(reason.code, reason.rule) for reason in decision.reasons]


def denied(asked: Request, by: CompiledGate | None = None) -> list[tuple[str, str]]:
    """The reasons, by code and rule, of what must be a denial in every mode of the proved gate."""
    decision = asked.decided_by(by or gate())
    assert decision.kind is DecisionKind.DENY
    assert decision.action is None
    assert decision.reasons
    if by is None:
        assert all(asked.decided_by(gate(mode)) == decision for mode in GateMode)
    return codes(decision)
