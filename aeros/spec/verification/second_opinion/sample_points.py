"""Points at which the encodings of a question are compared with the definition of the language."""

from __future__ import annotations

import math
import random
from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Final, cast

from aeros.spec.backends.oracle import SolverQuery
from aeros.spec.backends.solver_results import ScalarValue
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import scalar_variables
from aeros.spec.expr.types import BoolType, EnumType, IntegerType

Point = Mapping[str, ScalarValue]
"""Value of each scalar variable of a question, by its name."""

CORNERS: Final = 4  # points at which each number is at an end of its range, chosen at random
TIES: Final = 6  # points at which numbers equal constants of the question, so that comparisons are ties
INNER: Final = 4  # points with random numbers
NEIGHBOURS: Final = 4  # points that differ from the witness in one value, if there is a witness

_UNBOUNDED: Final = (Fraction(-1000), Fraction(1000))  # taken for a number without a range


def sample_points(query: SolverQuery) -> list[Point]:
    """Choose points of a question: least and greatest values, mixed corners, ties, the witness, and others.

    Args:
        query: the question with its answer.

    Returns:
        The points; the same for the same question.
    """
    scalars = [part for one in query.question.variables for part in scalar_variables(one)]
    chooser = _Chooser(query, random.Random(repr((query.description, len(scalars)))))  # noqa: S311  no secret
    points: list[Point] = [
        {one.name: chooser.end(one, 0) for one in scalars},
        {one.name: chooser.end(one, -1) for one in scalars},
    ]
    points += [{one.name: chooser.corner(one) for one in scalars} for _ in range(CORNERS)]
    points += [{one.name: chooser.tie(one) for one in scalars} for _ in range(TIES)]
    points += [{one.name: chooser.inner(one) for one in scalars} for _ in range(INNER)]
    witness = query.answer.model
    if witness:
        whole = {one.name: witness[one.name] for one in scalars}
        points.append(whole)
        points += [
            {**whole, one.name: chooser.tie(one)}
            for one in chooser.random.sample(scalars, min(NEIGHBOURS, len(scalars)))
        ]
    return points


class _Chooser:
    """Source of values for the scalar variables of one question."""

    def __init__(self, query: SolverQuery, generator: random.Random) -> None:
        self.random = generator
        self._ranges = query.question.ranges
        self._constants = sorted(set(_constants(query.question.terms)))

    def end(self, scalar: t.Variable, which: int) -> ScalarValue:
        """Return the least value (0) or the greatest (-1)."""
        return self._ends(scalar)[which]

    def corner(self, scalar: t.Variable) -> ScalarValue:
        """Return an end of the range, or any member."""
        return self.random.choice(self._ends(scalar))

    def tie(self, scalar: t.Variable) -> ScalarValue:
        """Return a constant of the question within the range, if there is one."""
        ends = self._ends(scalar)
        if not isinstance(ends[0], Fraction):
            return self.random.choice(ends)
        low, high = cast("tuple[Fraction, Fraction]", ends)
        is_whole = isinstance(scalar.type, IntegerType)
        fitting = [
            one for one in self._constants if low <= one <= high and (one.denominator == 1 or not is_whole)
        ]
        return self.random.choice(fitting) if fitting else self.inner(scalar)

    def inner(self, scalar: t.Variable) -> ScalarValue:
        """Return a random number between the ends, or any member."""
        ends = self._ends(scalar)
        if not isinstance(ends[0], Fraction):
            return self.random.choice(ends)
        low, high = cast("tuple[Fraction, Fraction]", ends)
        if isinstance(scalar.type, IntegerType):
            return Fraction(self.random.randint(int(low), int(high)))
        return low + (high - low) * Fraction(self.random.randint(0, 1000), 1000)

    def _ends(self, scalar: t.Variable) -> Sequence[ScalarValue]:
        match scalar.type:
            case BoolType():
                return (False, True)
            case EnumType(members=members):
                return members
        low, high = self._ranges.get(scalar.name, _UNBOUNDED)
        if isinstance(scalar.type, IntegerType):
            return Fraction(math.ceil(low)), Fraction(math.floor(high))
        return low, high


def _constants(terms: Sequence[t.Term]) -> Iterator[Fraction]:
    yield from t.constants_in(terms)
    for one in t.walk(terms):
        if isinstance(one, t.ConstantTable):
            yield from one.values
