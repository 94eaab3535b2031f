"""The conformance suite: every back end decides random and boundary cases as `semantics.py` does.

A run that met no comparison that is hard to decide, or only one truth value, is no evidence and fails as
well.

Needs hypothesis, a test extra: nothing in `aeros` imports this module.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Protocol

from hypothesis import HealthCheck, Phase, given, settings

from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower, values_by_scalar
from aeros.spec.expr.random_conditions import VARIABLES, ConditionCase, Ranges, Raw, cases, exact_environment
from aeros.spec.expr.semantics import evaluate, is_true

_NEAR_TIE_TOLERANCE = Fraction(1, 2**48)  # of the two sides: nearer than this is a hard comparison


@dataclass
class CaseCoverage:
    """What a run met."""

    true: int = 0
    false: int = 0
    close: int = 0


class Backend(Protocol):
    """A way to decide a condition at given values."""

    @property
    def name(self) -> str:
        """Shown when it fails."""

    def decide(
        self,
        term: t.Term,
        variables: Mapping[str, t.Variable],
        ranges: Ranges,
        values: Mapping[str, Raw],
    ) -> bool:
        """Whether `term` holds at `values`, which are inside `ranges`."""


class BackendConformanceError(AssertionError):
    """A back end differs from the definition, or a run was too easy to be evidence."""


def check_backend(
    backend: Backend, max_examples: int = 200, *, seeded: bool = True, shrink: bool = True
) -> CaseCoverage:
    """Raise `BackendConformanceError` unless `backend` decides every generated case as `semantics.evaluate` does.

    seeded: the same cases on every run; otherwise new ones.
    shrink: look for a smaller failing case before reporting.
    """
    coverage = CaseCoverage()
    phases = (Phase.generate, Phase.shrink) if shrink else (Phase.generate,)

    @settings(
        max_examples=max_examples,
        derandomize=seeded,
        database=None,
        deadline=None,
        phases=phases,
        report_multiple_bugs=False,
        suppress_health_check=list(HealthCheck),
    )
    @given(cases())
    def agrees(case: ConditionCase) -> None:
        expected = is_true(case.term, exact_environment(case.values))
        coverage.true += expected
        coverage.false += not expected
        coverage.close += is_near_tie(case)
        decided = backend.decide(case.term, VARIABLES, case.ranges, case.values)
        if decided is not expected:
            raise BackendConformanceError(f"{backend.name}: {decided}, by definition {expected}: {case}")

    agrees()
    if 0 in (coverage.true, coverage.false, coverage.close):
        raise BackendConformanceError(f"{backend.name}: {max_examples} examples are too few: {coverage}")
    return coverage


def is_near_tie(case: ConditionCase) -> bool:
    """Whether some comparison of the case has sides that are equal or nearly so, and not both constant."""
    scalars = values_by_scalar(VARIABLES, exact_environment(case.values))
    pending = [lower(case.term)]
    while pending:
        term = pending.pop()
        pending.extend(t.children(term))
        if isinstance(term, t.Compare):
            left, right = evaluate(term.left, scalars), evaluate(term.right, scalars)
            if (
                isinstance(left, Fraction)
                and isinstance(right, Fraction)
                and abs(left - right) <= _NEAR_TIE_TOLERANCE * (abs(left) + abs(right))
            ):
                return True
    return False
