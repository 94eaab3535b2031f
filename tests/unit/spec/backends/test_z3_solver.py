from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import product
from types import SimpleNamespace
from typing import Any

import pytest
import z3

from aeros.spec.backends import z3_solver
from aeros.spec.backends.solver_results import SatResult, SolverAnswer, timeout_answer
from aeros.spec.backends.z3_expressions import Expressions
from aeros.spec.backends.z3_solver import IncrementalSolver, SolverContext, solver_version
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import is_true
from aeros.spec.expr.types import BOOL, EnumType, FamilyType, IntegerType, RealType, VectorType
from aeros.spec.expr.units import LENGTH

_METRES = RealType(LENGTH)
_MODE = EnumType("Mode", ("idle", "move", "stop"))
X = t.Variable("x", _METRES, t.VariableRole.STATE)
Y = t.Variable("y", _METRES, t.VariableRole.STATE)
A = t.Variable("a", BOOL, t.VariableRole.STATE)
M = t.Variable("mode", _MODE, t.VariableRole.STATE)
P = t.Variable("p", VectorType(LENGTH), t.VariableRole.STATE)
R = t.Variable("ready", FamilyType(_MODE, BOOL), t.VariableRole.STATE)
_RANGES = dict.fromkeys(("x", "y", "p.x", "p.y", "p.z"), (Fraction(-10), Fraction(10)))


def _metres(value: Fraction | int) -> t.Literal:
    return t.Literal(Fraction(value), _METRES)


def _session(rlimit: int = 5_000_000) -> IncrementalSolver:
    return IncrementalSolver((X, Y, A, M, P, R), _RANGES, rlimit)


def _less(left: t.Term, right: t.Term) -> t.Term:
    return t.Compare("<", left, right)


def test_a_model_gives_every_declared_scalar_a_value_of_its_type() -> None:
    answer = _session().check_sat(
        t.And((A, t.Compare("==", M, t.Literal("stop", _MODE)), _less(_metres(9), X)))
    )
    assert answer.result is SatResult.SAT
    model = dict(answer.model)
    assert set(model) == {
        "x", "y", "a", "mode", "p.x", "p.y", "p.z", "ready[idle]", "ready[move]", "ready[stop]"
    }  # fmt: skip
    assert model["a"] is True
    assert model["mode"] == "stop"
    assert isinstance(model["x"], Fraction)
    assert 9 < model["x"] <= 10


def test_a_model_is_the_exact_rational() -> None:
    answer = _session().check_sat(t.Compare("==", t.Multiply(_metres(3), X), _metres(1)))
    assert answer.model["x"] == Fraction(1, 3)


def test_an_irrational_model_is_an_approximation_that_replay_notices() -> None:
    term = t.Compare("==", t.Multiply(X, X), _metres(2))
    answer = _session().check_sat(term)
    assert answer.result is SatResult.SAT
    value = answer.model["x"]
    assert isinstance(value, Fraction)
    assert 0 < abs(value * value - 2) < Fraction(1, 10**25)
    assert not is_true(term, {"x": value})


def test_ranges_and_sets_are_assumed() -> None:
    session = _session()
    assert session.check_sat(_less(_metres(10), X)).result is SatResult.UNSAT
    away = [t.Not(t.Compare("==", M, t.Literal(member, _MODE))) for member in _MODE.members]
    assert session.check_sat(*away).result is SatResult.UNSAT


def test_questions_do_not_affect_each_other() -> None:
    session = _session()
    assert session.check_sat(_less(X, Y), _less(Y, X)).result is SatResult.UNSAT
    assert session.check_sat(_less(_metres(9), X)).result is SatResult.SAT
    assert (
        session.check_at_values({"x": Fraction(1)}, t.And((_less(X, Y), _less(Y, _metres(1))))).result
        is SatResult.UNSAT
    )
    assert session.check_sat().result is SatResult.SAT


def test_a_failing_question_leaves_the_session_usable() -> None:
    session = _session()
    with pytest.raises(KeyError):
        session.check_sat(t.Variable("nobody", BOOL, t.VariableRole.STATE))
    assert session.check_sat(A).result is SatResult.SAT


def _hard() -> t.Term:
    def cube(v: t.Term) -> t.Term:
        return t.Multiply(v, t.Multiply(v, v))

    z = t.Variable("p.z", _METRES, t.VariableRole.STATE)
    total = t.Add(cube(X), t.Add(cube(Y), cube(z)))
    product = t.Multiply(_metres(3), t.Multiply(X, t.Multiply(Y, z)))
    positive = [_less(_metres(0), v) for v in (X, Y, z)]
    return t.And((*positive, _less(total, product)))


def test_a_budget_that_runs_out_is_unknown_with_a_reason() -> None:
    answer = _session(rlimit=50).check_sat(_hard())
    assert answer.result is SatResult.UNKNOWN
    assert answer.reason
    assert answer.model == {}


def test_a_solver_error_is_unknown_with_a_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    def check(*_: object) -> None:
        raise z3.Z3Exception("out of memory")

    monkeypatch.setattr(z3.Solver, "check", check)
    assert _session().check_sat(A) == SolverAnswer(SatResult.UNKNOWN, {}, "out of memory")


def test_the_same_question_has_the_same_answer() -> None:
    question = t.And((_less(_metres(0), t.Multiply(X, Y)), t.Compare("==", t.Multiply(X, X), Y)))
    answers = [_session().check_sat(question) for _ in range(3)]
    assert answers[0] == answers[1] == answers[2]


def test_no_other_term_and_no_other_variable_than_those_of_the_scalar_core_is_encoded() -> None:
    for term in (t.Previously(A), t.Implies(A, A), t.Component(P, 0)):
        with pytest.raises(AssertionError, match=r"^not in the scalar core: "):
            _session()._encode(term)
    with pytest.raises(AssertionError, match=r"^not a scalar: "):
        SolverContext().constant(P)


def test_the_solver_has_a_name_and_a_version() -> None:
    assert solver_version().startswith("z3 5.")


def test_each_solver_has_the_seed_the_budget_and_the_time_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    given: dict[str, object] = {}
    set_option = z3.Solver.set

    def noted(solver: z3.Solver, name: str, value: object) -> None:
        given[name] = value
        set_option(solver, name, value)

    monkeypatch.setattr(z3.Solver, "set", noted)
    for seconds, milliseconds in ((2.5, 2500), (0.0001, 1)):
        session = IncrementalSolver([X], {}, 1_000_000, seconds=seconds)
        options = {"rlimit": 1_000_000, "timeout": milliseconds}
        for with_assumptions in (True, False):
            session.new_solver(with_assumptions=with_assumptions)
            assert given == {"random_seed": 0, **options}
            given.clear()
        session.check_simplified([t.TRUE])
        assert given == options
        given.clear()


def test_a_shared_term_is_encoded_once() -> None:
    shared, encoded = SolverContext(), []

    def encode(term: t.Term) -> Any:
        encoded.append(term)
        return shared.expressions.truth(term == t.TRUE)

    parts: tuple[t.Term, ...] = (t.TRUE, t.FALSE, t.And((t.TRUE, t.FALSE)))
    for _ in range(2):
        for term, truth in zip(parts, (True, False, False), strict=True):
            assert z3.is_true(z3.simplify(shared.encode_once(term, encode))) is truth
    assert encoded == [t.TRUE, t.FALSE]


def test_each_kind_of_term_has_the_value_of_the_definition() -> None:
    """One session answers all, so an answer is not that to an earlier question."""
    mode, three = t.Literal("move", _MODE), _metres(3)
    terms = (
        A,
        t.Not(A),
        t.And((A, _less(X, Y))),
        t.Or((A, _less(X, Y))),
        t.Compare("==", M, mode),
        t.Compare("==", A, _less(X, Y)),
        t.Compare("<=", X, Y),
        t.Compare("==", X, Y),
        _less(t.Add(X, Y), t.Multiply(X, Y)),
        t.Compare("==", t.Extremum("min", X, Y), X),
        t.Compare("==", t.Extremum("max", X, Y), X),
        t.Compare("<=", t.Extremum("min", X, three), t.Extremum("max", three, Y)),
        t.Compare("==", t.Absolute(X), Y),
        _less(t.Conditional(A, X, Y), t.Conditional(t.Compare("==", M, mode), Y, X)),
    )
    session = _session()
    for x, y, a, m in product((-2, 0.5, 3), (-2, 0.5), (False, True), ("move", "stop")):
        point: dict[str, bool | Fraction | str] = {"x": Fraction(x), "y": Fraction(y), "a": a, "mode": m}
        for term in terms:
            found = session.check_at_values(point, term).result
            assert (found is SatResult.SAT) is is_true(term, point), (term, point)


def test_products_of_a_simplified_question_are_multiplied_out(monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[dict[str, bool]] = []
    use = z3.With

    def noted(tactic: z3.Tactic, **options: bool) -> object:
        given.append(options)
        return use(tactic, **options)

    monkeypatch.setattr(z3, "With", noted)
    assert _session().check_simplified([_less(X, Y)]).result is SatResult.SAT
    assert given == [{"som": True}]


@pytest.mark.parametrize("tactic", ["smt", "qfnra-nlsat"])
def test_a_simplified_question_has_the_assumptions_and_a_model_of_all_variables(tactic: str) -> None:
    session = IncrementalSolver((X, Y), _RANGES)
    for least, result in ((99, SatResult.SAT), (100, SatResult.UNSAT)):
        answer = session.check_simplified([_less(_metres(least), t.Multiply(X, Y))], tactic)
        assert answer.result is result
        assert answer.model.keys() == ({"x", "y"} if result is SatResult.SAT else set())
    session.assume(_less(X, _metres(0)))
    answer = session.check_simplified([_less(_metres(99), t.Multiply(X, Y))], tactic)
    assert answer.result is SatResult.SAT
    x, y = answer.model["x"], answer.model["y"]
    assert isinstance(x, Fraction)
    assert isinstance(y, Fraction)
    assert max(x, y) < 0
    assert 99 < x * y <= 100


def test_a_value_outside_of_the_assumptions_is_impossible_also_where_it_is_given() -> None:
    session = _session()
    assert session.check_at_values({"x": Fraction(11)}, t.TRUE).result is SatResult.UNSAT
    assert session.check_at_values({"x": Fraction(9)}, t.TRUE).result is SatResult.SAT
    session.assume(_less(X, _metres(9)))
    assert session.check_at_values({"x": Fraction(9)}, t.TRUE).result is SatResult.UNSAT


def test_values_that_are_left_out_are_found_or_shown_impossible() -> None:
    session = _session()
    above = _less(X, Y)
    assert session.check_at_values({"x": Fraction(9)}, above).result is SatResult.SAT
    assert session.check_at_values({"x": Fraction(10)}, above).result is SatResult.UNSAT
    assert session.check_at_values({}, above).result is SatResult.SAT


def test_a_question_is_late_after_its_time_limit_and_otherwise_has_the_solvers_reason(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    clock = [100.0]

    def check(took: float, outcome: object) -> SolverAnswer:
        def answer(*_: object) -> object:
            clock[0] += took
            return outcome

        monkeypatch.setattr(z3.Solver, "check", answer)
        return IncrementalSolver([A], {}, seconds=2.5).check_at_values({"a": True}, A)

    monkeypatch.setattr(z3_solver, "time", SimpleNamespace(monotonic=lambda: clock[0]))
    monkeypatch.setattr(z3.Solver, "reason_unknown", lambda _: "canceled")
    assert check(2.25, z3.unknown) == SolverAnswer(SatResult.UNKNOWN, {}, "canceled")
    assert check(2.5, z3.unknown) == check(9.0, z3.unknown) == timeout_answer(2.5)
    assert check(9.0, z3.sat) == SolverAnswer(SatResult.SAT, {})
    assert check(9.0, z3.unsat) == SolverAnswer(SatResult.UNSAT, {})


def test_solvers_that_share_a_context_have_their_own_ranges_and_members() -> None:
    shared = SolverContext()
    other = t.Variable("mode", EnumType("Mode", ("idle", "move")), t.VariableRole.STATE)
    ranges: list[dict[str, tuple[Fraction, Fraction]]] = [
        {"x": (Fraction(low), Fraction(low + 1))} for low in (0, 5, 0)
    ]
    wide, high, *_ = (IncrementalSolver([X, M], one, 1_000_000, shared) for one in ranges)
    free = IncrementalSolver([X, other], {}, 1_000_000, shared)
    above = _less(_metres(2), X)
    assert [one.check_sat(above).result for one in (wide, high, free)] == [
        SatResult.UNSAT, SatResult.SAT, SatResult.SAT
    ]  # fmt: skip
    stop = t.Compare("==", M, t.Literal("stop", _MODE))
    assert [one.check_sat(stop).result for one in (wide, free)] == [SatResult.SAT, SatResult.UNSAT]


def test_a_whole_number_and_a_real_of_one_name_have_their_own_conditions() -> None:
    shared = SolverContext()
    ranges = {"x": (Fraction(0), Fraction(1))}
    whole = t.Variable("x", IntegerType(), t.VariableRole.STATE)
    half = t.Compare("==", X, _metres(Fraction(1, 2)))
    for variable, result in ((whole, SatResult.UNSAT), (X, SatResult.SAT), (whole, SatResult.UNSAT)):
        assert IncrementalSolver([variable], ranges, context=shared).check_sat(half).result is result


def test_a_whole_number_is_whole_and_in_its_range() -> None:
    laps = t.Variable("laps", IntegerType(), t.VariableRole.STATE)
    half = t.Compare("==", t.Add(laps, laps), t.Literal(Fraction(3), RealType(IntegerType().dimension)))
    two = t.Compare("==", t.Add(laps, laps), t.Literal(Fraction(4), RealType(IntegerType().dimension)))
    session = IncrementalSolver([laps], {"laps": (Fraction(1), Fraction(9))})
    assert session.check_sat(half).result is SatResult.UNSAT
    assert session.check_sat(two).model == {"laps": Fraction(2)}
    low = IncrementalSolver([laps], {"laps": (Fraction(3), Fraction(9))})
    assert low.check_sat(two).result is SatResult.UNSAT


def test_a_term_that_is_asked_about_at_many_values_is_encoded_once(monkeypatch: pytest.MonkeyPatch) -> None:
    made = []
    make = Expressions.conjunction

    def noted(expressions: Expressions, parts: Sequence[Any]) -> Any:
        made.append(len(parts))
        return make(expressions, parts)

    monkeypatch.setattr(Expressions, "conjunction", noted)
    session, term = _session(), t.And((A, _less(X, Y)))
    for value in range(3):
        session.check_at_values({"x": Fraction(value)}, term)
    assert len(made) == 2  # of its parts, and with the assumptions
    session.assume(_less(Y, _metres(1)))
    assert session.check_at_values({"x": Fraction(1)}, term).result is SatResult.UNSAT
