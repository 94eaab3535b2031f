"""Elaboration of predicates by definition: their conditions, and the margins for uncertain values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction

from aeros.spec.declared import ecm as declared_ecm
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.expressions import elaborate_expression
from aeros.spec.elaborate.scopes import state_scope
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BoolType
from aeros.spec.model.perception import Definition
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared
from aeros.spec.text.fields import NumberField


def elaborate_definitions(
    ecm: declared_ecm.Ecm, own: Mapping[str, Declared], site: Site, diagnostics: Diagnostics
) -> dict[str, Definition]:
    """Elaborate the definitions of a module; each may read those above it.

    Args:
        ecm: the declared module.
        own: its state variables by short name.
        site: the site with all variables that the module may read.
        diagnostics: receives the faults.

    Returns:
        The definitions without faults, by full name of the predicate.
    """
    module = ecm.id.value
    written = {name.value: one for name, one in ecm.state if one.definition is not None}
    unread = {*written, *(f"{module}.{name}" for name in written)}
    definitions: dict[str, Definition] = {}
    for name, one in ecm.state:
        if one.definition is None:
            if one.margin is not None:
                headline = f"`{name.value}` has no definition that a margin could be for"
                diagnostics.error("AE120", headline, one.margin.span, help=("remove `margin`",))
            continue
        if name.value not in own:
            continue
        type_ = own[name.value].variable.type
        if not isinstance(type_, BoolType):
            headline = f"`{name.value}` is {type_}; only a `bool` can have a definition"
            diagnostics.error("AE203", headline, one.definition.span)
            continue
        full = f"{module}.{name.value}"
        readable = {each: variable for each, variable in site.state.items() if each not in unread}
        scope = state_scope(replace(site, state=readable))
        term = elaborate_expression(one.definition, scope, diagnostics)
        if term is not None:
            margin = _margin(one.margin, term, readable, diagnostics)
            definitions[full] = Definition(term, one.definition.value, one.definition.span, margin)
        unread -= {name.value, full}
    return definitions


def _margin(
    margin: NumberField | None, term: t.Term, readable: Mapping[str, Declared], diagnostics: Diagnostics
) -> Fraction:
    """Return the margin of a definition; it needs a value that has an uncertainty."""
    if margin is None:
        return Fraction(0)
    read = t.variables_of(term)
    if not any(one.name in read and one.uncertainty is not None for one in readable.values()):
        headline = "the definition reads no value that has an `uncertainty`, so a margin changes nothing"
        diagnostics.error("AE112", headline, margin.span, help=("remove `margin`",))
    return margin.value
