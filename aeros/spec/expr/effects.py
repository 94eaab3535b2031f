"""Effects of an outcome: what is true of state variables after it, in terms of what was true before.

This file is their meaning; proofs, planners, the closed loop, the plants and the supervisor use it.

An effect on a truth value, a member of an enum or a number is the value afterwards. An effect `+= 1` on a
whole number, an `Increment`, is the value before and 1. A planner's state has a value for each of these, so
whole numbers with an increment have a finite range, and a proof shows that they stay in it.

A `QuantityRange` says of a real number, or of a component of a vector, that it lies between two bounds
afterwards. No state of a planner has it: real numbers have infinitely many values. What plans and proofs
say of it, they say by predicates with a `definition`, and an outcome with a range declares these predicates,
too. A proof shows that the two agree.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from aeros.spec.expr import terms as t
from aeros.spec.expr.types import RealType, VectorType
from aeros.spec.expr.units import format_number


@dataclass(frozen=True)
class Increment:
    """Effect on a whole number: its value afterwards is its value before and an amount.

    Attributes:
        amount: what is added; negative for `-=`.
    """

    amount: Fraction

    def __str__(self) -> str:
        """As a manifest has it."""
        return f"{'-' if self.amount < 0 else '+'}= {format_number(abs(self.amount))}"


@dataclass(frozen=True)
class QuantityRange:
    """Effect on a real number or on one component of a vector: it is in a closed range afterwards.

    Attributes:
        variable: full name of the state variable.
        axis: 0, 1 or 2 for a component of a vector; None for a real number.
        low: least value, SI.
        high: greatest value, SI.
    """

    variable: str
    axis: int | None
    low: Fraction
    high: Fraction

    @property
    def name(self) -> str:
        """Name of the number in conditions, as in `push_sponge.sponge_position.y`."""
        return self.variable if self.axis is None else f"{self.variable}.{'xyz'[self.axis]}"

    def number_of(self, value: Any) -> Any:
        """Read the number that is in the range from a value of the variable.

        Args:
            value: value of the whole variable, SI.

        Returns:
            The value, or its component.
        """
        return value if self.axis is None else value[self.axis]

    def contains(self, value: Any) -> bool:
        """Say if a value of the variable is in the range.

        Args:
            value: value of the whole variable, SI.

        Returns:
            True if its number, or its component, is between the bounds.
        """
        return bool(self.low <= self.number_of(value) <= self.high)

    def middle_of(self, value: Any) -> Any:
        """Put a value of the variable into the middle of the range.

        Args:
            value: value of the whole variable before, SI; other components of a vector stay as they are.

        Returns:
            The value, SI, as doubles.
        """
        middle = float((self.low + self.high) / 2)
        if self.axis is None:
            return middle
        return tuple(middle if axis == self.axis else float(part) for axis, part in enumerate(value))

    def term(self, variable: t.Variable) -> t.Term:
        """Make the condition that the range states.

        Args:
            variable: the state variable.

        Returns:
            `low <= variable <= high`, of a component where there is an axis.
        """
        type_ = variable.type
        dimension = type_.dimension if isinstance(type_, RealType | VectorType) else None
        assert dimension is not None  # noqa: S101  elaboration admits no other type
        number = variable if self.axis is None else t.Component(variable, self.axis)
        low, high = (t.Literal(bound, RealType(dimension)) for bound in (self.low, self.high))
        return t.And((t.Compare("<=", low, number), t.Compare("<=", number, high)))

    def __str__(self) -> str:
        """As a manifest has it, in SI units."""
        return f"in [{format_number(self.low)}, {format_number(self.high)}]"


def value_after(effect: Any, before: Any) -> Any:
    """Compute the value that an effect leaves.

    Args:
        effect: a value, or an increment.
        before: value before; None if it is unknown.

    Returns:
        The value afterwards; None if it is unknown.
    """
    if not isinstance(effect, Increment):
        return effect
    return None if before is None else before + effect.amount


def state_after(effects: Mapping[str, Any], before: Mapping[str, Any]) -> dict[str, Any]:
    """Compute the values that several effects leave.

    Args:
        effects: effects by state variable.
        before: values before, by state variable; what is missing is unknown.

    Returns:
        Value afterwards of each variable that has an effect; None if it is unknown.
    """
    return {name: value_after(effect, before.get(name)) for name, effect in effects.items()}


def values_reached(effects: Iterable[Any], bounds: tuple[Fraction, Fraction] | None) -> tuple[Any, ...]:
    """List all values that effects on one variable may leave.

    Args:
        effects: its effects.
        bounds: range of the variable; present if some effect is an increment.

    Returns:
        The values: every whole number of the range if some effect is an increment.
    """
    listed = list(effects)
    if any(isinstance(one, Increment) for one in listed):
        assert bounds is not None  # noqa: S101  elaboration admits no increment without a range
        return tuple(map(Fraction, range(int(bounds[0]), int(bounds[1]) + 1)))
    return tuple(dict.fromkeys(listed))
