"""Terms, their parts and their free variables."""

from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.expr import terms as t
from aeros.spec.expr.random_conditions import conditions
from aeros.spec.expr.random_terms import JOINT, VARIABLES
from aeros.spec.expr.semantics import Value, is_true
from aeros.spec.expr.types import BOOL, RealType
from aeros.spec.expr.units import LENGTH, NUMBER
from tests.hypothesis_profiles import examples

A, B, X, Y, P = (VARIABLES[name] for name in ("a", "b", "x", "y", "p"))
INDEX = t.BoundVariable("i", JOINT)
READY = t.Select(VARIABLES["ready"], INDEX)
ONE = t.Literal(Fraction(1), RealType(LENGTH))


def test_the_parts_of_a_term_are_its_operands_in_order() -> None:
    assert list(t.children(t.Compare("<", X, Y))) == [X, Y]
    assert list(t.children(t.And((A, B, t.TRUE)))) == [A, B, t.TRUE]
    assert list(t.children(t.Quantified("all", INDEX, READY))) == [INDEX, READY]
    assert list(t.children(t.Component(P, 1))) == [P]
    assert list(t.children(t.Since(A, B, Fraction(2)))) == [A, B]
    assert [*t.children(X), *t.children(t.TRUE), *t.children(t.And(()))] == []


def test_variables_are_found_by_name_in_order_of_first_occurrence() -> None:
    term = t.And(
        (t.Compare("<", Y, X), t.Quantified("any", INDEX, t.And((READY, A))), t.Compare("<", X, ONE))
    )
    assert list(t.variables_of(term).items()) == [
        ("y", Y),
        ("x", X),
        ("ready", VARIABLES["ready"]),
        ("a", A),
    ]
    assert t.variables_of(t.Not(t.Not(term))) == t.variables_of(term)
    assert t.variables_of(t.Not(t.TRUE)) == {}


def test_a_caller_may_change_the_variables_that_it_got() -> None:
    term = t.And((A, B))
    t.variables_of(term).clear()
    assert t.variables_of(term) == {"a": A, "b": B}


def test_variables_of_thousands_of_terms_are_never_mixed_up() -> None:
    for number in range(5000):
        name = f"v{number}"
        assert list(t.variables_of(t.And((t.Variable(name, BOOL, t.VariableRole.STATE),)))) == [name]


def test_a_variable_is_replaced_wherever_it_stands() -> None:
    term = t.And((A, t.Compare("<", X, t.Add(X, Y)), t.Quantified("any", INDEX, t.Or((A, READY)))))
    assert t.substitute(term, {"x": ONE, "a": t.TRUE, "none": B}) == t.And(
        (
            t.TRUE,
            t.Compare("<", ONE, t.Add(ONE, Y)),
            t.Quantified("any", INDEX, t.Or((t.TRUE, READY))),
        )
    )
    assert t.substitute(READY, {"i": t.Literal("j1", JOINT)}) == t.Select(
        VARIABLES["ready"], t.Literal("j1", JOINT)
    )
    assert t.substitute(t.And(()), {"a": B}) == t.And(())
    table = t.ConstantTable("a", VARIABLES["joint"].type, (Fraction(1),) * 3)  # type: ignore[arg-type]
    assert t.substitute(table, {"a": B}) == table


def test_a_conjunction_is_flat_and_without_true() -> None:
    assert t.conjunction(A, t.And((B, t.TRUE)), t.TRUE) == t.And((A, B))
    assert t.conjunction(t.TRUE, A) == A
    assert t.conjunction() == t.conjunction(t.TRUE) == t.And(())
    assert t.conjunction(A, A) == t.And((A, A))


def test_equal_variables_have_equal_hashes_and_others_of_their_name_differ() -> None:
    again = t.Variable("x", RealType(LENGTH), t.VariableRole.STATE)
    other = t.Variable("x", RealType(NUMBER), t.VariableRole.STATE)
    assert {X, again, other} == {X, other}
    assert len({X, again, other}) == 2


_AT: dict[str, Value] = {
    "a": True, "b": False, "mode": "idle", "arm": "j2", "n": Fraction(3), "laps": Fraction(2),
    "x": Fraction(1), "y": Fraction(-2), "p": (Fraction(1),) * 3, "q": (Fraction(0),) * 3,
    "joint": (Fraction(1), Fraction(2), Fraction(3)), "ready": (True, False, True),
    "kettle.hot": True, "kettle.level": Fraction(1, 2), "kettle.spout": (Fraction(1),) * 3,
}  # fmt: skip


@examples(30)
@given(conditions(), st.booleans(), st.integers(-2, 2))
def test_to_replace_a_variable_by_its_value_changes_no_truth_value(term: t.Term, a: bool, x: int) -> None:
    at: dict[str, Value] = {**_AT, "a": a, "x": Fraction(x)}
    replaced = t.substitute(term, {"a": t.Literal(a, BOOL), "x": t.Literal(Fraction(x), RealType(LENGTH))})
    assert t.variables_of(replaced).keys() == t.variables_of(term).keys() - {"a", "x"}
    assert is_true(replaced, at) is is_true(term, at)


def test_a_walk_meets_each_term_and_all_that_is_in_it() -> None:
    term = t.Not(t.Compare("<", X, t.Add(X, Y)))
    found = list(t.walk([term, A]))
    assert len(found) == 7
    assert found.count(X) == 2
    assert {term, A, t.Add(X, Y)} <= set(found)


def test_constants_are_the_numbers_alone() -> None:
    three = t.Literal(Fraction(3), RealType(LENGTH))
    term = t.And((t.Compare("<", X, t.Multiply(three, three)), t.TRUE))
    assert t.constants_in([term]) == {Fraction(3)}


def test_variables_of_different_names_have_different_hashes() -> None:
    assert len({hash(t.Variable(f"v{number}", BOOL, t.VariableRole.STATE)) for number in range(100)}) > 90


def test_the_variables_of_a_term_are_looked_up_once_and_of_at_most_4096_terms(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    walked: list[t.Term] = []
    walk = t._variables_of

    def noted(term: t.Term) -> dict[str, t.Variable]:
        walked.append(term)
        return walk(term)

    monkeypatch.setattr(t, "_FREE_VARIABLES_CACHE", {})
    monkeypatch.setattr(t, "_variables_of", noted)
    terms = [t.Variable(f"v{number}", BOOL, t.VariableRole.STATE) for number in range(4096)]
    for _ in range(2):
        for term in terms:
            assert t.variables_of(t.Not(term)) == {term.name: term}
    assert walked == terms
    t.variables_of(t.And((terms[0], terms[1])))
    assert len(t._FREE_VARIABLES_CACHE) == 1


def test_the_source_of_a_value_is_written_as_one_word() -> None:
    assert [role.value for role in t.VariableRole] == ["state", "parameter", "input"]
