"""Causes of predicates by definition: the measured values that make one false, true or unknown."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from aeros.agent.world.world import WorldModel
from aeros.spec.expr import terms as t
from aeros.spec.expr.shortfall import UnmetBound
from aeros.spec.expr.units import format_quantity
from aeros.spec.model.cause import Cause, file_and_line
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.perception import Definition
from aeros.spec.model.variables import Declared


def definition_causes(
    world: WorldModel, parts: Iterable[UnmetBound], modules: Mapping[str, Ecm]
) -> tuple[Cause, ...]:
    """Explain each predicate by definition that a condition is not met for.

    Args:
        world: the measured world.
        parts: the parts of the condition that are not met, as `WorldModel.unmet_parts` returns them.
        modules: the active modules, which have the definitions.

    Returns:
        A cause of kind `definition` for each such predicate, and for each that its definition reads and that
        makes it what it is; its shortfalls are the measured values. Each is explained once.
    """
    definitions = {name: one for ecm in modules.values() for name, one in ecm.definitions.items()}
    found: dict[str, Cause] = {}
    pending = list(parts)
    while pending:
        part = pending.pop(0)
        definition = definitions.get(part.quantity)
        if definition is None or part.quantity in found:
            continue
        # Of a predicate that is true and should not be, the parts that make it true.
        term = t.Not(definition.term) if part.value is True else definition.term
        unmet = world.unmet_parts(term)
        if part.value is None and definition.margin and t.variables_of(term).keys() <= world.known.keys():
            unmet = tuple(_uncertain_parts(world, definition, modules))
        place = file_and_line(definition.span)
        found[part.quantity] = Cause(
            "definition", part.quantity, definition.text, location=place, shortfalls=unmet
        )
        pending += unmet
    return tuple(found.values())


def unmet_with_definitions(
    world: WorldModel, condition: t.Term, modules: Mapping[str, Ecm]
) -> tuple[str, tuple[Cause, ...]]:
    """Explain why a condition is not measured as true.

    Args:
        world: the measured world.
        condition: boolean term.
        modules: the active modules, which have the definitions.

    Returns:
        The reason in words, with the values behind predicates by definition; and these as data.
    """
    behind = definition_causes(world, world.unmet_parts(condition), modules)
    why = "; ".join([world.unmet_reason(condition), *(f"by definition of {cause}" for cause in behind)])
    return why, behind


def _uncertain_parts(
    world: WorldModel, definition: Definition, modules: Mapping[str, Ecm]
) -> Iterator[UnmetBound]:
    """Yield the values whose uncertainty leaves a predicate with a margin unknown."""
    declared = {name: one for ecm in modules.values() for name, one in ecm.state.items()}
    for name in t.variables_of(definition.term):
        one = declared.get(name)
        if one is not None and one.uncertainty:
            reason = (
                f"is {_quantity(world.known[name], one)}, too near to a bound for the margin of "
                f"{float(definition.margin):g} times its uncertainty, {_quantity(one.uncertainty, one)}"
            )
            yield UnmetBound(name, None, "known", True, reason=reason)


def _quantity(value: Any, declared: Declared) -> str:
    if isinstance(value, tuple):
        return f"({', '.join(_quantity(part, declared) for part in value)})"
    return format_quantity(value, declared.unit)
