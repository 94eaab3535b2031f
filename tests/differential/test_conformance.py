from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import pytest

from aeros.spec.backends import compiled
from aeros.spec.expr.conformance import Backend, BackendConformanceError, check_backend
from aeros.spec.expr.semantics import is_true
from tests.differential.backends import (
    Closure,
    Constant,
    Floats,
    Inline,
    Lowered,
    NarrowBand,
    Smt,
    StrictOrder,
    TextForCvc5,
    Together,
)

_NIGHTLY = os.environ.get("AEROS_HYPOTHESIS") == "nightly"
_MORE = 100 if _NIGHTLY else 1


def _check(backend: Backend, examples: int) -> None:
    coverage = check_backend(backend, examples * _MORE, seeded=not _NIGHTLY)
    assert min(coverage.true, coverage.false, coverage.close) > examples // 20


def test_lowering_keeps_the_meaning_of_every_term() -> None:
    _check(Lowered(), 100)


def test_closure_decides_as_the_definition_and_takes_the_exact_path_only_when_it_must(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    exact_calls = 0

    def counted(term: Any, env: Mapping[str, Any]) -> bool:
        nonlocal exact_calls
        exact_calls += 1
        return is_true(term, env)

    monkeypatch.setattr(compiled, "is_true", counted)
    _check(Closure(), 160)
    assert exact_calls > 10


def test_a_closure_on_local_variables_decides_as_the_definition() -> None:
    _check(Inline(), 80)


def test_a_closure_of_several_conditions_decides_each_as_the_definition() -> None:
    _check(Together(), 80)


def test_the_text_for_the_second_solver_means_what_the_definition_says() -> None:
    _check(TextForCvc5(), 60)


def test_smt_decides_as_the_definition() -> None:
    _check(Smt(), 80)


@pytest.mark.parametrize(
    "twin",
    [
        Floats(),
        Constant(),
        # Found late, after thousands of cases.
        *(pytest.param(twin, marks=pytest.mark.deep) for twin in (StrictOrder(), NarrowBand())),
    ],
    ids=lambda twin: twin.name,
)
def test_the_suite_refuses_a_broken_twin(twin: Backend) -> None:
    # Hypothesis draws other cases when other modules happen to be loaded, seeded or not. The narrow band
    # was found after 780 cases on average, and after 4,600 at the latest of 25 runs.
    with pytest.raises(BackendConformanceError, match=twin.name):
        check_backend(twin, 40_000, shrink=False)


def test_the_suite_refuses_a_run_too_short_to_be_evidence() -> None:
    with pytest.raises(BackendConformanceError, match="too few"):
        check_backend(Lowered(), 1)
