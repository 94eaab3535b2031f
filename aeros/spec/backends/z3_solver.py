"""Translation of terms to Z3, over the reals. Sole importer of z3.

Doubles are the rationals they denote, so real arithmetic is exact here and agrees with `semantics.py`.
Budgets are `rlimit` with a fixed seed: the same query gives the same answer on every machine. Enum members
are integers by their order, constrained to the set.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction
from functools import cached_property
from typing import Any

import z3

from aeros.spec.backends.resource_limit import DEFAULT_RLIMIT, QUESTION_SECONDS
from aeros.spec.backends.solver_results import (
    SatResult,
    ScalarValue,
    SolverAnswer,
    timeout_answer,
)
from aeros.spec.backends.z3_expressions import Expressions
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower, scalar_variables
from aeros.spec.expr.types import BoolType, EnumType, IntegerType, RealType

_DIGITS = 30  # an irrational model value is shown to this many decimals


def solver_version() -> str:
    """Return the solver's name and version, as certificates record it.

    Returns:
        `z3` and the version of the library that is loaded.
    """
    return f"z3 {z3.get_version_string()}"


class SolverContext:
    """Z3 context, of some megabytes, with the encodings that solvers sharing it have in common.

    Not thread-safe. A variable of one name and type is the same constant for all of them. Their models
    depend on all earlier questions, so solvers that look for models do not share a context.

    Attributes:
        z3: the context.
        expressions: maker of expressions in it.
    """

    def __init__(self) -> None:
        self.z3: Any = z3.Context()
        self.expressions = Expressions(self.z3)
        self._encoded: dict[int, tuple[t.Term, Any]] = {}
        self._ranges: dict[tuple[str, str, object], tuple[Any, ...]] = {}

    def constant(self, scalar: t.Variable) -> Any:
        """Return the constant of a scalar variable.

        Args:
            scalar: a variable of a scalar type.

        Returns:
            The constant; the same for all variables of this name and type.

        Raises:
            AssertionError: the variable is no scalar.
        """
        match scalar.type:
            case BoolType():
                return z3.Bool(scalar.name, self.z3)
            case RealType():
                return z3.Real(scalar.name, self.z3)
            case EnumType():
                return z3.Int(scalar.name, self.z3)
            case _:
                raise AssertionError(f"not a scalar: {scalar}")

    def range_conditions(
        self, scalar: t.Variable, constant: Any, bounds: tuple[Fraction, Fraction] | None
    ) -> tuple[Any, ...]:
        """Encode the conditions that every value of a scalar variable fulfils.

        Args:
            scalar: the variable.
            constant: its constant.
            bounds: least and largest value (SI); None if it has no range.

        Returns:
            Boolean expressions; none for a Boolean or an unbounded real.
        """
        size = len(scalar.type.members) if isinstance(scalar.type, EnumType) else None
        key = (scalar.name, type(scalar.type).__name__, bounds if size is None else size)
        if key not in self._ranges:
            conditions: list[Any] = []
            if size is not None:
                conditions += [constant >= 0, constant < size]
            if isinstance(scalar.type, IntegerType):
                conditions.append(z3.IsInt(constant))
            if isinstance(scalar.type, RealType) and bounds is not None:
                low, high = map(self.expressions.number, bounds)
                compare = self.expressions.comparison
                conditions += [compare("<=", low, constant), compare("<=", constant, high)]
            self._ranges[key] = tuple(conditions)
        return self._ranges[key]

    def encode_once(self, term: t.Term, encode: Callable[[t.Term], Any]) -> Any:
        """Encode a term, cached by identity: comparing terms costs as much as encoding them.

        Args:
            term: the term; a conjunction is encoded operand by operand, as conditions share operands.
            encode: the encoder of other terms.

        Returns:
            The Boolean expression.
        """
        if id(term) not in self._encoded:
            if isinstance(term, t.And):
                encoded = self.expressions.conjunction(
                    [self.encode_once(operand, encode) for operand in term.operands]
                )
            else:
                encoded = encode(lower(term))
            self._encoded[id(term)] = (term, encoded)
        return self._encoded[id(term)][1]


class IncrementalSolver:
    """Solver over declared variables. Assumptions stay; the terms of each question do not.

    Args:
        variables: every free variable of later terms.
        ranges: closed range (SI) of each real scalar variable; one without a range is unbounded.
        rlimit: budget of one question, in Z3's resource units.
        seconds: time limit of one question, s. Z3 looks at it now and then; `solver_process` enforces it.
        context: context to share with other solvers; None for a new one. With a shared context, models depend
            on all earlier questions in it, so the oracle does not share.
    """

    def __init__(
        self,
        variables: Iterable[t.Variable],
        ranges: Mapping[str, tuple[Fraction, Fraction]],
        rlimit: int = DEFAULT_RLIMIT,
        context: SolverContext | None = None,
        *,
        seconds: float = QUESTION_SECONDS,
    ) -> None:
        self._shared = SolverContext() if context is None else context
        self._context: Any = self._shared.z3
        self._rlimit = rlimit
        self._seconds = seconds
        self._constants: dict[str, tuple[t.Variable, Any]] = {}
        self._assumptions: list[Any] = []
        self._questions: dict[int, tuple[t.Term, Any]] = {}
        for variable in variables:
            for scalar in scalar_variables(variable):
                constant = self._shared.constant(scalar)
                self._constants[scalar.name] = (scalar, constant)
                self._assumptions += self._shared.range_conditions(scalar, constant, ranges.get(scalar.name))

    @cached_property
    def _solver(self) -> Any:
        """Solver of the questions with free variables; it holds the assumptions."""
        return self.new_solver(with_assumptions=True)

    @cached_property
    def _evaluator(self) -> Any:
        """Solver of the questions at given values, which come with the assumptions."""
        return self.new_solver(with_assumptions=False)

    def new_solver(self, *, with_assumptions: bool) -> Any:
        """Make a solver of Z3 with the budget.

        Args:
            with_assumptions: assert the ranges and the other assumptions.

        Returns:
            The solver.
        """
        solver = z3.Solver(ctx=self._context)
        solver.set("random_seed", 0)
        solver.set("rlimit", self._rlimit)
        solver.set("timeout", max(round(1000 * self._seconds), 1))
        if with_assumptions:
            solver.add(*self._assumptions)
        return solver

    def encode_all(self, terms: Iterable[t.Term]) -> Any:
        """Encode a conjunction; equal objects among the terms of all calls are encoded once.

        Args:
            terms: boolean terms without past-time operators.

        Returns:
            The Boolean expression.
        """
        encoded = [self._shared.encode_once(term, self._encode) for term in terms]
        return self._shared.expressions.conjunction(encoded)

    def values(self, model: Any, scalars: Iterable[t.Variable]) -> dict[str, ScalarValue]:
        """Read values from a model of Z3.

        Args:
            model: the model.
            scalars: scalar variables.

        Returns:
            Value of each of them; any that fits where the model leaves it open.
        """
        return {
            scalar.name: _model_value(model, scalar, self._constants[scalar.name][1]) for scalar in scalars
        }

    def assume(self, term: t.Term) -> None:
        """Add an assumption for all later questions.

        Args:
            term: boolean term without past-time operators.
        """
        encoded = self._encode(lower(term))
        self._solver.add(encoded)
        self._assumptions.append(encoded)
        self._questions.clear()

    def check_sat(self, *terms: t.Term) -> SolverAnswer:
        """Check if the assumptions and all terms can hold together.

        Args:
            terms: boolean terms without past-time operators; they are forgotten afterwards.

        Returns:
            SAT with a model of all scalar variables, UNSAT, or UNKNOWN with the reason.
        """
        self._solver.push()
        try:
            self._solver.add(*(self._encode(lower(term)) for term in terms))
            return self._check(self._solver)
        finally:
            self._solver.pop()

    def check_simplified(self, terms: Iterable[t.Term], tactic: str = "smt") -> SolverAnswer:
        """Check if the assumptions and all terms can hold together, with products multiplied out.

        Args:
            terms: boolean terms without past-time operators.
            tactic: name of Z3's tactic that decides what is left.

        Returns:
            As `check_sat`.
        """
        expand = z3.With(z3.Tactic("simplify", ctx=self._context), som=True)
        solver = z3.Then(expand, z3.Tactic(tactic, ctx=self._context)).solver()
        solver.set("rlimit", self._rlimit)
        solver.set("timeout", max(round(1000 * self._seconds), 1))
        solver.add(*self._assumptions, self.encode_all(terms))
        answer = self._check(solver, with_model=False)
        if answer.result is not SatResult.SAT:
            return answer
        scalars = [scalar for scalar, _ in self._constants.values()]
        return SolverAnswer(SatResult.SAT, self.values(solver.model(), scalars))

    def check_at_values(self, values: Mapping[str, ScalarValue], term: t.Term) -> SolverAnswer:
        """Check if the assumptions and a term hold at given values.

        The values are put in place of the constants, and the solver is asked if what remains can hold. That
        takes a third of the time of the same question with an equation for each value.

        Args:
            values: values by scalar variable; variables that are left out stay free.
            term: boolean term. Its encoding is cached, since long-lived sessions ask about a few terms many
                times.

        Returns:
            SAT without a model, UNSAT, or UNKNOWN with the reason.
        """
        if id(term) not in self._questions:
            encoded = self._shared.encode_once(term, self._encode)
            question = self._shared.expressions.conjunction([*self._assumptions, encoded])
            self._questions[id(term)] = (term, question)
        replaced = []
        for name, value in values.items():
            scalar, constant = self._constants[name]
            replaced.append((constant, self._value(scalar, value)))
        question = z3.substitute(self._questions[id(term)][1], *replaced)
        self._evaluator.push()
        try:
            self._evaluator.add(question)
            return self._check(self._evaluator, with_model=False)
        finally:
            self._evaluator.pop()

    def to_smtlib(self, *terms: t.Term) -> str:
        """Write the question `check_sat(*terms)`, as Z3 gets it, in SMT-LIB 2.6.

        Args:
            terms: boolean terms without past-time operators.

        Returns:
            The script: the assumptions, then one assertion for each term.
        """
        # Not by a solver, which leaves out what is trivially true.
        declared = [constant.decl().sexpr() for _, constant in self._constants.values()]
        required = (*self._assumptions, *(self._encode(lower(term)) for term in terms))
        asserted = [f"(assert {one.sexpr()})" for one in required]
        return "\n".join(("(set-logic ALL)", *declared, *asserted, "(check-sat)\n"))

    def _check(self, solver: Any, *, with_model: bool = True) -> SolverAnswer:
        started = time.monotonic()
        try:
            outcome = solver.check()
        except z3.Z3Exception as error:
            return SolverAnswer(SatResult.UNKNOWN, {}, str(error))
        if outcome == z3.unsat:
            return SolverAnswer(SatResult.UNSAT, {})
        if outcome == z3.unknown and time.monotonic() - started >= self._seconds:
            return timeout_answer(self._seconds)  # Z3 says `canceled`, as it does of its budget
        if outcome == z3.unknown:
            return SolverAnswer(SatResult.UNKNOWN, {}, solver.reason_unknown())
        return SolverAnswer(SatResult.SAT, self._model() if with_model else {})

    def _model(self) -> dict[str, ScalarValue]:
        return self.values(self._solver.model(), (scalar for scalar, _ in self._constants.values()))

    def _value(self, scalar: t.Variable, value: Any) -> Any:
        make = self._shared.expressions
        if isinstance(scalar.type, EnumType):
            return z3.IntVal(scalar.type.members.index(value), self._context)
        # Not from the cache: a long session asks about ever new numbers.
        return make.truth(value) if isinstance(value, bool) else make.new_number(value)

    def _encode(self, term: t.Term) -> Any:
        make = self._shared.expressions
        match term:
            case t.Literal(value=str(value), type=EnumType(members=members)):
                return z3.IntVal(members.index(value), self._context)
            case t.Literal(value=bool(value)):
                return make.truth(value)
            case t.Literal(value=Fraction() as value):
                return make.number(value)
            case t.Variable(name=name):
                return self._constants[name][1]
            case t.Not(operand=operand):
                return make.negation(self._encode(operand))
            case t.And(operands=operands):
                return make.conjunction([self._encode(one) for one in operands])
            case t.Or(operands=operands):
                return make.disjunction([self._encode(one) for one in operands])
            case t.Compare(op=op, left=left, right=right):
                return make.comparison(op, self._encode(left), self._encode(right))
            case t.Add(left=left, right=right):
                return make.sum(self._encode(left), self._encode(right))
            case t.Multiply(left=left, right=right):
                return make.product(self._encode(left), self._encode(right))
            case t.Extremum(kind=kind, left=left, right=right):
                a, b = self._encode(left), self._encode(right)
                least = make.comparison("<=", a, b)
                return make.choice(least, a, b) if kind == "min" else make.choice(least, b, a)
            case t.Absolute(operand=operand):
                a = self._encode(operand)
                is_positive = make.comparison("<=", make.number(Fraction(0)), a)
                return make.choice(is_positive, a, make.opposite(a))
            case t.Conditional(condition=condition, then=then, otherwise=otherwise):
                return make.choice(*map(self._encode, (condition, then, otherwise)))
            case _:
                raise AssertionError(f"not in the scalar core: {term}")


def _model_value(model: Any, scalar: t.Variable, constant: Any) -> ScalarValue:
    value = model.eval(constant, model_completion=True)
    match scalar.type:
        case BoolType():
            return bool(z3.is_true(value))
        case EnumType(members=members):
            return str(members[value.as_long()])
        case _:
            return _fraction(value)


def _fraction(value: Any) -> Fraction:
    """Read a model value. An irrational one is approximated; replaying the witness notices that."""
    if z3.is_algebraic_value(value):
        value = value.approx(_DIGITS)
    return Fraction(value.numerator_as_long(), value.denominator_as_long())
