"""Conformance suite: every back end decides random and boundary cases as `semantics.py` does.

A run fails too if it met no near tie, or only one truth value: such a run is no evidence.

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
from aeros.spec.expr.random_conditions import ConditionCase, Ranges, Raw, cases, exact_environment
from aeros.spec.expr.random_terms import VARIABLES
from aeros.spec.expr.semantics import evaluate, is_true

_NEAR_TIE_TOLERANCE = Fraction(1, 2**48)  # relative: sides nearer than this are hard to compare


@dataclass
class CaseCoverage:
    """Numbers of the cases that a run met.

    Attributes:
        true: number of conditions that are true.
        false: number of conditions that are false.
        close: number of conditions with a comparison that is nearly a tie.
    """

    true: int = 0
    false: int = 0
    close: int = 0


class Backend(Protocol):
    """Way to decide a condition at given values."""

    @property
    def name(self) -> str:
        """Name that error messages show."""

    def decide(
        self,
        term: t.Term,
        variables: Mapping[str, t.Variable],
        ranges: Ranges,
        values: Mapping[str, Raw],
    ) -> bool:
        """Decide `term` at one point.

        Args:
            term: boolean term over `variables`, well typed, without past-time operators.
            variables: every variable of the vocabulary, by name.
            ranges: closed range (SI) of each real scalar variable, by its name.
            values: measured value of each variable, inside `ranges`.

        Returns:
            The truth value of `term`.
        """


class BackendConformanceError(AssertionError):
    """Back end that differs from the definition, or a run that was too easy to be evidence."""


def check_backend(
    backend: Backend, max_examples: int = 200, *, seeded: bool = True, shrink: bool = True
) -> CaseCoverage:
    """Compare a back end with `semantics.evaluate` on generated cases.

    Args:
        backend: the back end under test.
        max_examples: number of cases.
        seeded: begin with the same cases on every run; otherwise with new ones. Hypothesis varies later
            cases by the hashes of what it has drawn, which differ between processes.
        shrink: look for a smaller failing case before reporting.

    Returns:
        Counts of the cases that the run met.

    Raises:
        BackendConformanceError: a decision differs from the definition, or the run met no true condition,
            no false condition or no near tie.
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
    """Say if the two sides of some comparison in the case are equal or nearly so.

    Args:
        case: condition with a value for each variable. Its quantifiers are expanded.

    Returns:
        True if two sides differ by at most 2**-48 of the sum of their magnitudes.
    """
    scalars = values_by_scalar(VARIABLES, exact_environment(case.values))
    for term in t.walk([lower(case.term)]):
        if isinstance(term, t.Compare):
            left, right = evaluate(term.left, scalars), evaluate(term.right, scalars)
            if (
                isinstance(left, Fraction)
                and isinstance(right, Fraction)
                and abs(left - right) <= _NEAR_TIE_TOLERANCE * (abs(left) + abs(right))
            ):
                return True
    return False
