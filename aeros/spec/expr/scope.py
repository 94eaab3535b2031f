"""What the names of an expression may mean where it stands, and the fault of one that means nothing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction

from aeros.spec.expr import terms as t
from aeros.spec.expr.syntax import TextRange
from aeros.spec.expr.types import EnumType


@dataclass(frozen=True, slots=True)
class AxisAlignedBox:
    """An axis-aligned closed box in the world frame W; corners in metres."""

    lower: tuple[Fraction, Fraction, Fraction]
    upper: tuple[Fraction, Fraction, Fraction]


@dataclass(frozen=True, slots=True)
class Scope:
    """What the names of an expression may mean.

    roles: parameters by name, of each action that a joint rule speaks of.
    past: whether past-time operators may look back.
    """

    variables: Mapping[str, t.Variable]
    inputs: Mapping[str, t.Variable] = field(default_factory=dict)
    constants: Mapping[str, t.Term] = field(default_factory=dict)
    enums: Mapping[str, EnumType] = field(default_factory=dict)
    volumes: Mapping[str, AxisAlignedBox] = field(default_factory=dict)
    roles: Mapping[str, Mapping[str, t.Variable]] = field(default_factory=dict)
    past: bool = False


class ExpressionTypeError(Exception):
    """An expression that parses but means nothing: code, where, what stands beside it, and the cure."""

    def __init__(
        self,
        code: str,
        message: str,
        extent: TextRange,
        *,
        label: str = "",
        beside: tuple[TextRange, str] | None = None,
        cure: str | None = None,
    ) -> None:
        super().__init__(message)
        self.code = code
        self.message = message
        self.extent = extent
        self.label = label
        self.beside = beside
        self.cure = cure
