"""What a solver answers; known without importing one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from fractions import Fraction

ScalarValue = bool | Fraction | str
"""A value of a scalar variable: truth, exact real in SI, enum member."""


class SatResult(Enum):
    """What the solver found."""

    SAT = "sat"
    UNSAT = "unsat"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class SolverAnswer:
    """A result, with the model by scalar variable when SAT and the reason when UNKNOWN."""

    result: SatResult
    model: Mapping[str, ScalarValue]
    reason: str = ""


@dataclass(frozen=True, slots=True)
class ScriptAnswer:
    """What came of SMT-LIB text that asks once.

    model: when SAT, the value of each constant that it declares, as SMT-LIB text.
    core: when UNSAT, how many of its assertions are enough for that.
    spent: resource units of the solver.
    reason: why, when UNKNOWN.
    """

    result: SatResult
    model: Mapping[str, str]
    unsat_core: int
    rlimit_used: int
    reason: str = ""
