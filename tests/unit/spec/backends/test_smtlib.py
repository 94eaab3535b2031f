from __future__ import annotations

from fractions import Fraction

import pytest

from aeros.spec.backends import smtlib
from aeros.spec.backends.smtlib import add_points, literal, question_script, split_points
from aeros.spec.backends.solver_results import Question, ScalarValue
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL, EnumType, FamilyType, IntegerType, RealType, Type, VectorType
from aeros.spec.expr.units import LENGTH

_METRES = RealType(LENGTH)
_MODE = EnumType("Mode", ("idle", "stop"))
_STATE = t.VariableRole.STATE
X, Y = (t.Variable(name, _METRES, _STATE) for name in "xy")
P, Q = (t.Variable(name, VectorType(LENGTH), _STATE) for name in "pq")
LAPS = t.Variable("laps", IntegerType(), _STATE)
MODE = t.Variable("mode", _MODE, _STATE)
READY = t.Variable("ready", FamilyType(_MODE, BOOL), _STATE)
A = t.Variable("a", BOOL, _STATE)
COUNTS = t.Variable("counts", FamilyType(_MODE, IntegerType()), _STATE)
INDEX = t.BoundVariable("m", _MODE)
NOBODY, ALONE = (t.BoundVariable("i", EnumType(*of)) for of in (("None", ()), ("One", ("only",))))
TABLE = t.ConstantTable("limit", FamilyType(_MODE, _METRES), (Fraction(1, 2), Fraction(2)))


def lines_of(term: t.Term) -> list[str]:
    variables = list(t.variables_of(term).values())
    ranges = {"x": (Fraction(-1), Fraction(1, 3)), "laps": (Fraction(0), Fraction(9))}
    return question_script(Question(variables, ranges, [term])).splitlines()


def assertion_of(term: t.Term) -> str:
    last = lines_of(term)[-2]
    return last.removeprefix("(assert ").removesuffix(")")


def test_a_script_declares_asserts_ranges_and_then_the_conditions() -> None:
    assert lines_of(t.Compare("<", X, Y)) == [
        "(set-logic ALL)",
        "(declare-const |x| Real)",
        "(declare-const |y| Real)",
        "(assert (<= (- 1.0) |x| (/ 1.0 3.0)))",
        "(assert (< |x| |y|))",
        "(check-sat)",
    ]


def test_a_whole_number_is_of_sort_int_and_read_as_a_real() -> None:
    lines = lines_of(t.Compare("<=", LAPS, t.Literal(Fraction(3), RealType(IntegerType().dimension))))
    assert lines[1:4] == [
        "(declare-const |laps| Int)",
        "(assert (<= 0.0 (to_real |laps|) 9.0))",
        "(assert (<= (to_real |laps|) 3.0))",
    ]


def test_an_enumeration_is_a_data_type_and_a_family_a_function_of_it() -> None:
    lines = lines_of(t.Not(t.Select(READY, MODE)))
    assert lines[1:] == [
        "(declare-datatype |Mode| ((|Mode/idle|) (|Mode/stop|)))",
        "(declare-const |ready[idle]| Bool)",
        "(declare-const |ready[stop]| Bool)",
        "(define-fun |ready| ((index |Mode|)) Bool (ite (= index |Mode/idle|) |ready[idle]| |ready[stop]|))",
        "(declare-const |mode| |Mode|)",
        "(assert (not (|ready| |mode|)))",
        "(check-sat)",
    ]


def test_a_constant_family_is_defined_though_no_variable_has_it() -> None:
    lines = lines_of(t.Compare("<", X, t.Select(TABLE, t.Literal("stop", _MODE))))
    assert "(define-fun |limit| ((index |Mode|)) Real (ite (= index |Mode/idle|) (/ 1.0 2.0) 2.0))" in lines
    assert lines[-2] == "(assert (< |x| (|limit| |Mode/stop|)))"


def test_a_family_of_whole_numbers_is_a_function_to_the_reals() -> None:
    lines = lines_of(t.Compare("<", X, t.Select(COUNTS, MODE)))
    assert "(declare-const |counts[stop]| Int)" in lines
    values = "(to_real |counts[idle]|) (to_real |counts[stop]|)"
    assert f"(define-fun |counts| ((index |Mode|)) Real (ite (= index |Mode/idle|) {values}))" in lines


@pytest.mark.parametrize(
    "term",
    [
        t.Compare("==", MODE, MODE),
        t.Compare("==", t.Literal("idle", _MODE), t.Literal("stop", _MODE)),
        t.Quantified("all", INDEX, A),
        t.Select(READY, t.Literal("idle", _MODE)),
        t.Compare("<", X, t.Select(TABLE, INDEX)),
    ],
)
def test_each_enumeration_is_declared_once_wherever_it_is_used(term: t.Term) -> None:
    declared = [line for line in lines_of(term) if line.startswith("(declare-datatype")]
    assert declared == ["(declare-datatype |Mode| ((|Mode/idle|) (|Mode/stop|)))"]


_READY_M = t.Select(READY, INDEX)


@pytest.mark.parametrize(
    ("term", "text"),
    [
        (t.And(()), "true"),
        (t.Or(()), "false"),
        (t.And((t.Compare("==", X, Y),)), "(= |x| |y|)"),
        (t.Or((t.Compare("<", X, Y), t.Compare("==", X, Y))), "(or (< |x| |y|) (= |x| |y|))"),
        (t.Implies(t.TRUE, t.FALSE), "(=> true false)"),
        (t.Compare("==", MODE, t.Literal("stop", _MODE)), "(= |mode| |Mode/stop|)"),
        (t.Compare("<", t.Add(X, t.Multiply(X, Y)), Y), "(< (+ |x| (* |x| |y|)) |y|)"),
        (t.Compare("<", t.Absolute(X), Y), "(< (let ((a |x|)) (ite (< a 0.0) (- a) a)) |y|)"),
        (t.Compare("<", t.Extremum("min", X, Y), Y), "(< (let ((a |x|) (b |y|)) (ite (< a b) a b)) |y|)"),
        (t.Compare("<", t.Extremum("max", X, Y), Y), "(< (let ((a |x|) (b |y|)) (ite (> a b) a b)) |y|)"),
        (t.Compare("==", P, Q), "(and (= |p.x| |q.x|) (= |p.y| |q.y|) (= |p.z| |q.z|))"),
        (
            t.Compare("==", t.Add(P, Q), P),
            "(and (= (+ |p.x| |q.x|) |p.x|) (= (+ |p.y| |q.y|) |p.y|) (= (+ |p.z| |q.z|) |p.z|))",
        ),
        (
            t.Compare("==", t.Multiply(X, P), P),
            "(and (= (* |x| |p.x|) |p.x|) (= (* |x| |p.y|) |p.y|) (= (* |x| |p.z|) |p.z|))",
        ),
        (
            t.Compare("==", t.Conditional(A, P, Q), t.Vector(X, Y, X)),
            "(and (= (ite |a| |p.x| |q.x|) |x|) (= (ite |a| |p.y| |q.y|) |y|) (= (ite |a| |p.z| |q.z|) |x|))",
        ),
        (
            t.Compare("==", t.Vector(X, Y, X), P),
            "(and (= |x| |p.x|) (= |y| |p.y|) (= |x| |p.z|))",
        ),
        (t.Compare("==", t.Add(X, Y), t.Multiply(X, Y)), "(= (+ |x| |y|) (* |x| |y|))"),
        (t.Compare("==", t.Conditional(A, X, Y), Y), "(= (ite |a| |x| |y|) |y|)"),
        (
            t.Compare("<", t.Component(t.Conditional(t.TRUE, t.Add(P, Q), t.Multiply(X, P)), 2), Y),
            "(< (ite true (+ |p.z| |q.z|) (* |x| |p.z|)) |y|)",
        ),
        (t.Compare("<", t.Component(t.Vector(X, Y, X), 1), X), "(< |y| |x|)"),
        (
            t.Quantified("all", INDEX, _READY_M),
            "(and (let ((|m| |Mode/idle|)) (|ready| |m|)) (let ((|m| |Mode/stop|)) (|ready| |m|)))",
        ),
        (
            t.Quantified("any", INDEX, _READY_M),
            "(or (let ((|m| |Mode/idle|)) (|ready| |m|)) (let ((|m| |Mode/stop|)) (|ready| |m|)))",
        ),
        (t.Quantified("all", NOBODY, A), "true"),
        (t.Quantified("any", NOBODY, A), "false"),
        (t.Quantified("any", ALONE, A), "(let ((|i| |One/only|)) |a|)"),
        (t.Compare("<", X, t.Aggregate("sum", NOBODY, Y)), "(< |x| 0.0)"),
        (t.Compare("<", X, t.Aggregate("count", NOBODY, A)), "(< |x| 0.0)"),
        (t.Compare("<", X, t.Aggregate("sum", ALONE, Y)), "(< |x| (let ((|i| |One/only|)) |y|))"),
        (
            t.Compare("<", X, t.Aggregate("sum", INDEX, Y)),
            "(< |x| (+ (let ((|m| |Mode/idle|)) |y|) (let ((|m| |Mode/stop|)) |y|)))",
        ),
        (
            t.Compare("<", X, t.Aggregate("count", INDEX, _READY_M)),
            "(< |x| (+ (let ((|m| |Mode/idle|)) (ite (|ready| |m|) 1.0 0.0))"
            " (let ((|m| |Mode/stop|)) (ite (|ready| |m|) 1.0 0.0))))",
        ),
    ],
)  # fmt: skip
def test_each_kind_of_term_is_written_as_it_is_defined(term: t.Term, text: str) -> None:
    assert assertion_of(term) == text


def test_a_condition_on_the_past_is_refused() -> None:
    with pytest.raises(AssertionError, match="one state"):
        question_script(Question([], {}, [t.Previously(t.TRUE)]))


def test_a_component_of_something_else_than_a_vector_is_refused() -> None:
    with pytest.raises(AssertionError, match=r"^not a vector: "):
        question_script(Question([], {}, [t.Compare("<", X, t.Component(t.TRUE, 0))]))


@pytest.mark.parametrize(
    ("type_", "value", "text"),
    [
        (BOOL, True, "true"),
        (BOOL, False, "false"),
        (_MODE, "stop", "|Mode/stop|"),
        (IntegerType(), Fraction(-3), "(- 3)"),
        (_METRES, Fraction(-2), "(- 2.0)"),
        (_METRES, Fraction(-1, 3), "(- (/ 1.0 3.0))"),
        (_METRES, Fraction(10**30), "1" + "0" * 30 + ".0"),
    ],
)
def test_a_value_is_written_by_its_type(type_: Type, value: ScalarValue, text: str) -> None:
    assert literal(type_, value) == text


def test_values_of_points_are_equations_after_the_script() -> None:
    points = [{"x": "1.0", "y": "2.0"}, {"x": "3.0", "y": "4.0"}]
    text = add_points("(assert (< x y))\n(check-sat)", points)
    assert "check-sat" not in text
    assertions = [line for line in text.splitlines() if line]
    script, equations = split_points(assertions, points)
    assert script == ["(assert (< x y))"]
    assert equations == [
        ["(assert (= |x| 1.0))", "(assert (= |y| 2.0))"],
        ["(assert (= |x| 3.0))", "(assert (= |y| 4.0))"],
    ]


def test_a_table_needs_a_value_for_each_member() -> None:
    index = EnumType("Set", ("i", "j"))
    for count in (1, 3):
        table = t.ConstantTable("limit", FamilyType(index, RealType(LENGTH)), (Fraction(1),) * count)
        with pytest.raises(ValueError, match="argument 2 is"):
            lines_of(
                t.Compare(
                    "<=", t.Select(table, t.Literal("i", index)), t.Select(table, t.Literal("j", index))
                )
            )


def test_a_vector_that_many_conditions_read_is_written_once(monkeypatch: pytest.MonkeyPatch) -> None:
    written: list[t.Term] = []
    write = smtlib._Script._components

    def noted(script: smtlib._Script, term: t.Term) -> tuple[str, str, str]:
        written.append(term)
        return write(script, term)

    monkeypatch.setattr(smtlib._Script, "_components", noted)
    total, double = t.Add(P, Q), t.Multiply(t.Literal(Fraction(2), _METRES), P)
    terms = [t.Compare("<", t.Component(one, axis), X) for one in (total, double, total) for axis in (0, 2)]
    text = question_script(Question([P, Q, X], {}, terms))
    assert [id(one) for one in written] == [id(one) for one in (total, P, Q, double)]
    assert text.count("(assert (< (+ |p.x| |q.x|) |x|))") == 2
    assert text.count("(assert (< (* 2.0 |p.z|) |x|))") == 1
