"""Search for starts that no state agrees with: a stated predicate that the other stated values exclude."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from aeros.spec.consequences.consequences import (
    are_excluded,
    expanded_definition,
    known_definitions,
)
from aeros.spec.consequences.disturbance import Definitions
from aeros.spec.expr import terms as t
from aeros.spec.expr.constants import constant_term
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
