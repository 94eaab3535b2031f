"""Certificates: a loop without faults has one, and every false part of one is refuted."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from aeros.spec.closed_loop.symbolic import certificate
from aeros.spec.closed_loop.symbolic.analysis import SymbolicLoop
from aeros.spec.closed_loop.symbolic.certificate import CertificateTooLargeError
from aeros.spec.closed_loop.symbolic.program import PLAN, Place
from aeros.spec.obligations.verdicts import Verdict
from aeros.spec.verification.discharge import discharge_obligations
from tests.differential.planning.number_loops import term
from tests.unit.spec.closed_loop.symbolic.certificates import certificate_of
from tests.unit.spec.closed_loop.symbolic.loops_by_hand import COOKED, WRAPPED, counting, loop

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


def test_a_count_that_needs_one_plan_more_is_refuted() -> None:
    made = counting()
    rounds = made.fixpoints.hopeful
    rounds[0], rounds[1] = rounds[1], rounds[1]
    assert Verdict.REFUTED in verdicts(made)


def test_a_certificate_has_a_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(certificate, "MAX_SIZE", 10)
    with pytest.raises(CertificateTooLargeError):
        certificate_of(counting())
