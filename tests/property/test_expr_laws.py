"""Laws that hold for every term and every text."""

from __future__ import annotations

from fractions import Fraction

from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower, size_bounds, values_by_scalar
from aeros.spec.expr.parser import KEYWORDS, ExpressionSyntaxError, parse
from aeros.spec.expr.random_conditions import ConditionCase, cases, conditions, exact_environment
from aeros.spec.expr.random_terms import VARIABLES
from aeros.spec.expr.semantics import TimedState, evaluate, is_true
from aeros.spec.expr.types import BOOL
from aeros.spec.expr.units import format_quantity, parse_quantity, unit_names
from tests.hypothesis_profiles import examples
from tests.unit.spec.expr.typecheck.type_rules import type_of

_SETTINGS = examples(60)
_WORDS = [
    *sorted(KEYWORDS),
    "x",
    "p",
    "(",
    ")",
    "[",
    "]",
    "{",
    "}",
    ",",
    ".",
    "<=",
    "<",
    "==",
    "+",
    "-",
    "*",
    "/",
]
_SCALAR_CORE = (
    t.Literal,
    t.Variable,
    t.Not,
    t.And,
    t.Or,
    t.Compare,
    t.Add,
    t.Multiply,
    t.Extremum,
    t.Absolute,
    t.Conditional,
)


def _size(term: t.Term) -> int:
    return 1 + sum(map(_size, t.children(term)))


@_SETTINGS
@given(cases())
def test_de_morgan_and_double_negation(case: ConditionCase) -> None:
    env = exact_environment(case.values)
    other = VARIABLES["a"]
    both = t.And((case.term, other))
    assert is_true(t.Not(both), env) is is_true(t.Or((t.Not(case.term), t.Not(other))), env)
    assert is_true(t.Not(t.Not(case.term)), env) is is_true(case.term, env)
    assert is_true(t.Implies(other, case.term), env) is is_true(t.Or((t.Not(other), case.term)), env)


@_SETTINGS
@given(cases())
def test_evaluation_is_total_and_lowering_twice_is_lowering_once_in_meaning(case: ConditionCase) -> None:
    env = exact_environment(case.values)
    scalars = values_by_scalar(VARIABLES, env)
    core = lower(case.term)
    assert type(is_true(case.term, env)) is bool
    assert is_true(core, scalars) is is_true(lower(core), scalars) is is_true(case.term, env)


@_SETTINGS
@given(conditions())
def test_the_core_is_scalar_and_no_larger_than_foretold(term: t.Term) -> None:
    core = lower(term)
    assert type_of(term) == type_of(core) == BOOL
    assert _size(core) <= size_bounds(term)[0]
    pending = [core]
    while pending:
        node = pending.pop()
        assert isinstance(node, _SCALAR_CORE)
        pending.extend(t.children(node))


@examples(40)
@given(cases(), st.lists(st.booleans(), max_size=3))
def test_a_past_condition_anywhere_in_a_term_counts_as_its_value(
    case: ConditionCase, held: list[bool]
) -> None:
    env = exact_environment(case.values)
    trace = [TimedState(Fraction(at), {**env, "b": one}) for at, one in enumerate([*held, env["b"]])]
    past: dict[str, t.Term] = {
        "n": t.Occurrences(VARIABLES["b"], Fraction(2)),
        "laps": t.Occurrences(t.Previously(VARIABLES["b"]), Fraction(9)),
        "a": t.Since(t.TRUE, VARIABLES["b"], Fraction(1)),
        "kettle.hot": t.Previously(VARIABLES["b"]),
    }
    values = {name: evaluate(term, env, trace) for name, term in past.items()}
    assert is_true(t.substitute(case.term, past), env, trace) is is_true(case.term, {**env, **values})


@_SETTINGS
@given(st.one_of(st.text(max_size=80), st.lists(st.sampled_from(_WORDS), max_size=40).map(" ".join)))
def test_any_text_is_an_expression_or_a_syntax_error_inside_it(text: str) -> None:
    try:
        extent = parse(text).extent
    except ExpressionSyntaxError as fault:
        extent = fault.extent
    assert 0 <= extent.start <= extent.end <= len(text)


@_SETTINGS
@given(st.integers(-(10**6), 10**6), st.integers(0, 3), st.sampled_from(unit_names()))
def test_a_shown_quantity_reads_back(digits: int, places: int, unit: str) -> None:
    parsed = parse_quantity(f"{digits / 10**places:.{places}f} {unit}")
    assert parsed is not None
    value, read = parsed
    assert parse_quantity(format_quantity(read.to_si(value), read)) == (value, read)
