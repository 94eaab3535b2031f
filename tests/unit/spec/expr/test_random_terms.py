"""Random terms are well-typed: each can be evaluated and lowered."""

from __future__ import annotations

from fractions import Fraction
from typing import cast

from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.expr.lower import lower, values_by_scalar
from aeros.spec.expr.random_conditions import environments, exact_environment, vocabulary_ranges
from aeros.spec.expr.random_terms import JOINT, VARIABLES, TermGenerator
from aeros.spec.expr.semantics import evaluate
from aeros.spec.expr.units import LENGTH


@given(st.data())
def test_a_random_term_has_a_value_of_its_type(data: st.DataObject) -> None:
    generator = TermGenerator(cast("st.DrawFn", data.draw))
    depth = data.draw(st.integers(0, 3))
    condition, real = generator.boolean(depth), generator.real(depth, LENGTH)
    values = exact_environment(data.draw(environments(condition, data.draw(vocabulary_ranges()))))
    assert evaluate(condition, values) in (True, False)
    assert isinstance(evaluate(real, values), Fraction)
    assert evaluate(generator.enum(depth, JOINT), values) in JOINT.members
    near = generator.near_tie(values)
    assert evaluate(lower(near), values_by_scalar(VARIABLES, values)) is evaluate(near, values)
