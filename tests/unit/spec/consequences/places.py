"""A base that a drive moves, a survey that nothing moves, and a distance that changes by itself."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

from aeros.spec.expr import terms as t
from aeros.spec.expr.parser import parse
from aeros.spec.expr.scope import Scope
from aeros.spec.expr.typecheck.check import check
from aeros.spec.expr.types import BOOL, IntegerType, RealType
from aeros.spec.expr.units import NUMBER
from aeros.spec.model.ecm import ActionCondition, Outcome, Skill
from aeros.spec.model.perception import Definition
from aeros.spec.model.rules import ActionKind, Risk
from aeros.spec.model.site import Site
from aeros.spec.model.tools import HttpService, Tool
from tests.unit.agent.dumplings import SPAN, skill, state
from tests.unit.agent.dumplings import site as kitchen

REAL = RealType(NUMBER)
STATE = {
    "base": replace(state("base", REAL), sensor="odometry"),
    "distance": replace(state("distance", REAL), sensor="scanner"),
    "m.dock": replace(state("m.dock", REAL), sensor="survey"),
    "m.cup": replace(state("m.cup", REAL), sensor="m.view"),
    "m.time": replace(state("m.time", REAL), sensor="m.time"),
    "m.count": replace(state("m.count", IntegerType(NUMBER)), sensor="m.view"),
    "holding": replace(state("holding"), sensor="odometry"),
    **{name: state(name) for name in ("m.docked", "m.far", "m.cup_near", "m.free", "m.known", "m.alone")},
}
TEXTS = {
    "m.docked": "base - m.dock <= 1 and m.dock - base <= 1",
    "m.far": "base >= 5",
    "m.cup_near": "m.cup <= 2",
    "m.free": "not holding and m.count == 0",
    "m.known": "m.time > 0",
    "m.alone": "distance > 2 and m.free",
}


def term(text: str) -> t.Term:
    return check(parse(text), Scope({name: one.variable for name, one in STATE.items()}), BOOL)


DEFINITIONS = {name: Definition(term(text), text, SPAN) for name, text in TEXTS.items()}
KINDS = {
    "drive": ActionKind("drive", frozenset({"wheels"}), Risk.LOW, False, {}, SPAN),
    "wait": ActionKind("wait", frozenset(), Risk.LOW, False, {}, SPAN),
    "ask": ActionKind(
        "ask",
        frozenset(),
        Risk.LOW,
        False,
        {},
        SPAN,
        Tool(HttpService("http://x"), Fraction(1), ("m.time",), None),
    ),
}
MOVED_BY = {"odometry": frozenset({"wheels"}), "survey": frozenset[str]()}


def site() -> Site:
    return replace(kitchen(), state=STATE, kinds=KINDS, moved_by=MOVED_BY, sensors={"survey": "places"})


def asking(name: str, *outcomes: Outcome, kinds: tuple[str, ...] = ("drive",)) -> Skill:
    """A skill that may ask for actions of these kinds."""
    envelope = {kind: ActionCondition(t.TRUE, "true", SPAN) for kind in kinds}
    return replace(skill(name, *outcomes), envelope=envelope)
