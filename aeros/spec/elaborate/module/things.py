"""Elaboration of the things that a module's variables describe, for the agent's world model."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

from aeros.spec.declared import ecm as declared_ecm
from aeros.spec.declared import perception as declared
from aeros.spec.declared.field_types import Identifier
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.expressions import elaborate_condition, elaborate_quantity
from aeros.spec.elaborate.names import check_name_is_free, resolve_name
from aeros.spec.elaborate.scopes import state_scope
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import EnumType, IntegerType, Type, VectorType
from aeros.spec.expr.units import LENGTH, TIME
from aeros.spec.model.perception import Thing
from aeros.spec.model.site import Site
from aeros.spec.text.fields import ExpressionField


def elaborate_things(ecm: declared_ecm.Ecm, site: Site, diagnostics: Diagnostics) -> dict[str, Thing]:
    """Elaborate the things of a module.

    Args:
        ecm: the declared module.
        site: site under which it is elaborated, with all variables that the module may read.
        diagnostics: receives the faults.

    Returns:
        The things without faults, by name.
    """
    used: dict[str, str] = {}
    things = _Things(ecm, site, diagnostics)
    return {
        name.value: things.elaborate(name.value, thing)
        for name, thing in ecm.things
        if check_name_is_free(name, used, "thing", diagnostics)
    }


class _Things:
    """Elaborates things of one module under one site."""

    def __init__(self, ecm: declared_ecm.Ecm, site: Site, diagnostics: Diagnostics) -> None:
        self._module = ecm.id.value
        self._parameters = {name.value for _, task in ecm.tasks for name, _ in task.parameters}
        self._site = site
        self._diagnostics = diagnostics

    def elaborate(self, name: str, thing: declared.Thing) -> Thing:
        kind, kind_from = thing.kind.value, None
        if kind in self._parameters:
            kind_from = self._variable(thing.kind, lambda type_: isinstance(type_, EnumType), "of an enum")
            kind = ""
        relations = {
            f"{word} {place.value}": self._condition(condition)
            for word, places in (("on", thing.on), ("in", thing.in_))
            for place, condition in places
        }
        return Thing(
            f"{self._module}.{name}",
            kind,
            kind_from,
            self._variable(thing.position, lambda type_: type_ == VectorType(LENGTH), "a `vec3` in m"),
            self._variable(thing.count, lambda type_: isinstance(type_, IntegerType), "an `int`"),
            self._condition(thing.held),
            {relation: term for relation, term in relations.items() if term is not None},
            self._recall(name, thing),
        )

    def _recall(self, name: str, thing: declared.Thing) -> Fraction | None:
        """Return the greatest age of what is recalled, s; None if nothing is, or after reporting a fault."""
        if thing.recall is None:
            return None
        if thing.position is None:
            headline = f"`{name}` has no `position`, so there is no place to recall"
            self._diagnostics.error("AE208", headline, thing.recall.span, help=("add `position`",))
        return elaborate_quantity(thing.recall, TIME, self._diagnostics)

    def _variable(self, name: Identifier | None, fits: Callable[[Type], bool], noun: str) -> str | None:
        """Return the full name of a variable; None if none is named, or after reporting a wrong one."""
        if name is None:
            return None
        known = resolve_name(name, self._site.state, "a state variable", self._diagnostics)
        if known is None:
            return None
        if not fits(known.variable.type):
            headline = f"`{name.value}` is {known.variable.type}, not {noun}"
            self._diagnostics.error("AE203", headline, name.span)
            return None
        return known.name

    def _condition(self, expression: ExpressionField | None) -> t.Term | None:
        if expression is None:
            return None
        condition = elaborate_condition(expression, state_scope(self._site), self._diagnostics)
        return None if condition is None else condition.term
