"""A claim in several situations is settled at once, or asked once for each that differs."""

from __future__ import annotations

from aeros.spec.diagnostics.codes import SpanLabel
from aeros.spec.diagnostics.source import Source
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL
from aeros.spec.flow.symbolic_paths import SymbolicState, SymbolicStates
from aeros.spec.model.variables import Declared
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.obligation import ClaimMode, LabelledConjunct, Obligation, VariableSpace
from aeros.spec.obligations.outcomes.per_situation import obligation_per_situation
from aeros.spec.obligations.verdicts import StaticClaim

SPAN = Source("generated", "x").span(0, 1)
STATE = {name: Declared(t.Variable(name, BOOL, t.VariableRole.STATE), SPAN) for name in "pq"}
P, Q = (one.variable for one in STATE.values())
CLAIM = Obligation(
    ClaimForm.STEP_READY("c", "s"),
    "AE851",
    ClaimMode.ALWAYS,
    VariableSpace(tuple(STATE.values()), ()),
    P,
    "headline",
    SpanLabel(SPAN),
    labelled_conjuncts=(LabelledConjunct(P, SpanLabel(SPAN, "p")),),
)


def situation(assigned: dict[str, bool], *known: t.Term) -> SymbolicState:
    return SymbolicState(frozenset(assigned.items()), frozenset(known))


def asked(situations: SymbolicStates) -> list[Obligation | StaticClaim]:
    return list(obligation_per_situation(CLAIM, ClaimForm.STEP_READY_CASE, situations, STATE, {}))


def test_a_claim_that_holds_wherever_it_matters_is_settled() -> None:
    assert asked({}) == [StaticClaim(CLAIM.id, None)]
    assert asked({situation({"p": True}): (), situation({"p": True, "q": False}): ("a",)}) == [
        StaticClaim(CLAIM.id, None)
    ]


def test_a_situation_in_which_it_certainly_fails_is_asked_alone_with_its_trace() -> None:
    found = asked({situation({}, Q): (), situation({"p": False}): ("s → lost",), situation({}): ()})
    assert [(str(one.id), one.conclusion, one.notes) for one in found if isinstance(one, Obligation)] == [
        ("composition/c/s/ready", t.FALSE, ("after\ns → lost\nthen p = false",))
    ]


def test_one_open_situation_has_the_name_of_the_claim_and_several_are_numbered() -> None:
    (only,) = asked({situation({}, Q): (), situation({"p": True}): ()})
    assert isinstance(only, Obligation)
    assert (str(only.id), only.conclusion) == ("composition/c/s/ready", P)
    assert only.space.assumptions == (Q,)
    several = asked({situation({}, Q): (), situation({}, t.Not(Q)): (), situation({"q": True}, Q): ()})
    assert [str(one.id) for one in several] == [f"composition/c/s/ready/{number}" for number in (1, 2)]


def test_parts_of_the_conclusion_are_stated_in_the_situation_too() -> None:
    (found,) = asked({situation({"p": False}): ()})
    assert isinstance(found, Obligation)
    assert [one.term for one in found.labelled_conjuncts] == [t.FALSE]
