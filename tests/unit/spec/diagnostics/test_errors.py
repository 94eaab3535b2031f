"""Errors that carry what they are about, also to another process."""

from __future__ import annotations

import pickle

import pytest

from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import (
    DisagreementError,
    InternalError,
    MisuseError,
    UndecidedError,
    UserError,
)

ONE, OTHER = Diagnostic("AE101", "`speeed` is unknown"), Diagnostic("AE102", "`id` is missing")


@pytest.mark.parametrize("kind", [UserError, UndecidedError])
def test_a_user_error_has_its_diagnostics_and_says_them(kind: type[UserError]) -> None:
    error = kind(iter((ONE, OTHER)))
    assert error.diagnostics == (ONE, OTHER)
    assert str(error) == "AE101: `speeed` is unknown; AE102: `id` is missing"
    assert str(kind([])) == ""


@pytest.mark.parametrize("kind", [UserError, UndecidedError])
def test_a_user_error_reaches_another_process_as_it_is(kind: type[UserError]) -> None:
    there = pickle.loads(pickle.dumps(kind((ONE, OTHER))))  # noqa: S301  we wrote it
    assert type(there) is kind
    assert (there.diagnostics, str(there)) == ((ONE, OTHER), str(kind((ONE, OTHER))))


def test_the_families_are_apart() -> None:
    assert not issubclass(UserError, MisuseError | InternalError)
    assert not issubclass(MisuseError, InternalError)
    assert issubclass(UndecidedError, UserError)


def test_a_disagreement_says_what_about_and_keeps_the_question() -> None:
    error = DisagreementError("the safety of `wrap`", "(check-sat)", "z3 says sat", "cvc5 says unsat")
    assert isinstance(error, InternalError)
    assert str(error) == "two answers about the safety of `wrap` differ: z3 says sat, but cvc5 says unsat"
    assert (error.about, error.script) == ("the safety of `wrap`", "(check-sat)")
    assert error.answers == ("z3 says sat", "cvc5 says unsat")
    there = pickle.loads(pickle.dumps(error))  # noqa: S301  we wrote it
    assert (str(there), there.script, there.answers) == (str(error), error.script, error.answers)
