"""Comparison of the encodings of every question with the definition of the language, at points.

The question as Z3 got it is evaluated by the second solver, and the question as the second solver got it by
Z3. So no evaluator reads what it was given by the translation to itself, and none is ours.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple, cast

from aeros.spec.backends.cvc5_solver import truths_at as truths_by_cvc5
from aeros.spec.backends.oracle import SolverQuery
from aeros.spec.backends.resource_limit import QUESTION_SECONDS
from aeros.spec.backends.smtlib import literal, question_script
from aeros.spec.backends.solver_process import SOLVER_PROCESS
from aeros.spec.backends.solver_results import NoAnswerError, ScalarValue
from aeros.spec.backends.z3_scripts import truths_at as truths_by_z3
from aeros.spec.backends.z3_solver import IncrementalSolver
from aeros.spec.diagnostics.errors import DisagreementError
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import scalar_variables, values_by_variable
from aeros.spec.expr.semantics import is_true
from aeros.spec.expr.types import EnumType, IntegerType, RealType
from aeros.spec.expr.units import NUMBER
from aeros.spec.verification.second_opinion.sample_points import Point, sample_points

_Values = Callable[[t.Variable, ScalarValue], str]


class _Encoding(NamedTuple):
    """Text of a question in one encoding."""

    name: str
    script: str
    value: _Values
    truths_at: Callable[[str, Sequence[Mapping[str, str]]], list[list[bool | None]]]


@dataclass(frozen=True)
class EncodingReport:
    """Result of a comparison of encodings; whatever was compared is equal.

    Attributes:
        question_count: number of questions.
        truth_count: number of truth values that were compared, of conditions at points.
        unread_questions: description of each question that a solver did not read, and the reason.
    """

    question_count: int
    truth_count: int
    unread_questions: tuple[tuple[str, str], ...]


def compare_encodings(queries: Iterable[SolverQuery], progress: Callable[[str], None]) -> EncodingReport:
    """Compare both encodings of each question with the definition, condition by condition.

    Args:
        queries: questions of a run with their answers.
        progress: called with a line of text before each question.

    Returns:
        The result.

    Raises:
        DisagreementError: an encoding differs from the definition at a point.
    """
    listed = list(queries)
    compared = 0
    unread: list[tuple[str, str]] = []
    for number, query in enumerate(listed, 1):
        progress(f"{number} of {len(listed)} questions at points, in both encodings")
        question = query.question
        points = sample_points(query)
        expected = [_truths_by_definition(query, point) for point in points]
        for encoding in _encodings(query):
            texts = [_as_text(question.variables, point, encoding.value) for point in points]
            try:
                given = (encoding.script, texts)
                found = SOLVER_PROCESS.ask(encoding.truths_at, *given, seconds=QUESTION_SECONDS)
            except NoAnswerError as why:
                unread.append((query.description, f"{encoding.name}: {why}"))
                continue
            for point, truths, right in zip(points, found, expected, strict=True):
                _require_equal(query, encoding, point, truths, right)
            compared += len(points) * len(question.terms)
    return EncodingReport(len(listed), compared, tuple(unread))


def _encodings(query: SolverQuery) -> tuple[_Encoding, _Encoding]:
    question = query.question
    of_z3 = IncrementalSolver(question.variables, question.ranges).to_smtlib(*question.terms)
    return (
        _Encoding("the encoding for Z3", of_z3, _value_for_z3, truths_by_cvc5),
        _Encoding("the encoding for cvc5", question_script(question), _value_for_cvc5, truths_by_z3),
    )


def _truths_by_definition(query: SolverQuery, point: Point) -> list[bool]:
    env = values_by_variable(query.question.variables, point)
    return [is_true(term, env) for term in query.question.terms]


def _require_equal(
    query: SolverQuery,
    encoding: _Encoding,
    point: Point,
    truths: Sequence[bool | None],
    expected: Sequence[bool],
) -> None:
    """Compare the last assertions, which are the conditions; those before are the ranges, which hold.

    Raises:
        DisagreementError: an assertion has another truth value than by definition.
    """
    right = [True] * (len(truths) - len(expected)) + list(expected)
    for number, (is_found, is_right) in enumerate(zip(truths, right, strict=True), 1):
        if is_found is not is_right:
            values = ", ".join(f"{name} = {value}" for name, value in point.items())
            by_definition = f"the definition says {is_right} of assertion {number} at {values}"
            by_encoding = f"{encoding.name} says {is_found}"
            raise DisagreementError(query.description, encoding.script, by_definition, by_encoding)


def _as_text(variables: Sequence[t.Variable], point: Point, write: _Values) -> dict[str, str]:
    parts = [part for one in variables for part in scalar_variables(one)]
    return {part.name: write(part, point[part.name]) for part in parts}


def _value_for_cvc5(scalar: t.Variable, value: ScalarValue) -> str:
    return literal(scalar.type, value)


def _value_for_z3(scalar: t.Variable, value: ScalarValue) -> str:
    """Write a value as the translation to Z3 does: members are integers, and whole numbers are reals."""
    if isinstance(scalar.type, EnumType):
        return literal(IntegerType(), Fraction(scalar.type.members.index(cast("str", value))))
    return literal(RealType(NUMBER) if isinstance(scalar.type, IntegerType) else scalar.type, value)
