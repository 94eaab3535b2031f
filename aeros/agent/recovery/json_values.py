"""Exact JSON encoding of the agent's values: plans with conditions, fractions, tuples and records.

The set of classes is closed, so decoding runs no code but theirs. Encoding any other class, or decoding
anything else, is a `ValueError`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields
from enum import Enum
from fractions import Fraction
from typing import Any, Final, get_args

from aeros.agent.execution.report import StepRole
from aeros.agent.planning.task_graph import PLAN_SPAN, PlanStep, TaskGraph
from aeros.runtime.ports import LogHead, StepStatus
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.expr import terms as t
from aeros.spec.expr import types
from aeros.spec.expr.units import Dimension
from aeros.spec.model.ecm import ActionCondition
from aeros.spec.model.rules import Conjunct
from aeros.spec.model.step_graph import (
    FailingPart,
    Fallback,
    HeldPart,
    If,
    Par,
    RetriedPart,
    Seq,
    TimedPart,
)

_CLASSES: Final = (
    *(TaskGraph, PlanStep, Seq, Par, If, Fallback, RetriedPart, FailingPart, HeldPart, TimedPart),
    *(ActionCondition, Conjunct, LogHead, Dimension),
    *(types.BoolType, types.RealType, types.IntegerType, types.VectorType, types.EnumType, types.FamilyType),
    *get_args(t.Term),
)
# Files name an enumeration by these keys, whatever its class is called.
_ENUMS: Final[Mapping[str, type[Enum]]] = {"role": StepRole, "status": StepStatus, "variable": t.VariableRole}
_ENUM_NAMES: Final = {kind: name for name, kind in _ENUMS.items()}


class ValueSerializer:
    """Encoder and decoder of values. `extra_classes` are dataclasses beyond those that plans consist of."""

    def __init__(self, extra_classes: Iterable[type[Any]] = ()) -> None:
        self._classes = {kind.__name__: kind for kind in (*_CLASSES, *extra_classes)}

    def encode(self, value: Any) -> Any:
        """Encode a value as JSON values.

        Args:
            value: value of a known class.

        Returns:
            The JSON values.

        Raises:
            ValueError: a part of it is of an unknown class.
        """
        match value:
            case None | bool() | int() | float() | str():
                return value
            case Fraction():
                return {"fraction": f"{value.numerator}/{value.denominator}"}
            case Enum() if type(value) in _ENUM_NAMES:
                return {"enum": _ENUM_NAMES[type(value)], "value": value.value}
            case tuple() if type(value) is tuple:
                return {"tuple": [self.encode(one) for one in value]}
            case list():
                return [self.encode(one) for one in value]
            case Mapping() if all(isinstance(key, str) for key in value):
                return {"map": {key: self.encode(one) for key, one in value.items()}}
            case SourceSpan():
                return {"span": "planned"}
        name = type(value).__name__
        if self._classes.get(name) is not type(value):
            raise ValueError(f"a {name} cannot be written")
        return {"class": name, "fields": {one: self.encode(getattr(value, one)) for one in _fields(value)}}

    def decode(self, written: Any) -> Any:
        """Decode a value that `encode` wrote.

        Args:
            written: the JSON values.

        Returns:
            The value.

        Raises:
            ValueError: `encode` did not write this.
        """
        try:
            return self._decode(written)
        except (KeyError, TypeError, AttributeError, ZeroDivisionError) as error:
            raise ValueError(f"it is not written as such a value is: {error}") from error

    def _decode(self, written: Any) -> Any:
        match written:
            case list():
                return [self._decode(one) for one in written]
            case {"fraction": text}:
                return Fraction(text)
            case {"enum": name, "value": value}:
                return _ENUMS[name](value)
            case {"tuple": parts}:
                return tuple(self._decode(one) for one in parts)
            case {"map": entries}:
                return {key: self._decode(one) for key, one in entries.items()}
            case {"span": "planned"}:
                return PLAN_SPAN
            case {"class": name, "fields": held}:
                return self._classes[name](**{key: self._decode(one) for key, one in held.items()})
            case dict():
                raise ValueError(f"no value has the form {sorted(written)}")
        return written


def _fields(value: Any) -> tuple[str, ...]:
    """Return the field names of a dataclass or named tuple."""
    return getattr(value, "_fields", None) or tuple(field.name for field in fields(value))
