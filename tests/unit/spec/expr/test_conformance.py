"""The suite finds a back end that decides anything otherwise than the definition does."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import pytest

from aeros.spec.expr import terms as t
from aeros.spec.expr.conformance import BackendConformanceError, check_backend, is_near_tie
from aeros.spec.expr.random_conditions import ConditionCase, Ranges, Raw, exact_environment
from aeros.spec.expr.random_terms import VARIABLES
from aeros.spec.expr.semantics import is_true
from aeros.spec.expr.types import BOOL

VALUES: Mapping[str, Raw] = {
    "a": True,
    "b": False,
    "mode": "idle",
    "arm": "j1",
    "n": 1.0,
    "laps": 3.0,
    "x": 1.0,
    "y": 2.0,
    "p": (1.0, 2.0, 3.0),
    "q": (0.0, 0.0, 0.0),
    "joint": (1.0, 5.0, 9.0),
    "ready": (True, False, True),
    "kettle.hot": True,
    "kettle.level": 0.5,
    "kettle.spout": (1.0, 2.0, 3.0),
}
N, X, Y = VARIABLES["n"], VARIABLES["x"], VARIABLES["y"]


@dataclass
class Decider:
    """A back end that decides by the definition, and turns what `is_wrong` picks."""

    name: str = "tested"
    turned: type[t.Term] | None = None
    met: list[t.Term] = field(default_factory=list)

    def decide(
        self,
        term: t.Term,
        variables: Mapping[str, t.Variable],
        ranges: Ranges,
        values: Mapping[str, Raw],
    ) -> bool:
        assert variables == VARIABLES
        assert values.keys() == variables.keys()
        assert ranges
        self.met.append(term)
        decided = is_true(term, exact_environment(values))
        return decided is not (self.turned is not None and isinstance(term, self.turned))


def test_a_back_end_that_decides_by_the_definition_conforms_and_met_hard_cases() -> None:
    one, other = Decider(), Decider()
    coverage = check_backend(one, 20)
    assert coverage.true + coverage.false == len(one.met) == 20
    assert min(coverage.true, coverage.false, coverage.close) > 0
    check_backend(other, 20)
    assert one.met[:5] == other.met[:5]  # a run with a seed begins with the same cases


def test_a_back_end_that_errs_about_one_kind_of_term_is_named_with_the_case() -> None:
    with pytest.raises(
        BackendConformanceError, match=r"^liar: (True|False), by definition (True|False): Cond"
    ):
        check_backend(Decider("liar", t.Compare), 100, shrink=False)


def test_a_run_without_every_kind_of_case_is_no_evidence() -> None:
    with pytest.raises(BackendConformanceError, match=r"^tested: 1 examples are too few: CaseCoverage"):
        check_backend(Decider(), 1)


def compare(left: t.Term, right: t.Term) -> ConditionCase:
    return ConditionCase(t.Compare("<", left, right), {}, VALUES)


def at(x: float, y: float, term: t.Term | None = None) -> ConditionCase:
    return ConditionCase(term or t.Compare("<=", X, Y), {}, {**VALUES, "x": x, "y": y})


def test_sides_that_are_equal_or_nearly_so_are_a_near_tie() -> None:
    assert is_near_tie(compare(X, X))
    assert is_near_tie(at(1.0, math.nextafter(1.0, 2.0)))
    assert is_near_tie(at(0.0, 0.0))
    assert is_near_tie(at(2.0**60, 2.0**60 + 256))
    # Equal to the tolerance: 2**-48 of the sum of the sides.
    assert is_near_tie(at(2.0**48 + 1, 2.0**48 - 1))


def test_sides_that_differ_by_more_are_none() -> None:
    assert not is_near_tie(compare(X, Y))
    assert not is_near_tie(at(1.0, -1.0))
    assert not is_near_tie(at(0.0, 2.0**-1074))
    assert not is_near_tie(at(2.0**48 + 1, 2.0**48 - 2))


def test_a_near_tie_is_found_inside_a_term_and_in_a_quantifier() -> None:
    index = t.BoundVariable("i", VARIABLES["arm"].type)  # type: ignore[arg-type]
    far = t.Compare("<", X, Y)
    inside = t.Compare("<", t.Select(VARIABLES["joint"], index), t.Add(X, t.Add(Y, Y)))
    case = at(1.0, 2.0, t.Or((far, t.Quantified("any", index, t.Not(inside)))))
    assert is_near_tie(case)  # the second joint is at 5
    assert not is_near_tie(at(1.0, 3.0, t.Or((far, t.Quantified("any", index, inside)))))


def test_equal_truth_values_and_words_are_no_near_tie() -> None:
    assert not is_near_tie(at(1.0, 2.0, t.Compare("==", VARIABLES["a"], t.Literal(True, BOOL))))
    assert not is_near_tie(at(1.0, 2.0, t.Compare("==", VARIABLES["mode"], VARIABLES["mode"])))
