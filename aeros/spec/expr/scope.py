"""Names that an expression may use, and the error for an expression that does not type-check."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction

from aeros.spec.expr import terms as t
from aeros.spec.expr.syntax import TextRange
from aeros.spec.expr.types import EnumType


@dataclass(frozen=True, slots=True)
class AxisAlignedBox:
    """Closed axis-aligned box in the world frame W.

    Attributes:
        lower: corner with the least coordinates, m.
        upper: corner with the greatest coordinates, m.
    """

    lower: tuple[Fraction, Fraction, Fraction]
    upper: tuple[Fraction, Fraction, Fraction]


@dataclass(frozen=True, slots=True)
class Scope:
    """Names that an expression may use, with their meaning.

    Attributes:
        variables: state variables and, where an action is decided, its parameters.
        inputs: inputs of the skill, written `inputs.NAME`.
        constants: constant terms of the site.
        enums: enumerations, which are also the sets of quantifiers.
        volumes: boxes in W that `in` tests.
        roles: parameters by name, of each action that a joint rule speaks of.
        past: True if past-time operators are allowed.
        recalled: names of state variables that come from memory, which no expression may read.
        definitions: conditions on the state that a name stands for; usable where all that it reads is.
    """

    variables: Mapping[str, t.Variable]
    inputs: Mapping[str, t.Variable] = field(default_factory=dict)
    constants: Mapping[str, t.Term] = field(default_factory=dict)
    enums: Mapping[str, EnumType] = field(default_factory=dict)
    volumes: Mapping[str, AxisAlignedBox] = field(default_factory=dict)
    roles: Mapping[str, Mapping[str, t.Variable]] = field(default_factory=dict)
    past: bool = False
    recalled: frozenset[str] = frozenset()
    definitions: Mapping[str, t.Term] = field(default_factory=dict)


class ExpressionTypeError(Exception):
    """Expression that parses but does not type-check.

    Attributes:
        code: id of the diagnostic.
        message: the problem, in one sentence.
        extent: characters of the expression that the error is about.
        label: text shown at `extent`.
        related: a second place with its label, as the other side of a comparison; None if there is none.
        cure: remedy; None if none is known.
    """

    def __init__(
        self,
        code: str,
        message: str,
        extent: TextRange,
        *,
        label: str = "",
        related: tuple[TextRange, str] | None = None,
        cure: str | None = None,
    ) -> None:
        super().__init__(message)
        self.code = code
        self.message = message
        self.extent = extent
        self.label = label
        self.related = related
        self.cure = cure
