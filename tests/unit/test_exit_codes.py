"""Exit codes: their numbers are kept, and each conclusion has its own."""

from __future__ import annotations

import pytest

from aeros.exit_codes import EXIT_CODES, Exit, exit_for
from aeros.spec.obligations.verdicts import Conclusion


def test_the_numbers_are_those_that_scripts_know() -> None:
    assert {code.name: int(code) for code in Exit} == {
        "SUCCESS": 0,
        "REJECTED": 1,
        "USAGE": 2,
        "UNDECIDED": 3,
        "INTERNAL_ERROR": 4,
        "INTERRUPTED": 130,
        "CLOSED_PIPE": 141,
    }


@pytest.mark.parametrize(
    ("conclusion", "code"),
    [(Conclusion.PROVED, 0), (Conclusion.REJECTED, 1), (Conclusion.UNDECIDED, 3)],
)
def test_each_conclusion_has_its_code(conclusion: Conclusion, code: int) -> None:
    assert exit_for(conclusion) == code


def test_no_conclusion_is_without_a_code() -> None:
    assert len({exit_for(conclusion) for conclusion in Conclusion}) == len(Conclusion)


def test_the_help_lists_every_number() -> None:
    assert all(f" {int(code)} " in EXIT_CODES for code in Exit)
