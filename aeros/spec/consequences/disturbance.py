"""Readings that a skill may move, and the predicates whose definitions read them.

A site says by `moved_by` for a sensor: what it measures changes only while one of these actuators moves. So a
skill moves a reading if an action kind of its envelope moves one of them. What no such entry covers, as the
distance of people, may change in any skill. What a tool answers changes in skills that may call the tool.

Everything else changes by declared effects alone, as in all proofs: truth values, members of enums, whole
numbers, and what perceivers measure. The site says what moves the robot; of objects, only a manifest says
what its skills do to them, and a definition by their places is no less certain than a predicate that a
perceiver provides.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping

from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BoolType, EnumType, IntegerType
from aeros.spec.model.ecm import Outcome, Skill
from aeros.spec.model.perception import Definition
from aeros.spec.model.site import Site

Definitions = Mapping[str, Definition]
_Selection = Callable[[Iterable[str]], Iterable[str]]


def readings_behind(name: str, definitions: Definitions) -> dict[str, t.Variable]:
    """Collect what a predicate follows from, through all definitions on the way.

    Args:
        name: full name of a predicate that has a definition.
        definitions: definitions by full name.

    Returns:
        The variables that its definition reads, at any depth, by name; those with a definition included.
    """
    found: dict[str, t.Variable] = {}
    pending = [name]
    while pending:
        for read, variable in t.variables_of(definitions[pending.pop()].term).items():
            if read not in found:
                found[read] = variable
                pending += [read] if read in definitions else []
    return found


def is_moved(reading: str, skill: Skill, site: Site) -> bool:
    """Tell whether the actions that a skill may ask for may change a reading.

    Args:
        reading: name of a state variable.
        skill: the skill.
        site: the site, with the variables of modules.

    Returns:
        False only if site and manifest exclude it.
    """
    declared = site.state.get(reading)
    if declared is None:
        return True
    answering = {
        name for name, kind in site.kinds.items() if kind.tool is not None and reading in kind.tool.answers
    }
    if answering:
        return not answering.isdisjoint(skill.envelope)
    if isinstance(declared.variable.type, BoolType | EnumType | IntegerType):
        return False
    if declared.sensor not in site.sensor_names:
        return False  # a perceiver measures it
    movers = site.moved_by.get(declared.sensor)
    if movers is None:
        return True
    return any(not movers.isdisjoint(site.kinds[kind].actuators) for kind in skill.envelope)


def disturbed_by_actions(skill: Skill, definitions: Definitions, site: Site) -> dict[str, str]:
    """Find the predicates that the actions of a skill may change.

    Args:
        skill: the skill.
        definitions: definitions by full name.
        site: the site, with the variables of modules.

    Returns:
        For each such predicate, in words, a reading that the skill may move and that the predicate follows
        from.
    """
    found = _disturbed(definitions, lambda readings: (one for one in readings if is_moved(one, skill, site)))
    return {name: _described(reading, site) for name, reading in found}


def _described(reading: str, site: Site) -> str:
    """Name a reading, and its sensor if the site does not say what moves that."""
    sensor = site.state[reading].sensor if reading in site.state else None
    if sensor is None or sensor in site.moved_by or sensor not in site.sensor_names:
        return f"`{reading}`"
    return f"`{reading}` (`moved_by` of the site has no entry for `{sensor}`, which measures it)"


def disturbed_by_effects(outcome: Outcome, definitions: Definitions) -> dict[str, str]:
    """Find the predicates that follow from something that an outcome sets, counts or leaves in a range.

    Args:
        outcome: the outcome.
        definitions: definitions by full name.

    Returns:
        For each such predicate, in words, a variable that the outcome changes and that it follows from.
    """
    changed = {*outcome.effects, *(one.variable for one in outcome.ranges)}
    return disturbed_by_changes(changed, definitions)


def disturbed_by_changes(changed: Iterable[str], definitions: Definitions) -> dict[str, str]:
    """Find the predicates that follow from variables that change.

    Args:
        changed: names of the variables.
        definitions: definitions by full name.

    Returns:
        For each such predicate, in words, one of these variables that it follows from.
    """
    names = frozenset(changed)
    found = _disturbed(definitions, lambda readings: (one for one in readings if one in names))
    return {name: f"`{reading}`" for name, reading in found}


def _disturbed(definitions: Definitions, changed_of: _Selection) -> Iterator[tuple[str, str]]:
    for name in definitions:
        reading = next(iter(changed_of(readings_behind(name, definitions))), None)
        if reading is not None:
            yield name, reading
