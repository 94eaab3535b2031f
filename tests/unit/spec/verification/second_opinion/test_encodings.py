from __future__ import annotations

from dataclasses import replace

import pytest

from aeros.spec.backends import smtlib
from aeros.spec.backends.solver_process import SolverProcess
from aeros.spec.backends.solver_results import NoAnswerError, SatResult
from aeros.spec.backends.z3_expressions import Expressions
from aeros.spec.diagnostics.errors import DisagreementError
from aeros.spec.expr import terms as t
from aeros.spec.verification.second_opinion.encodings import compare_encodings
from tests.unit.spec.verification.second_opinion.queries import question

_ASKED = [question(3, SatResult.SAT), question(11, SatResult.UNSAT)]


def test_right_encodings_agree_with_the_definition_at_all_points() -> None:
    progress: list[str] = []
    found = compare_encodings(_ASKED, progress.append)
    assert (found.question_count, found.unread_questions) == (2, ())
    assert found.truth_count > 60
    assert progress[-1].startswith("2 of 2 questions")


def test_a_comparison_that_is_wrong_only_at_a_tie_is_found_in_the_encoding_for_z3(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    right = Expressions.comparison
    monkeypatch.setattr(
        Expressions, "comparison", lambda self, op, a, b: right(self, "<=" if op == "<" else op, a, b)
    )
    with pytest.raises(DisagreementError) as raised:
        compare_encodings(_ASKED, lambda _: None)
    definition, encoding = raised.value.answers
    assert definition == "the definition says False of assertion 3 at x = 3"
    assert encoding == "the encoding for Z3 says True"
    assert raised.value.about == "x > 3"


def test_a_comparison_that_is_wrong_only_at_a_tie_is_found_in_the_encoding_for_cvc5(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    right = smtlib._Script._scalar

    def wrong(self: smtlib._Script, term: t.Term) -> str:
        return right(self, replace(term, op="<=") if isinstance(term, t.Compare) else term)

    monkeypatch.setattr(smtlib._Script, "_scalar", wrong)
    with pytest.raises(DisagreementError) as raised:
        compare_encodings(_ASKED, lambda _: None)
    assert raised.value.answers[1] == "the encoding for cvc5 says True"


def test_a_range_that_is_too_narrow_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(smtlib._Script, "_range", lambda *_: ["(< 0.0 |x| 10.0)"])
    with pytest.raises(DisagreementError, match="says True of assertion 1 at x = 0"):
        compare_encodings(_ASKED, lambda _: None)


def test_a_question_that_is_not_read_is_named_with_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object, **__: object) -> None:
        raise NoAnswerError("no answer within 1 s")

    monkeypatch.setattr(SolverProcess, "ask", fail)
    found = compare_encodings(_ASKED[:1], lambda _: None)
    assert found.truth_count == 0
    assert found.unread_questions == (
        ("x > 3", "the encoding for Z3: no answer within 1 s"),
        ("x > 3", "the encoding for cvc5: no answer within 1 s"),
    )
