"""Values at the start of a task: what the stated ones decide, and those that no state agrees with."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fractions import Fraction
from typing import Any, NamedTuple

from aeros.spec.consequences.consequences import (
    are_excluded,
    expanded_definition,
    known_definitions,
)
from aeros.spec.consequences.disturbance import Definitions
from aeros.spec.expr import terms as t
from aeros.spec.expr.constants import constant_term
from aeros.spec.expr.semantics import is_true
from aeros.spec.expr.types import FamilyType, RealType, VectorType
from aeros.spec.model.ecm import Ecm, Task
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared


class StartContradiction(NamedTuple):
    """A predicate that cannot have its stated value at the start of a task.

    Attributes:
        predicate: full name of a predicate that has a definition.
        stated: the value that `initial` states.
        definition: its definition, as written.
        values: the other stated values that decide it, by full name.
    """

    predicate: str
    stated: bool
    definition: str
    values: Mapping[str, Any]


def find_start_contradiction(ecm: Ecm, task: Task, site: Site) -> StartContradiction | None:
    """Search the stated start of a task for a predicate that its definition gives the other value.

    Args:
        ecm: the module of the task, with the modules that it requires.
        task: the task.
        site: site under which the module is elaborated, with the variables of the required modules.

    Returns:
        The first such predicate in the order of `initial`; None if some state has all stated values, or the
        solver gives up.
    """
    definitions = known_definitions(ecm)
    declared = {name: one for name, one in site.observed_variables.items() if name in task.initial}
    stated = {name: tuple(_stated(name, task.initial[name], declared, definitions)) for name in declared}
    earlier = {name: terms for name, terms in stated.items() if name not in definitions}
    for name in (one for one in stated if one in definitions):
        earlier[name] = stated[name]
        if are_excluded(tuple(term for terms in earlier.values() for term in terms), site.observed_variables):
            return StartContradiction(
                name, task.initial[name], definitions[name].text, _deciding(name, stated, task, definitions)
            )
    return None


def with_defined_predicates(given: Mapping[str, Any], definitions: Definitions) -> dict[str, Any]:
    """Add the predicates by definition that given values decide.

    Args:
        given: values (SI) by full name; an exact number for each float.
        definitions: definitions by full name of the predicate.

    Returns:
        The given values, and the value of each other predicate whose definition reads only what has one.
    """
    known = {name: _exact(value) for name, value in given.items() if value is not None}
    pending = [name for name in definitions if name not in known]
    while True:
        decided = {
            name: is_true(definitions[name].term, known)
            for name in pending
            if t.variables_of(definitions[name].term).keys() <= known.keys()
        }
        if not decided:
            added = definitions.keys() & known.keys() - given.keys()
            return {**given, **{name: known[name] for name in sorted(added)}}
        known |= decided
        pending = [name for name in pending if name not in decided]


def _exact(value: Any) -> Any:
    if isinstance(value, tuple):
        return tuple(_exact(part) for part in value)
    return Fraction(value) if isinstance(value, float) else value


def _stated(
    name: str, value: Any, declared: Mapping[str, Declared], definitions: Definitions
) -> Iterator[t.Term]:
    """Yield the conditions on readings that a stated value amounts to."""
    variable = declared[name].variable
    if isinstance(value, bool):
        term = expanded_definition(name, definitions) if name in definitions else variable
        yield term if value else t.Not(term)
    elif isinstance(variable.type, VectorType):
        part_type = RealType(variable.type.dimension)
        for axis, part in enumerate(value):
            yield t.Compare("==", t.Component(variable, axis), constant_term(part, part_type))
    elif value is not None and not isinstance(variable.type, FamilyType):
        yield t.Compare("==", variable, constant_term(value, variable.type))


def _deciding(
    name: str, stated: Mapping[str, tuple[t.Term, ...]], task: Task, definitions: Definitions
) -> dict[str, Any]:
    """Return the stated values of what the definition reads, directly or by other definitions."""
    read = t.variables_of(definitions[name].term).keys() | t.variables_of(
        expanded_definition(name, definitions)
    )
    others = {
        one
        for one in stated
        if one in definitions and read & t.variables_of(expanded_definition(one, definitions)).keys()
    }
    return {one: task.initial[one] for one in stated if one != name and one in read | others}
