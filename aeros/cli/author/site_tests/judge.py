"""Judging of site tests: the gate decides the requests, the verifier proves the modules."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Final

from aeros.cli.author.site_tests.cases import CaseResult, DecisionCase, VerdictCase
from aeros.runtime.gate.decision import Decision
from aeros.runtime.gate.port import Gate
from aeros.spec.diagnostics.codes import Severity
from aeros.spec.verification.reports import Report

_INCOMPLETE: Final = frozenset(("AE701", "AE702", "AE703", "AE704"))
"""Codes of reasons that say that the test gives no complete request, and of no rule."""

Verify = Callable[[Path], Report]
"""Verifies one module under the site of the tests."""


def judge_cases(
    cases: Sequence[DecisionCase | VerdictCase], gate: Gate | None, verify: Verify
) -> Iterator[CaseResult]:
    """Compare each expectation with the decision or verdict.

    Args:
        cases: The tests.
        gate: Gate of the modules' configuration; None where no test expects a decision.
        verify: Verifies one module.

    Yields:
        The result of each test, in order.
    """
    for case in cases:
        if isinstance(case, VerdictCase):
            yield CaseResult(case, tuple(_verdict_problems(case, verify(case.module))))
        elif gate is not None:
            decision = gate.decide(case.caller, case.readings, case.action, case.now, case.usage)
            yield CaseResult(case, tuple(_decision_problems(case, decision)))


def _decision_problems(case: DecisionCase, decision: Decision) -> Iterator[str]:
    """Yield the differences from the expected decision, and its reasons if there is one."""
    named = {name for reason in decision.reasons for name in (reason.rule, reason.code)}
    missing = [name for name in case.by if name not in named]
    wrong = decision.kind.value != case.kind
    if wrong:
        by = f" by {', '.join(case.by)}" if case.by else ""
        yield f"expected {case.kind}{by}, decided {decision.kind.value}"
    elif missing:
        yield f"{decision.kind.value}, but no reason names {', '.join(missing)}"
    elif not case.by and decision.reasons and {reason.code for reason in decision.reasons} <= _INCOMPLETE:
        missing = ["a rule"]
        yield f"{decision.kind.value}, but only because the request or the state is incomplete"
    allowed = {} if decision.action is None else decision.action.parameters
    becomes = {} if wrong else case.becomes
    changed = [name for name, value in becomes.items() if not _is_same(value, allowed.get(name))]
    for name in changed:
        yield f"expected {name} = {_shown(case.becomes[name])}, became {_shown(allowed.get(name))}"
    if wrong or missing or changed:
        yield from (f"reason: {reason.code} {reason.rule}: {reason.text}" for reason in decision.reasons)


def _is_same(expected: object, found: object) -> bool:
    """Compare values; doubles may differ by rounding."""
    if isinstance(expected, tuple) and isinstance(found, tuple | list):
        return len(expected) == len(found) and all(map(_is_same, expected, found))
    if isinstance(expected, float) and isinstance(found, float):
        return math.isclose(expected, found, rel_tol=1e-9)
    return expected == found


def _shown(value: object) -> str:
    return f"{value:.9g}" if isinstance(value, float) else str(value)


def _verdict_problems(case: VerdictCase, report: Report) -> Iterator[str]:
    found = [
        one for subject in report.subjects for one in subject.diagnostics if one.severity is Severity.ERROR
    ]
    codes = {one.code for one in found}
    wrong = report.conclusion is not case.conclusion
    if wrong:
        yield f"expected {case.conclusion.value}, is {report.conclusion.value}"
    if case.codes is not None:
        yield from (f"expected error {code}, which is absent" for code in sorted(case.codes - codes))
    unexpected = codes if case.codes is None else codes - case.codes
    if wrong or case.codes is not None:
        yield from (f"error: {one.code} {one.headline}" for one in found if one.code in unexpected)
