"""Elaboration of predicates by definition: their conditions, margins, and those that a site defines."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass, replace
from fractions import Fraction
from typing import Any, NamedTuple

from aeros.spec.declared import ecm as declared_ecm
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.elaborate.expressions import elaborate_expression
from aeros.spec.elaborate.scopes import state_scope
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL, BoolType
from aeros.spec.model.perception import Definition
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared
from aeros.spec.text.fields import ExpressionField, MappingField, NumberField, undotted_names


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


class AdoptedDefinitions(NamedTuple):
    """Predicates of a module that its site defines.

    Attributes:
        predicates: them by full name, as in `kettle.person_is_near`.
        definitions: their definitions by full name.
        site: the site with the predicates by short and by full name.
    """

    predicates: dict[str, Declared]
    definitions: dict[str, Definition]
    site: Site


def adopted_definitions(ecm: declared_ecm.Ecm, site: Site) -> AdoptedDefinitions:
    """Make predicates of a module out of the site's definitions that it uses.

    Args:
        ecm: the declared module.
        site: the site with all variables that the module may read.

    Returns:
        The predicates. Definitions that read what the module may not read are left out.
    """
    readable = {one.name: one for one in site.state.values() if not one.is_recalled}
    words = {word for text in _texts(ecm) for word in undotted_names(text)} if site.definitions else set()
    short: dict[str, Declared] = {}
    for name in (one for one in site.definitions if one in words):
        definition = site.definitions[name]
        read = t.variables_of(definition.term)
        if read.keys() <= readable.keys():
            full = f"{ecm.id.value}.{name}"
            variable = t.Variable(full, BOOL, t.VariableRole.STATE)
            # An older reading leaves it unknown: each is checked where the definition is evaluated.
            age = max(readable[one].max_age or Fraction(0) for one in read)
            short[name] = Declared(variable, definition.span, max_age=age, sensor=full)
    predicates = {one.name: one for one in short.values()}
    definitions = {one.name: site.definitions[name] for name, one in short.items()}
    return AdoptedDefinitions(
        predicates, definitions, replace(site, state={**site.state, **short, **predicates}) if short else site
    )


def _texts(part: Any) -> Iterator[str]:
    """Yield the expressions of a declared part, and the names in its mappings, such as those of effects."""
    if isinstance(part, ExpressionField):
        yield part.value
    elif isinstance(part, tuple):
        for one in part:
            yield from _texts(one)
    elif isinstance(part, MappingField):
        for name, one in part:
            yield name.value
            yield from _texts(one)
    elif is_dataclass(part) and not isinstance(part, SourceSpan):
        for one in fields(part):
            yield from _texts(getattr(part, one.name))


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
