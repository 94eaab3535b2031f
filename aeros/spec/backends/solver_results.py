"""What a solver answers; known without importing one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from fractions import Fraction

Scalar = bool | Fraction | str
"""A value of a scalar variable: truth, exact real in SI, enum member."""


class Result(Enum):
    """What the solver found."""

    SAT = "sat"
    UNSAT = "unsat"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class Answer:
    """A result, with the model by scalar variable when SAT and the reason when UNKNOWN."""

    result: Result
    model: Mapping[str, Scalar]
    reason: str = ""


@dataclass(frozen=True, slots=True)
class TextAnswer:
    """What came of SMT-LIB text that asks once.

    model: when SAT, the value of each constant that it declares, as SMT-LIB text.
    core: when UNSAT, how many of its assertions are enough for that.
    spent: resource units of the solver.
    reason: why, when UNKNOWN.
    """

    result: Result
    model: Mapping[str, str]
    core: int
    spent: int
    reason: str = ""
