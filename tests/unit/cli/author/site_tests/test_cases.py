"""A result passes if nothing differs from the expectation."""

from __future__ import annotations

from pathlib import Path

from aeros.cli.author.site_tests.cases import CaseResult, VerdictCase
from aeros.spec.diagnostics.source import Source
from aeros.spec.obligations.verdicts import Conclusion

CASE = VerdictCase("one", Source("a.yaml", "one").span(0, 3), Path("m"), Conclusion.PROVED, None)


def test_a_result_passes_without_problems_only() -> None:
    assert CaseResult(CASE, ()).is_passed
    assert not CaseResult(CASE, ("expected proved, is rejected",)).is_passed
