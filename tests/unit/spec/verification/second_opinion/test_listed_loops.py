"""Closed loops that were proved by listing their states are proved again by certificates."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from aeros.spec.backends.oracle import Oracle
from aeros.spec.closed_loop.symbolic import analysis
from aeros.spec.closed_loop.symbolic.certificate import CertificateClaim, CertificateTooLargeError
from aeros.spec.diagnostics.errors import DisagreementError
from aeros.spec.expr import terms as t
from aeros.spec.model.ecm import PlanningRule
from aeros.spec.verification.second_opinion.listed_loops import ListedLoopsReport, certify_listed_loops
from tests.unit.agent.dumplings import site
from tests.unit.spec.closed_loop.symbolic.loops_by_hand import COOKED, COOKING, WRAPPED, loop

_KEPT = f"{WRAPPED} or not {COOKED}"


def certify(oracle: Oracle, kept: str = _KEPT, *rules: PlanningRule) -> ListedLoopsReport:
    """Prove a loop of two flags again; `rules` replace its planning rules."""
    made = loop(*rules, kept=kept, initial={COOKED: False, WRAPPED: False})
    return certify_listed_loops([(made.system.ecm, site())], oracle, lambda _: None)


def test_a_loop_without_faults_is_certified_by_questions_that_are_recorded() -> None:
    oracle = Oracle(recording=True)
    assert certify(oracle) == ListedLoopsReport(1, ())
    assert len(oracle.asked) > 3


@pytest.mark.parametrize(("kept", "rules"), [(f"not {COOKED}", ()), (_KEPT, (COOKING,))])
def test_a_loop_with_a_fault_is_left_to_its_witness(kept: str, rules: tuple[PlanningRule, ...]) -> None:
    assert certify(Oracle(), kept, *rules) == ListedLoopsReport(0, ())


def test_a_fault_that_only_the_sets_have_is_a_disagreement(monkeypatch: pytest.MonkeyPatch) -> None:
    faulty = loop(kept=f"not {COOKED}", initial={COOKED: False, WRAPPED: False})
    path = faulty.violation(faulty.system.task.invariants[0])
    monkeypatch.setattr(analysis.SymbolicLoop, "dead_end", lambda _: path)
    with pytest.raises(DisagreementError) as raised:
        certify(Oracle())
    assert raised.value.answers == ("listing its states finds no fault", "as sets of states it has one")
    assert "wrap → wrapped" in raised.value.script


@pytest.mark.parametrize("conclusion", [t.FALSE, t.TRUE])
def test_a_certificate_that_the_solver_refutes_is_a_disagreement(
    conclusion: t.Term, monkeypatch: pytest.MonkeyPatch
) -> None:
    claim = CertificateClaim("the start", (), (), conclusion)
    monkeypatch.setattr(analysis.SymbolicLoop, "certificate", lambda _: [claim])
    if conclusion == t.TRUE:
        assert certify(Oracle()).certified == 1
        return
    with pytest.raises(DisagreementError, match="the loop of"):
        certify(Oracle())


def test_a_certificate_that_is_too_large_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def too_large(_: object) -> Iterator[CertificateClaim]:
        raise CertificateTooLargeError

    monkeypatch.setattr(analysis.SymbolicLoop, "certificate", too_large)
    found = certify(Oracle())
    assert found.certified == 0
    ((name, reason),) = found.uncertified
    assert name.endswith(".cook")
    assert reason == "its certificate is too large"


def test_a_claim_that_the_budget_does_not_reach_leaves_the_loop_uncertified() -> None:
    found = certify(Oracle(1))
    assert found.certified == 0
    assert [reason.partition(" ")[2] for _, reason in found.uncertified] == [
        "claims of its certificate are undecided"
    ]
