"""Outcomes of skills as branches: each against the invocation of the same skill."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from itertools import product
from typing import Any

import pytest

from aeros.spec.closed_loop.invocation import Invocation
from aeros.spec.closed_loop.loop_variables import LoopVariables, StateSpaceError, skills_of
from aeros.spec.closed_loop.symbolic.program import afterwards
from aeros.spec.closed_loop.symbolic.skill_branches import SkillBranch, symbolic_skill
from aeros.spec.closed_loop.transition_system import TransitionSystem
from aeros.spec.expr.effects import QuantityRange
from aeros.spec.expr.semantics import evaluate, is_true
from tests.differential.planning.number_loops import Loop, number_loop, stopped_loop
from tests.differential.planning.test_defined_loops import defined_loop
from tests.unit.agent.dumplings import FORCE, outcome, rule, skill
from tests.unit.spec.closed_loop.symbolic.loops_by_hand import BOIL, COOKED, WRAPPED, loop


@pytest.mark.parametrize(
    "make", [number_loop, lambda seed: defined_loop(seed)[0], stopped_loop], ids=["any", "defined", "stopped"]
)
def test_branches_lead_where_the_invocation_does(make: Callable[[int], Loop]) -> None:
    for seed in range(20):
        with suppress(StateSpaceError):
            assert_same_ends(TransitionSystem(*make(seed)))


def test_branches_of_a_lost_hold_condition_are_unlikely_failures() -> None:
    held = skill("wrap", outcome("wrapped", {WRAPPED: True}), hold="wrapper_aligned")
    align = skill("align", outcome("aligned", {"wrapper_aligned": True}))
    made = loop(rule(WRAPPED, "wrap", 1, "align"), skills=(held, align, BOIL), goal=WRAPPED)
    assert_same_ends(made.system)
    found = symbolic_skill(held, {}, made.system.variables, made.system.names).branches
    assert [one.is_likely for one in found] == [True] + [False] * (len(found) - 1)
    assert len(found) > 1
    assert made.program.moves
    unlikely = [
        branch
        for place in made.program.moves
        for _, branch in made.program.branches(place)
        if not branch.is_likely and place.kind == "try"
    ]
    assert unlikely


@pytest.mark.parametrize("effects", [{}, {WRAPPED: True}, {WRAPPED: False, COOKED: False}])
def test_an_outcome_is_measured_where_its_effects_and_its_ranges_hold(effects: dict[str, bool]) -> None:
    ranges = [QuantityRange("fill_level", None, Fraction(low, 4), Fraction(low + 2, 4)) for low in range(3)]
    pour = skill(
        "pour",
        replace(outcome("poured", effects), ranges=(ranges[2],)),
        replace(outcome("spilt", {}, failure=True), ranges=(ranges[0],)),
        replace(outcome("half", {COOKED: False}, failure=True), ranges=(ranges[1],)),
    )
    goal = f"fill_level > 0.5 and {WRAPPED} and {COOKED}"
    assert_same_ends(loop(rule(WRAPPED, "pour"), skills=(pour,), goal=goal).system)


def assert_same_ends(system: TransitionSystem) -> None:
    """Each skill leads to the same states as a branch and as an invocation, also if it is stopped."""
    variables = system.variables
    for one in skills_of(system.ecm, system.task):
        made = symbolic_skill(one, {}, variables, system.names)
        listed = Invocation(one, {}, system.names, system.names, variables.after)
        states = list(product(*variables.values.values()))
        for state in states[:: max(1, len(states) // 40)]:
            env = dict(zip(system.names, state, strict=True))
            assert is_true(made.can_start, env) is listed.can_start(state)
            if listed.can_start(state):
                expected = {(after, ended.failure) for after, ended, _ in listed.after(state)}
                assert {end for each in made.branches for end in ends_of(each, env, variables)} == expected
                stopped = {after for each in made.stops for after, _ in ends_of(each, env, variables)}
                assert stopped == set(listed.stopped(state))


def ends_of(
    branch: SkillBranch, env: dict[str, Any], variables: LoopVariables
) -> Iterator[tuple[tuple[Any, ...], bool]]:
    """States in which a branch ends, each with true if the outcome that is measured there is a failure."""
    assert is_true(branch.guard, env)
    for chosen in product(*branch.opened.values()):
        opened = dict(zip(branch.opened, chosen, strict=True))
        known = env | {afterwards(variables.variables[name]).name: value for name, value in opened.items()}
        updated = {name: evaluate(term, known) for name, term in branch.updates.items()}
        is_success, is_failure = is_true(branch.is_success, known), is_true(branch.is_failure, known)
        assert is_success + is_failure == is_true(branch.agrees, known)
        if is_success or is_failure:
            after = {**env, **updated, **opened}
            yield tuple(after[name] for name in env), is_failure


def test_a_skill_whose_input_has_no_value_cannot_start() -> None:
    forced = skill(
        "press",
        outcome("pressed", {WRAPPED: True}),
        inputs={"force": replace(FORCE, default_value=None)},
        precondition="inputs.force > 0.4",
    )
    variables = loop().system.variables
    assert str(symbolic_skill(forced, {}, variables, ()).can_start) == str(
        symbolic_skill(forced, {"force": Fraction(1, 4)}, variables, ()).can_start
    )


def test_a_skill_is_settled_if_nothing_is_left_open() -> None:
    variables = loop().system.variables
    for either in ({}, {WRAPPED: None}, {"m.elsewhere": None}):
        ending = replace(outcome("cooked", {COOKED: True}), consequences=either)
        found = symbolic_skill(skill("boil", ending), {}, variables, ())
        assert found.is_settled is (WRAPPED not in either)
        assert [dict(one.opened) for one in found.branches] == [
            dict.fromkeys({*either} & {WRAPPED}, (False, True))
        ]
