"""A domain in PDDL means what it means to AEROS: read by a small interpreter, state by state."""

from __future__ import annotations

import itertools
import re
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from typing import Any

import pytest

from aeros.spec.closed_loop.invocation import State
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL, BoolType
from aeros.spec.model.ecm import Outcome
from aeros.spec.model.variables import Declared
from aeros.spec.planning.domain import PlanningDomain
from aeros.spec.planning.pddl import action_name, write_pddl
from tests.unit.agent.dumplings import AREA, SPAN, given_input, outcome, skill
from tests.unit.spec.planning.kitchen import BOIL, WRAP, choice_of, domain_of

Expression = str | list[Any]
COOKED, WRAPPED, ALIGNED = "dumpling_cooked", "dumpling_wrapped", "wrapper_aligned"


def parse(text: str) -> Expression:
    stack: list[list[Any]] = [[]]
    for word in re.findall(r"[()]|[^\s()]+", text):
        if word == "(":
            stack.append([])
        elif word == ")":
            done = stack.pop()
            stack[-1].append(done)
        else:
            stack[-1].append(word)
    (whole,) = stack[0]
    return whole  # type: ignore[no-any-return]


def holds(expression: Any, atoms: frozenset[str]) -> bool:
    match expression:
        case ["and", *parts]:
            return all(holds(part, atoms) for part in parts)
        case ["or", *parts]:
            return any(holds(part, atoms) for part in parts)
        case ["not", part]:
            return not holds(part, atoms)
        case [str(atom)]:
            return atom in atoms
    raise AssertionError(expression)


def applied(effect: Any, atoms: frozenset[str]) -> frozenset[str]:
    parts = effect[1:] if effect[:1] == ["and"] else [effect]
    gone = {part[1][0] for part in parts if part[0] == "not"}
    return (atoms - gone) | {part[0] for part in parts if part[0] != "not"}


class Pddl:
    """Content of the two files."""

    def __init__(self, domain: PlanningDomain, start: State, *excluded: tuple[State, str]) -> None:
        first, second = map(parse, write_pddl(domain, start, excluded))
        sections: Mapping[str, Any] = {
            one[0]: one[1:] for one in [*first[2:], *second[2:]] if one[0] != ":action"
        }
        self.actions = {one[1]: (one[5], one[7]) for one in first[2:] if one[0] == ":action"}
        self.predicates = {one[0] for one in sections[":predicates"]}
        self.init = frozenset(one[0] for one in sections[":init"])
        (self.goal,) = sections[":goal"]
        self.domain = domain

    def state(self, atoms: frozenset[str]) -> State:
        """The state that these atoms say."""
        assert atoms <= self.predicates
        found: list[Any] = []
        for name in self.domain.names:
            type_ = self.domain.variables[name].type
            if f"unknown-{name}" in atoms:
                found.append(None)
            elif isinstance(type_, BoolType):
                found.append(name in atoms)
            else:
                (value,) = (one.removeprefix(f"{name}-is-") for one in atoms if one.startswith(f"{name}-is-"))
                found.append(value)
        return tuple(found)


TORN = skill(
    "wrap",
    outcome("wrapped", {WRAPPED: True}),
    outcome("torn", {WRAPPED: True, ALIGNED: False}, failure=True),
    outcome("folded", {ALIGNED: True}),
    precondition=f"not {WRAPPED} or {ALIGNED}",
)
PUT = skill(
    "put", outcome("put", {"area": "pot"}), outcome("left", {"area": "table"}), precondition="not area == pot"
)
NEVER = Outcome("never", {COOKED: True}, False, Fraction(0), None)
DOMAINS = {
    "two steps": domain_of(BOIL, replace(WRAP, precondition=None)),
    "failures with more effects": domain_of(BOIL, TORN, goal=f"{COOKED} and {ALIGNED}"),
    "words": domain_of(
        PUT, skill("cook", outcome("cooked", {COOKED: True}), NEVER, precondition="area == pot")
    ),
    "words to reach": domain_of(PUT, goal="area == pot or area == table"),
}


@pytest.mark.parametrize("domain", DOMAINS.values(), ids=DOMAINS)
def test_an_action_can_be_done_and_ends_as_the_success_does_that_it_is_named_for(
    domain: PlanningDomain,
) -> None:
    options = [
        (None, False, True) if isinstance(domain.variables[name].type, BoolType) else (None, *AREA.members)
        for name in domain.names
    ]
    for state in itertools.product(*options):
        pddl = Pddl(domain, state)
        assert pddl.state(pddl.init) == state
        assert holds(pddl.goal, pddl.init) is (domain.goal(state) is True)
        expected = {}
        for choice in domain.choices:
            possible = [one for one in choice.skill.outcomes.values() if one.probability != 0]
            for one, (then, measured, _) in zip(possible, domain.after(choice, state), strict=True):
                if domain.can_start(choice, state) and not measured.failure:
                    expected[action_name(choice, one.id)] = then
        done = {
            name: pddl.state(applied(effect, pddl.init))
            for name, (condition, effect) in pddl.actions.items()
            if holds(condition, pddl.init)
        }
        assert done == expected


def test_an_excluded_action_is_not_done_in_the_states_it_is_excluded_in() -> None:
    domain = DOMAINS["two steps"]
    start, wrapped = (False, False), (False, True)

    def can_boil(at: State, *excluded: tuple[State, str]) -> bool:
        pddl = Pddl(domain, at, *excluded)
        return holds(pddl.actions["kitchen-boil-cooked"][0], pddl.init)

    assert can_boil(wrapped)
    assert not can_boil(wrapped, (wrapped, "kitchen-boil-cooked"))
    assert can_boil(wrapped, (start, "kitchen-boil-cooked"))
    assert can_boil(wrapped, (wrapped, "kitchen-wrap-wrapped"))
    assert can_boil(wrapped, ((None, True), "kitchen-boil-cooked"))
    assert not can_boil((None, True), ((None, True), "kitchen-boil-cooked"))


def test_a_choice_that_nothing_measured_lets_start_is_left_out() -> None:
    fill = skill("fill", outcome("filled", {COOKED: True}), precondition="fill_level > 0.5")
    assert Pddl(domain_of(fill), (False,)).actions == {}
    assert holds(Pddl(domain_of(BOIL, goal="fill_level > 0.5"), ()).goal, frozenset()) is False
    known = {"fill_level": Fraction(6, 10), COOKED: False}
    assert list(Pddl(domain_of(fill, known=known), (False,)).actions) == ["kitchen-fill-filled"]


def test_the_file_is_laid_out_for_people() -> None:
    domain_text, problem = write_pddl(DOMAINS["two steps"], (False, False))
    assert domain_text == (
        "(define (domain aeros)\n"
        "  (:requirements :adl)\n"
        "  (:predicates\n"
        "    (dumpling_cooked)\n"
        "    (dumpling_wrapped))\n"
        "  (:action kitchen-boil-cooked\n"
        "    :parameters ()\n"
        "    :precondition (dumpling_wrapped)\n"
        "    :effect (dumpling_cooked))\n"
        "  (:action kitchen-wrap-wrapped\n"
        "    :parameters ()\n"
        "    :precondition (and )\n"
        "    :effect (dumpling_wrapped)))\n"
    )
    assert problem == "(define (problem goal)\n  (:domain aeros)\n  (:init )\n  (:goal (dumpling_cooked)))\n"


def test_an_action_is_named_for_its_skill_inputs_and_outcome() -> None:
    now = Declared(t.Variable("inputs.now", BOOL, t.VariableRole.INPUT), SPAN)
    force = given_input("force", Fraction(1), (Fraction(0), Fraction(1)))
    press = replace(skill("press", outcome("done", {COOKED: True})), inputs={"now": now, "force": force})
    names = [action_name(one, "done") for one in domain_of(press).choices]
    assert names == ["kitchen-press-false-done", "kitchen-press-true-done"]
    odd = replace(choice_of(domain_of(BOIL), "boil"), inputs={"x": Fraction(-1, 2), "y": 0.5})
    assert action_name(odd, "cooked") == "kitchen-boil-minus-1-over-2-0-point-5-cooked"
