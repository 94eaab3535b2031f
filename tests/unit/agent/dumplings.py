"""The dumpling task of the paper's Appendix A, as models built by hand."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from fractions import Fraction
from typing import Any, TypeVar

from aeros.spec.diagnostics.source import Source, SourceSpan
from aeros.spec.expr import terms as t
from aeros.spec.expr.parser import parse
from aeros.spec.expr.scope import Scope
from aeros.spec.expr.typecheck.check import check
from aeros.spec.expr.types import BOOL, EnumType, FamilyType, RealType, Type, VectorType
from aeros.spec.expr.units import LENGTH, NUMBER
from aeros.spec.model.ecm import ActionCondition, Ecm, Outcome, PlanningRule, Skill, Task
from aeros.spec.model.policy import Access, ModuleLimits
from aeros.spec.model.rules import Risk
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared

_Model = TypeVar("_Model")

SPAN = SourceSpan(Source("built-by-hand", ""), 0, 0)
PREDICATES = (
    "dough_on_workspace",
    "filling_on_workspace",
    "wrapper_aligned",
    "dumpling_wrapped",
    "dumpling_cooked",
)
AREA = EnumType("area", ("table", "pot"))
JOINTS = EnumType("joints", ("j1", "j2"))
_BLANKS: Mapping[str, Any] = {"Span": SPAN, "str": "", "Risk": Risk.LOW, "Access": Access()}


def build(kind: type[_Model], **given: Any) -> _Model:
    """A model with the fields that the agent does not read left blank."""
    for one in dataclasses.fields(kind):  # type: ignore[arg-type]  # every model is a dataclass
        defaults = (one.default, one.default_factory)
        if one.name not in given and all(default is dataclasses.MISSING for default in defaults):
            annotation = str(one.type)
            blank: Any = {} if annotation.startswith("Mapping") else ()
            blank = frozenset() if annotation.startswith("frozenset") else blank
            given[one.name] = _BLANKS.get(annotation, blank)
    return kind(**given)


def state(
    name: str,
    type_: Type = BOOL,
    range_: tuple[Fraction, Fraction] | None = None,
    max_age: Fraction | None = Fraction(5),
) -> Declared:
    return Declared(t.Variable(name, type_, t.VariableRole.STATE), SPAN, range=range_, max_age=max_age)


def given_input(name: str, default: Fraction | None, range_: tuple[Fraction, Fraction]) -> Declared:
    variable = t.Variable(f"inputs.{name}", RealType(NUMBER), t.VariableRole.INPUT)
    return Declared(variable, SPAN, range=range_, default_value=default)


_UNIT = (Fraction(0), Fraction(1))
STATE = {
    **{name: state(name) for name in PREDICATES},
    "fill_level": state("fill_level", RealType(NUMBER), _UNIT),
    "area": state("area", AREA),
    "tool": state("tool", VectorType(LENGTH), (Fraction(-1), Fraction(1))),
    "joint": state("joint", FamilyType(JOINTS, RealType(NUMBER)), (Fraction(-3), Fraction(3))),
}
FORCE = given_input("force", Fraction(1, 2), _UNIT)


def term(text: str) -> t.Term:
    scope = Scope(
        {name: declared.variable for name, declared in STATE.items()},
        inputs={"force": FORCE.variable},
        enums={"area": AREA, "joints": JOINTS},
    )
    return check(parse(text), scope, BOOL)


def outcome(name: str, effects: Mapping[str, Any], *, failure: bool = False) -> Outcome:
    return Outcome(name, effects, failure, probability=None, duration=None)


def skill(
    name: str,
    *outcomes: Outcome,
    precondition: str | None = None,
    inputs: Mapping[str, Declared] | None = None,
    hold: str | None = None,
) -> Skill:
    return build(
        Skill,
        id=name,
        precondition=None
        if precondition is None
        else ActionCondition(term(precondition), precondition, SPAN),
        hold_condition=None if hold is None else ActionCondition(term(hold), hold, SPAN),
        outcomes={one.id: one for one in outcomes},
        inputs=inputs or {},
        timeout=Fraction(60),
    )


def rule(
    unless: str, do: str, retry: int = 0, between_tries: str | None = None, on_failure: str | None = None
) -> PlanningRule:
    return PlanningRule(term(unless), unless, do, {}, retry, between_tries, on_failure, SPAN)


def task(name: str, words: tuple[str, ...], goal: str, *rules: PlanningRule) -> Task:
    return Task(name, words, term(goal), goal, rules, initial={}, scene=None, span=SPAN)


def module(name: str, skills: tuple[Skill, ...], *tasks: Task) -> Ecm:
    return build(Ecm, id=name, skills={one.id: one for one in skills}, tasks={one.id: one for one in tasks})


def site(retries: int = 3, replans: int = 10, *, stops_at_undeclared: bool = False) -> Site:
    limits = ModuleLimits(Fraction(60), retries, replans)
    return build(
        Site, id="kitchen", state=STATE, limits=limits, stops_on_undeclared_outcome=stops_at_undeclared
    )


SKILLS = (
    skill("prepare", outcome("prepared", {"dough_on_workspace": True, "filling_on_workspace": True})),
    skill("recover", outcome("aligned", {"wrapper_aligned": True})),
    skill(
        "wrap",
        outcome("wrapped", {"dumpling_wrapped": True}),
        outcome("misaligned", {"wrapper_aligned": False, "dumpling_wrapped": False}, failure=True),
        precondition="dough_on_workspace and filling_on_workspace and wrapper_aligned",
    ),
    skill(
        "boil",
        outcome("cooked", {"dumpling_cooked": True}),
        outcome("nothing_changed", {}, failure=True),
        precondition="dumpling_wrapped and inputs.force > 0",
        inputs={"force": FORCE},
    ),
)
RULES = (
    rule("dough_on_workspace and filling_on_workspace", "prepare"),
    rule("wrapper_aligned or dumpling_wrapped", "recover"),
    rule("dumpling_wrapped", "wrap", retry=2, between_tries="recover"),
    rule("dumpling_cooked", "boil"),
)
MAKE_DUMPLINGS = task("make_dumplings", ("dumpling", "make dumpling"), "dumpling_cooked", *RULES)
DUMPLING = module("dumpling", SKILLS, MAKE_DUMPLINGS)
CLEAN = module("clean", (), task("clean_table", ("clean", "wipe the table"), "area == table"))
