"""Places inside compositions; `tests/differential/planning/test_symbolic_loops.py` compares their states."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest

from aeros.spec.closed_loop.loop_variables import StateSpaceError
from aeros.spec.closed_loop.symbolic.analysis import SymbolicLoop
from aeros.spec.closed_loop.symbolic.program import REACHED
from aeros.spec.closed_loop.transition_system import TransitionSystem
from aeros.spec.expr import terms as t
from aeros.spec.expr.effects import Increment, QuantityRange
from aeros.spec.expr.semantics import is_true
from aeros.spec.model.composition import Composition, Part, Step
from aeros.spec.model.ecm import Outcome
from aeros.spec.model.step_graph import FailingPart, Fallback, If, Par, RetriedPart, Seq
from tests.differential.planning.number_loops import STATE, term
from tests.unit.agent.dumplings import SPAN, module, outcome, rule, site, skill, task
from tests.unit.spec.closed_loop.symbolic.loops_by_hand import BOIL, COOKED, WRAP, WRAPPED

POURED = Outcome(
    "poured", {}, False, None, None, ranges=(QuantityRange("fill_level", None, Fraction(0), Fraction(1)),)
)
POUR = skill("pour", POURED)
ALIGNED = "wrapper_aligned"
ALIGN = skill("align", outcome("aligned", {ALIGNED: True}))
OTHERS = (
    skill("tear", outcome("torn", {}, failure=True)),
    skill("bake", outcome("baked", {COOKED: True})),
    skill("add", Outcome("added", {"count": Increment(Fraction(1))}, False, None, None)),
)
COUNTS = tuple(map(Fraction, range(5)))


def one(name: str, retry: int = 0) -> Step:
    return Step(name, name, {}, {}, retry, None, None, SPAN)


def composed(body: Part, goal: str = COOKED) -> SymbolicLoop:
    pursued = replace(task("cook", ("cook",), COOKED, rule(COOKED, "cooking")), goal=term(goal))
    ecm = replace(
        module("kitchen", (WRAP, BOIL, POUR, ALIGN, *OTHERS), pursued),
        compositions={"both": Composition("both", t.TRUE, None, body, {}, SPAN)},
        capabilities={"cooking": ("both",)},
    )
    return SymbolicLoop(TransitionSystem(ecm, pursued, replace(site(), state=STATE)))


def test_a_sequence_comes_to_its_end() -> None:
    made = composed(Seq((one("wrap", 1), one("boil"))))
    assert made.dead_end() is None
    sets, ended = made.fixpoints.sets, made.fixpoints.reachable[REACHED]
    assert ended & sets.where(term(f"{WRAPPED} and {COOKED}")) != sets.none
    assert ended & sets.where(term(f"not {COOKED}")) == sets.none


def test_a_condition_without_an_alternative_fails_where_it_is_false() -> None:
    made = composed(If(term(ALIGNED), ALIGNED, Seq((one("wrap"), one("boil"))), None, SPAN))
    path = made.dead_end()
    assert path is not None
    assert dict(zip(made.system.names, path.end, strict=True))[ALIGNED] is False
    other = If(term(ALIGNED), ALIGNED, Seq((one("wrap"), one("boil"))), one("align"), SPAN)
    assert composed(other).dead_end() is None


def test_alternatives_and_tries_follow_a_failure() -> None:
    check: Part = If(term(ALIGNED), ALIGNED, Seq(()), FailingPart(ALIGNED, SPAN), SPAN)
    assert composed(Seq((check, one("wrap"), one("boil")))).dead_end() is not None
    either: Part = Fallback((check, one("align")), SPAN)
    assert composed(Seq((either, one("wrap"), one("boil")))).dead_end() is None
    assert composed(RetriedPart(Seq((either, one("wrap"), one("boil"))), 1, SPAN)).dead_end() is None


def test_branches_come_forward_alone() -> None:
    made = composed(Par((Seq((one("wrap"), one("boil"))), one("align")), SPAN))
    inside = [place for place in made.program.moves if place.kind == "inside"]
    states = [made.fixpoints.reachable[place] for place in inside]
    sets = made.fixpoints.sets
    for ahead, behind in ((WRAPPED, ALIGNED), (ALIGNED, WRAPPED)):
        some = sets.where(term(f"{ahead} and not {behind}"))
        assert any(one & some != sets.none for one in states)


def test_the_failure_of_a_parallel_branch_is_no_way_to_the_goal() -> None:
    """Nothing tells how far the others are by then, though here a recovery would reach the goal."""
    tasked = composed(Par((one("tear"), one("align")), SPAN)).system.task
    for body, misses in ((one("tear"), False), (Par((one("tear"), one("align")), SPAN), True)):
        ecm = composed(body).system.ecm
        saved = replace(tasked, rules=(replace(tasked.rules[0], on_failure="bake"),))
        system = TransitionSystem(ecm, saved, replace(site(), state=STATE))
        assert (SymbolicLoop(system).dead_end() is not None) is misses


def test_a_count_inside_goes_on_within_its_range_only() -> None:
    program = composed(one("add"), "count >= 4").program
    guards = [
        branch.guard
        for place in program.moves
        for _, branch in program.branches(place)
        if "count" in branch.updates
    ]
    assert [[is_true(one, {"count": at}) for at in COUNTS] for one in guards] == [[True] * 4 + [False]]


def test_an_open_variable_inside_is_not_analysed() -> None:
    with pytest.raises(StateSpaceError, match=r"^a step of `both` leaves a variable at several values$"):
        _ = composed(one("pour"), "fill_level > 0.5").program
