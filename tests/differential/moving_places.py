"""A small world for proofs about definitions: a robot on a line, and predicates that say where on it.

Written from the definitions, over places; it shares nothing with `aeros.spec.consequences`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from dataclasses import replace as with_changes
from fractions import Fraction
from itertools import product
from typing import Any, Final

from hypothesis import strategies as st

from aeros.spec.expr import terms as t
from aeros.spec.expr.constants import constant_term
from aeros.spec.expr.types import RealType
from aeros.spec.expr.units import NUMBER
from aeros.spec.model.ecm import ActionCondition, Ecm, Outcome, Skill
from aeros.spec.model.perception import Definition
from aeros.spec.model.policy import Access
from aeros.spec.model.rules import ActionKind, Risk
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared
from tests.unit.agent.dumplings import SPAN, module, site, skill, state

PLACES: Final = [Fraction(number, 2) for number in range(13)]
"""Each integer bound and a place between any two, so that every difference of definitions shows at one."""

PLAIN: Final = ("busy", "clean")
DEFINED: Final = ("m.at_a", "m.at_b")
NAMES: Final = (*PLAIN, *DEFINED)

_BASE: Final = t.Variable("base", RealType(NUMBER), t.VariableRole.STATE)


@dataclass(frozen=True)
class World:
    """Skills of one module, and what they do on the line.

    Attributes:
        ecm: the module.
        site: its site.
        bounds: first and last place where each defined predicate is true.
        moving: names of the skills that may drive.
    """

    ecm: Ecm
    site: Site
    bounds: Mapping[str, tuple[Fraction, Fraction]]
    moving: frozenset[str]

    def predicates(self, place: Fraction) -> dict[str, bool]:
        """The values that are measured at a place."""
        return {name: low <= place <= high for name, (low, high) in self.bounds.items()}

    def starts(self) -> Iterator[tuple[Fraction, dict[str, bool]]]:
        """Every place with every value of the plain predicates."""
        for place in PLACES:
            for values in product((False, True), repeat=len(PLAIN)):
                yield place, {**dict(zip(PLAIN, values, strict=True)), **self.predicates(place)}

    def can_start(self, one: Skill, values: Mapping[str, bool]) -> bool:
        clause = one.precondition
        return clause is None or all(values[name] for name in t.variables_of(clause.term))

    def endings(
        self, one: Skill, outcome: Outcome, place: Fraction, values: Mapping[str, bool]
    ) -> Iterator[tuple[Fraction, dict[str, bool]]]:
        """The places at which an outcome may leave the robot: all where its effects are true."""
        for then in PLACES if one.id in self.moving else [place]:
            after = {**values, **outcome.effects, **self.predicates(then)}
            if all(after[name] == value for name, value in outcome.effects.items()):
                yield then, after


def _condition(names: tuple[str, ...]) -> ActionCondition | None:
    if not names:
        return None
    return ActionCondition(t.conjunction(*(_variable(name) for name in names)), " and ".join(names), SPAN)


def _variable(name: str) -> t.Variable:
    return state(name).variable


def _between(low: Fraction, high: Fraction) -> t.Term:
    first, last = (constant_term(end, _BASE.type) for end in (low, high))
    return t.And((t.Compare("<=", first, _BASE), t.Compare("<=", _BASE, last)))


@st.composite
def worlds(draw: st.DrawFn) -> World:
    """Two predicates of places, which may overlap, and up to four skills, some of which drive."""
    bounds = {}
    for name in DEFINED:
        low = draw(st.integers(0, 5))
        bounds[name] = (Fraction(low), Fraction(draw(st.integers(low, min(low + 2, 6)))))
    skills = []
    moving = set()
    for number in range(draw(st.integers(2, 4))):
        id_ = f"skill_{number}"
        drives = draw(st.booleans())
        if drives:
            moving.add(id_)
        settable = NAMES if drives else PLAIN
        effect = st.dictionaries(st.sampled_from(settable), st.booleans(), max_size=2)
        outcomes = [Outcome("done", draw(effect), False, None, None)]
        outcomes += [
            Outcome(f"other_{at}", draw(effect), draw(st.booleans()), None, None)
            for at in range(draw(st.integers(0, 2)))
        ]
        needs = tuple(draw(st.lists(st.sampled_from(NAMES), max_size=2, unique=True)))
        made = skill(id_, *outcomes)
        envelope = {"drive" if drives else "wait": ActionCondition(t.TRUE, "true", SPAN)}
        skills.append(with_changes(made, precondition=_condition(needs), envelope=envelope))
    definitions = {name: Definition(_between(*ends), "", SPAN) for name, ends in bounds.items()}
    declared: dict[str, Declared] = {name: state(name) for name in NAMES}
    declared["base"] = with_changes(
        state("base", RealType(NUMBER), (PLACES[0], PLACES[-1])), sensor="odometry"
    )
    kinds = {
        "drive": ActionKind("drive", frozenset({"wheels"}), Risk.LOW, False, {}, SPAN),
        "wait": ActionKind("wait", frozenset(), Risk.LOW, False, {}, SPAN),
    }
    cell = with_changes(
        site(), state=declared, kinds=kinds, moved_by={"odometry": frozenset({"wheels"})}, access=Access()
    )
    ecm = with_changes(module("m", tuple(skills)), definitions=definitions)
    return World(ecm, cell, bounds, frozenset(moving))


def values_of(names: tuple[str, ...], values: Mapping[str, bool]) -> tuple[Any, ...]:
    """The values of a state in the order of its names."""
    return tuple(values[name] for name in names)
