"""Declared variables with their units, ranges and facts, and the histories of past-time conditions. SI.

Only `elaborate` builds them; obligations, the gate and planners read them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from math import inf
from typing import Any

from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.expr import terms as t
from aeros.spec.expr.doubles import adjacent_doubles
from aeros.spec.expr.lower import scalar_variables
from aeros.spec.expr.scope import AxisAlignedBox
from aeros.spec.expr.types import EnumType, RealType
from aeros.spec.expr.units import DIMENSIONLESS, Unit

Ranges = Mapping[str, tuple[Fraction, Fraction]]


@dataclass(frozen=True)
class Declared:
    """Declared variable: its term, its unit for people, and its bounds.

    Attributes:
        variable: the variable as a term.
        span: place of the declaration.
        unit: unit in which people read and write its values; terms are in SI.
        range: closed range (SI) of the value, of each component of a vector or of each member of a family;
            present for reals and vectors.
        max_age: seconds after which a measured value is unknown; None for parameters and inputs.
        sensor: sensor that measures it; None for parameters and inputs.
        default_value: default of an input, in SI; None if a step must give it.
        range_span: place of the declared bounds.
        known_facts: conditions that hold of it in every state, in addition to its range.
        uncertainty: greatest standard uncertainty (SI) of a value that a perceiver measured; a less certain
            value is unknown. None if values have none, and for variables of a site.
        is_public: its module lets those that require it read it.
        occupies: space around the position that the thing there takes up, m; None if the module states none.
        is_recalled: a perceiver that reads the agent's memory provides it: no condition may read it, and no
            perceiver, so it never counts as measured.
    """

    variable: t.Variable
    span: SourceSpan
    unit: Unit = DIMENSIONLESS
    range: tuple[Fraction, Fraction] | None = None
    max_age: Fraction | None = None
    sensor: str | None = None
    default_value: Any = None
    range_span: SourceSpan | None = None
    known_facts: tuple[t.Term, ...] = ()
    uncertainty: Fraction | None = None
    is_public: bool = False
    occupies: AxisAlignedBox | None = None
    is_recalled: bool = False

    @property
    def name(self) -> str:
        """Name in expressions; `inputs.NAME` for an input."""
        return self.variable.name

    @cached_property
    def double_range(self) -> tuple[float, float]:
        """Least and greatest double in `range`; infinite if there is none."""
        if self.range is None:
            return -inf, inf
        return adjacent_doubles(self.range[0])[1], adjacent_doubles(self.range[1])[0]


def measured_by_site(state: Mapping[str, Declared]) -> tuple[str, ...]:
    """List the variables of a module that a sensor of the site measures, such as places of fixtures.

    Args:
        state: the module's own state variables by full name.

    Returns:
        Their full names; what perceivers measure, definitions and parameters of tasks are left out.
    """
    # The source of what a module makes itself has the module's name before it.
    return tuple(name for name, one in state.items() if one.sensor is not None and "." not in one.sensor)


def members_of(state: Mapping[str, Declared]) -> dict[str, tuple[str, ...]]:
    """List the members of each variable's enum.

    Args:
        state: variables by name.

    Returns:
        For each variable, by its name in its module or site, the members; none if it is of no enum.
    """
    types = {name.rpartition(".")[2]: one.variable.type for name, one in state.items()}
    return {name: type_.members if isinstance(type_, EnumType) else () for name, type_ in types.items()}


def ranges_of(declared: Iterable[Declared]) -> dict[str, tuple[Fraction, Fraction]]:
    """Collect the ranges of variables.

    Args:
        declared: declared variables.

    Returns:
        The closed range (SI) of each real scalar variable, by its name.
    """
    return {
        scalar.name: entry.range
        for entry in declared
        for scalar in scalar_variables(entry.variable)
        if isinstance(scalar.type, RealType) and entry.range is not None
    }


def relevant_facts(
    terms: Sequence[t.Term], known: Mapping[str, Declared]
) -> tuple[tuple[Declared, ...], tuple[t.Term, ...]]:
    """Collect the variables that terms depend on, and all known facts about them.

    Args:
        terms: boolean terms.
        known: declared variables by name.

    Returns:
        The variables, in the order of `known`, and the terms followed by the facts. Variables of facts count
        too.
    """
    relevant: set[str] = set()
    pending, whole = list(terms), list(terms)
    while pending:
        for name in t.variables_of(pending.pop()):
            if name in known and name not in relevant:
                relevant.add(name)
                pending += known[name].known_facts
                whole += known[name].known_facts
    return tuple(entry for name, entry in known.items() if name in relevant), tuple(whole)


@dataclass(frozen=True)
class History:
    """Past-time condition of the rules, as a variable that the runtime keeps up to date.

    Attributes:
        declared: the variable; its name is the condition's text, and its known facts always hold.
        term: past-time term; its operands are over state variables and earlier histories.
    """

    declared: Declared
    term: t.PastTerm
