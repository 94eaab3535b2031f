"""Bounds in force on single quantities: those of the rules about the actions under way.

The latest decided action of each skill counts until the skill's step ends. For plots and views only; the gate
decides.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from math import isfinite
from typing import Any, NamedTuple

from aeros.runtime.monitor.rule_bounds import Bound, rule_bounds
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower, scalar_variables
from aeros.spec.expr.semantics import Value
from aeros.spec.expr.types import EnumType, RealType
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared


class BoundInForce(NamedTuple):
    """A bound by a rule about an action under way.

    Attributes:
        rule: id of the rule.
        site: site that the action was decided under.
        kind: kind of the action.
        bound: the bound.
        value: value (SI) of the variable that is bounded, measured or decided.
    """

    rule: str
    site: Site
    kind: str
    bound: Bound
    value: Fraction

    @property
    def is_requested(self) -> bool:
        """True if the variable is a parameter of the action; False if it is measured."""
        return self.bound.variable.role is t.VariableRole.PARAMETER

    @property
    def name(self) -> str:
        """Name of the variable, after the kind of action if it is a parameter of one."""
        name = self.bound.variable.name
        return f"{self.kind}.{name}" if self.is_requested else name

    @property
    def declared(self) -> Declared:
        """Declaration of the variable."""
        if self.is_requested:
            return self.site.kinds[self.kind].parameters[self.bound.variable.name.partition(".")[0]]
        return next(
            one
            for one in self.site.state.values()
            if self.bound.variable.name in {part.name for part in scalar_variables(one.variable)}
        )


class BoundsInForce:
    """Actions under way, and the bounds by the rules about them."""

    def __init__(self) -> None:
        self._under_way: dict[str, tuple[Site, str, Mapping[str, Value]]] = {}
        self._terms: dict[tuple[str, str], list[tuple[str, t.Term]]] = {}

    def begin(self, skill: str, site: Site, kind: str, parameters: Mapping[str, Any]) -> None:
        """Note that an action begins; it replaces the skill's previous one.

        Args:
            skill: skill that it belongs to, as `MODULE.SKILL`.
            site: site that it was decided under.
            kind: kind of the action; one that the site does not have is ignored.
            parameters: its decided parameters, as recorded.
        """
        if kind in site.kinds:
            declared = site.kinds[kind].parameters.items()
            decided = {
                scalar: value
                for name, one in declared
                for scalar, value in scalars(one, parameters.get(name))
            }
            self._under_way[skill] = (site, kind, decided)

    def end(self, skill: str) -> None:
        """Note that a skill has ended, and its action with it.

        Args:
            skill: the skill.
        """
        self._under_way.pop(skill, None)

    def find(self, measured: Mapping[str, Value]) -> Iterator[BoundInForce]:
        """Find all bounds in force.

        Args:
            measured: exact values of what is measured, by scalar variable.

        Yields:
            Each bound of a variable with a value.
        """
        for site, kind, decided in self._under_way.values():
            values = {**measured, **decided}
            for rule, term in self._terms_of(site, kind):
                for bound in rule_bounds(term, values):
                    value = values.get(bound.variable.name)
                    if isinstance(value, Fraction):
                        yield BoundInForce(rule, site, kind, bound, value)

    def _terms_of(self, site: Site, kind: str) -> list[tuple[str, t.Term]]:
        key = (site.digest, kind)
        if key not in self._terms:
            self._terms[key] = [(rule.id, lower(rule.terms[kind])) for rule in site.rules_for_kind(kind)]
        return self._terms[key]


def scalars(declared: Declared, value: Any) -> Sequence[tuple[str, Value]]:
    """Split a recorded or measured value into exact scalars.

    Args:
        declared: declaration of its variable.
        value: the value, SI; a list or tuple for a vector or family.

    Returns:
        Name and value of each scalar variable; empty if the value has the wrong form.
    """
    names = scalar_variables(declared.variable)
    parts = value if isinstance(value, list | tuple) else [value]
    if len(parts) != len(names):
        return ()
    found: list[tuple[str, Value]] = []
    for variable, part in zip(names, parts, strict=True):
        match variable.type:
            case RealType():
                if type(part) not in (float, int) or not isfinite(part):
                    return ()
                found.append((variable.name, Fraction(part)))
            case EnumType(members=members):
                if part not in members:
                    return ()
                found.append((variable.name, part))
            case _:
                if type(part) is not bool:
                    return ()
                found.append((variable.name, part))
    return found
