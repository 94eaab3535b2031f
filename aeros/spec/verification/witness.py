"""Witnesses from solver models: readable values, replayed through the exact semantics before use."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import cast

from aeros.spec.backends.solver_results import ScalarValue
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import scalar_variables, values_by_variable
from aeros.spec.expr.semantics import Value, is_true
from aeros.spec.expr.types import RealType
from aeros.spec.expr.units import Unit, format_number, format_quantity, to_unit
from aeros.spec.model.variables import Declared


@dataclass(frozen=True)
class Witness:
    """A state, inputs and an action that settle a claim.

    Attributes:
        variables: declarations of the variables.
        values: values in SI units by variable name.
    """

    variables: tuple[Declared, ...]
    values: Mapping[str, Value]

    def lines(self) -> list[str]:
        """Format the values, each in the unit of its declaration.

        Returns:
            A line for each variable, as in `speed = 0.5 m/s`.
        """
        return [f"{one.name} = {format_value(self.values[one.name], one)}" for one in self.variables]


def format_value(value: Value, declared: Declared) -> str:
    """Format a value in the unit of its declaration.

    Args:
        value: the value, in SI units.
        declared: declaration of the variable.

    Returns:
        The text, as in `0.5 m/s`.
    """
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return value
    if isinstance(value, Fraction):
        return format_quantity(value, declared.unit)
    shown = ", ".join(_format_part(part, declared.unit) for part in value)
    return f"[{shown}]" if declared.unit.text == "1" else f"[{shown}] {declared.unit.text}"


def _format_part(part: Fraction | bool, unit: Unit) -> str:
    return str(part).lower() if isinstance(part, bool) else format_number(to_unit(part, unit))


class TermEvaluator:
    """Evaluator of conditions with a cache: most queries about a skill repeat its conditions."""

    def __init__(self) -> None:
        # Keyed by identity: terms are large and fractions slow to hash.  Both are kept, so no id is reused.
        self._known: dict[tuple[int, ...], tuple[t.Term, Mapping[str, Value], bool]] = {}

    def holds(self, term: t.Term, values: Mapping[str, Value]) -> bool:
        """Evaluate a condition as `semantics.is_true` does, at most once for the same values.

        Args:
            term: the condition.
            values: values in SI units by variable name.

        Returns:
            True if it holds.
        """
        read = [values[name] for name in t.variables_of(term)]
        parts = [part for value in read for part in (value if isinstance(value, tuple) else (value,))]
        key = (id(term), *map(id, parts))
        if key not in self._known:
            self._known[key] = (term, values, is_true(term, values))
        return self._known[key][2]


def witness_from_model(
    model: Mapping[str, ScalarValue],
    declared: tuple[Declared, ...],
    required: tuple[t.Term, ...],
    replay: TermEvaluator,
    *,
    shown: bool,
) -> Witness | None:
    """Make a witness of a solver's model and replay it.

    Args:
        model: values by scalar variable.
        declared: declarations of the variables.
        required: the terms that must all hold of a witness.  An irrational model value was approximated
            by the solver, so even a faithful solver's model may fail here.
        replay: evaluator of the terms.
        shown: True if a person will read it, so that rounded numbers are worth looking for.

    Returns:
        The witness; None if it does not replay.
    """
    variables = [one.variable for one in declared]
    values = values_by_variable(variables, model)
    if not shown and _is_witness(values, declared, required, replay):
        return Witness(declared, values)
    scalars = dict(model)
    for one in declared:
        for part in scalar_variables(one.variable):
            if isinstance(part.type, RealType):
                scalars[part.name] = _simplify_value(part.name, scalars, one, declared, required, replay)
    values = values_by_variable(variables, scalars)
    return Witness(declared, values) if _is_witness(values, declared, required, replay) else None


def _simplify_value(
    name: str,
    scalars: Mapping[str, ScalarValue],
    variable: Declared,
    declared: tuple[Declared, ...],
    required: tuple[t.Term, ...],
    replay: TermEvaluator,
) -> Fraction:
    """Return the value with the fewest decimals, in the unit of its declaration, that still is a witness."""
    value = cast("Fraction", scalars[name])
    scaled = to_unit(value, variable.unit)
    variables = [one.variable for one in declared]
    for digits in range(7):
        candidate = variable.unit.to_si(round(scaled, digits))
        values = values_by_variable(variables, {**scalars, name: candidate})
        if _is_witness(values, declared, required, replay):
            return candidate
    return value


def _is_witness(
    values: Mapping[str, Value],
    declared: tuple[Declared, ...],
    required: tuple[t.Term, ...],
    replay: TermEvaluator,
) -> bool:
    return all(_in_range(values[one.name], one) for one in declared) and all(
        replay.holds(term, values) for term in required
    )


def _in_range(value: Value, variable: Declared) -> bool:
    if variable.range is None:
        return True
    low, high = variable.range
    parts = value if isinstance(value, tuple) else (value,)
    return all(low <= part <= high for part in cast("tuple[Fraction, ...]", parts))
