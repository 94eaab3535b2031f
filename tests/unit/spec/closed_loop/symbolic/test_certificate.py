"""Certificates: a loop without faults has one, and every false part of one is refuted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction

import pytest

from aeros.spec.closed_loop.symbolic import certificate, state_sets
from aeros.spec.closed_loop.symbolic.analysis import SymbolicLoop
from aeros.spec.closed_loop.symbolic.certificate import CertificateTooLargeError
from aeros.spec.closed_loop.symbolic.program import PLAN, REACHED, Place
from aeros.spec.closed_loop.symbolic.state_sets import StateSet, StateSets
from aeros.spec.expr.effects import QuantityRange
from aeros.spec.model.ecm import Outcome
from aeros.spec.model.step_graph import Seq
from aeros.spec.obligations.verdicts import Verdict
from aeros.spec.verification.discharge import discharge_obligations
from tests.differential.planning.number_loops import term
from tests.unit.agent.dumplings import outcome, rule, skill
from tests.unit.spec.closed_loop.symbolic.certificates import certificate_of
from tests.unit.spec.closed_loop.symbolic.loops_by_hand import (
    BOIL,
    COOKED,
    COOKING,
    WRAP,
    WRAPPED,
    counting,
    loop,
)
from tests.unit.spec.closed_loop.symbolic.test_composition_places import composed, one

KEPT = f"{WRAPPED} or not {COOKED}"
CLEAN = {COOKED: False, WRAPPED: False}


def verdicts(made: SymbolicLoop) -> set[Verdict]:
    return {one.verdict for one in discharge_obligations(certificate_of(made))}


@pytest.mark.parametrize("make", [lambda: loop(kept=KEPT, initial=CLEAN), counting])
def test_the_solver_confirms_a_loop_without_faults(make: Callable[[], SymbolicLoop]) -> None:
    assert verdicts(make()) == {Verdict.PROVED}


def lose_a_start(made: SymbolicLoop) -> None:
    made.fixpoints.reachable[PLAN] &= ~made.fixpoints.start


def lose_a_place(made: SymbolicLoop) -> None:
    made.fixpoints.reachable[Place("try", 1)] = made.fixpoints.sets.none


def lose_a_state(made: SymbolicLoop) -> None:
    made.fixpoints.reachable[Place("try", 1)] &= ~made.fixpoints.sets.where(term(WRAPPED))


def claim_a_state_that_violates(made: SymbolicLoop) -> None:
    made.fixpoints.reachable[Place("reached")] |= made.fixpoints.sets.where(term(f"not ({KEPT})"))


def claim_a_step_that_cannot_start(made: SymbolicLoop) -> None:
    sets, bits = made.fixpoints.sets, made.program.plan_bits
    due = sets.equals(bits[1], True) & ~sets.equals(bits[0], True)
    made.fixpoints.reachable[Place("try", 1)] |= due & sets.where(term(f"not {WRAPPED} and not {COOKED}"))


def claim_the_goal_too_near(made: SymbolicLoop) -> None:
    made.fixpoints.hopeful[0][Place("try", 0)] = made.fixpoints.sets.none


def claim_no_way_to_the_goal(made: SymbolicLoop) -> None:
    made.fixpoints.hopeful[-1][PLAN] = made.fixpoints.sets.none


@pytest.mark.parametrize(
    "spoil",
    [
        lose_a_start,
        lose_a_place,
        lose_a_state,
        claim_a_state_that_violates,
        claim_a_step_that_cannot_start,
        claim_the_goal_too_near,
        claim_no_way_to_the_goal,
    ],
)
def test_a_false_set_is_refuted(spoil: Callable[[SymbolicLoop], None]) -> None:
    made = loop(kept=KEPT, initial=CLEAN)
    assert made.fixpoints.reachable
    assert made.fixpoints.hopeful
    spoil(made)
    assert Verdict.REFUTED in verdicts(made)


ALIGN = skill("align", outcome("aligned", {"wrapper_aligned": True}))
FULL = QuantityRange("fill_level", None, Fraction(3, 4), Fraction(1))
POUR = skill(
    "pour",
    replace(outcome("poured", {}), ranges=(FULL,)),
    Outcome("spilt", {"fill_level": Fraction(1, 4)}, True, None, None),
)
SOUND: dict[str, Callable[[], SymbolicLoop]] = {
    "kept": lambda: loop(kept=KEPT, initial=CLEAN),
    "counting": counting,
    "handled": lambda: loop(
        rule(WRAPPED, "wrap", 1, "align", "align"), COOKING, skills=(WRAP, BOIL, ALIGN), initial=CLEAN
    ),
    "composed": lambda: composed(Seq((one("wrap", 1), one("boil")))),
    "poured": lambda: loop(
        rule("fill_level > 0.5", "pour", 1), skills=(POUR,), goal="fill_level > 0.5", kept="fill_level >= 0"
    ),
}


@pytest.mark.parametrize("name", SOUND)
def test_no_state_can_be_left_out_of_a_set_nor_be_nearer_to_the_goal(name: str) -> None:
    """The sets are least, so each claim is false of sets that differ from them by one state."""
    whole = SOUND[name]()
    rounds, reachable, none = whole.fixpoints.hopeful, whole.fixpoints.reachable, whole.fixpoints.sets.none
    assert verdicts(whole) == {Verdict.PROVED}
    for place in (place for place, states in reachable.items() if states != none):
        spoilt = SOUND[name]()
        sets, states = spoilt.fixpoints.sets, spoilt.fixpoints.reachable
        assert spoilt.fixpoints.hopeful
        states[place] &= ~state_of(sets, states[place])
        assert Verdict.REFUTED in verdicts(spoilt), place
        for number in range(len(rounds) if place != REACHED else 0):
            spoilt = SOUND[name]()
            sets, nearer = spoilt.fixpoints.sets, spoilt.fixpoints.hopeful[number]
            further = spoilt.fixpoints.reachable[place] & ~nearer[place]
            if further != sets.none:
                nearer[place] |= state_of(sets, further)
                assert Verdict.REFUTED in verdicts(spoilt), (place, number)


@pytest.mark.parametrize("name", ["kept", "counting", "poured"])
def test_sets_that_are_defined_by_nodes_of_their_diagrams_are_certified_as_well(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(state_sets, "MAX_CLAUSES", 0)
    made = SOUND[name]()
    for claim in made.certificate():
        names = [one.name for one, _ in claim.variables]
        assert sorted(set(names)) == sorted(names)
    assert any(claim.assumptions for claim in made.certificate())
    assert verdicts(made) == {Verdict.PROVED}
    states = made.fixpoints.reachable
    states[REACHED] &= ~state_of(made.fixpoints.sets, states[REACHED])
    assert Verdict.REFUTED in verdicts(made)


@pytest.mark.parametrize("level", [Fraction(3, 4), Fraction(7, 8), Fraction(1)])
def test_each_level_at_which_an_outcome_may_leave_a_quantity_is_certified(level: Fraction) -> None:
    goal = "fill_level > 0.5"
    made = loop(rule(goal, "pour"), skills=(POUR,), goal=goal, initial={"fill_level": Fraction(0)})
    assert verdicts(made) == {Verdict.PROVED}
    made.fixpoints.reachable[Place("try", 1)] &= ~made.fixpoints.sets.equals("fill_level", level)
    assert Verdict.REFUTED in verdicts(made)


def state_of(sets: StateSets, states: StateSet) -> StateSet:
    """A state of a set, as a set of its own."""
    return sets.intersection(sets.equals(*one) for one in sets.pick(states & sets.valid).items())


def test_claims_are_named_by_what_they_are_about() -> None:
    made = SOUND["handled"]()
    assert [one.subject for one in made.certificate()] == [
        "the start",
        "`reached`",
        "try 0 of rule 2",
        "try 0 of rule 1",
        "recovery 0 of rule 0",
        "place 2 inside a step",
        "try 1 of rule 0",
        "recovery 1 of rule 0",
        "try 0 of rule 0",
        "`plan`",
        "0 plans from try 0 of rule 2",
        "0 plans from try 0 of rule 1",
        "0 plans from try 1 of rule 0",
        "0 plans from recovery 1 of rule 0",
        "0 plans from try 0 of rule 0",
        "0 plans from `plan`",
        "every plan",
    ]


def test_a_count_that_needs_one_plan_more_is_refuted() -> None:
    made = counting()
    rounds = made.fixpoints.hopeful
    rounds[0], rounds[1] = rounds[1], rounds[1]
    assert Verdict.REFUTED in verdicts(made)


@pytest.mark.parametrize("most", [10, 117])
def test_a_certificate_has_a_limit(most: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(certificate, "MAX_SIZE", most)
    with pytest.raises(CertificateTooLargeError):
        certificate_of(counting())
    monkeypatch.setattr(certificate, "MAX_SIZE", 118)  # clauses of all its claims
    assert len(certificate_of(counting())) == 18
