"""Memory of things: for each thing and kind, where it was, what it was on or in, and when that was seen.

Each attribute is a sighting of its own, so each has its own age, and a can that is looked for now does not
inherit the place of the bottle that was looked for before.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Final

from aeros.agent.memory.sightings import RememberedValue, Sighting, sighting_of_variable
from aeros.agent.world.things import ThingState
from aeros.agent.world.world import WorldModel
from aeros.spec.model.variables import Declared

THING: Final = "thing "
"""Begins the name under which an attribute of a thing is remembered; no variable has such a name."""


@dataclass(frozen=True, slots=True)
class RememberedThing:
    """Memory of a thing of one kind on one plant.

    Attributes:
        name: full name, as in `clean_table.sponge`.
        kind: its kind.
        attributes: memory of its `position` (m), its `count`, whether it was `held`, and whether each
            relation held, as `on tray`; without those that were never known.
    """

    name: str
    kind: str
    attributes: Mapping[str, RememberedValue]


def sightings_of_things(
    things: Iterable[ThingState], world: WorldModel, state: Mapping[str, Declared]
) -> Iterator[Sighting]:
    """List what is known of things.

    Args:
        things: the things.
        world: the world that they are in.
        state: declared state variables by name.

    Yields:
        Each known attribute of each thing whose kind is known.
    """
    for thing in things:
        if thing.kind is None:
            continue
        prefix = f"{THING}{thing.name} {thing.kind} "
        for attribute, variable in thing.measured_by.items():
            yield replace(
                sighting_of_variable(variable, world, state),
                variable=prefix + attribute,
                derived_from=thing.derived_from[attribute],
            )
        truths = dict(thing.relations) if thing.held is None else {"held": thing.held, **thing.relations}
        for attribute, holds in truths.items():
            module, origin = thing.name.partition(".")[0], thing.derived_from[attribute]
            yield Sighting(prefix + attribute, holds, world.time, module, None, origin)


def remembered_things(remembered: Iterable[RememberedValue]) -> list[RememberedThing]:
    """Collect the things from the memory of all names.

    Args:
        remembered: memory of variables, obstacles and things.

    Returns:
        The things, by name and kind.
    """
    attributes: dict[tuple[str, str], dict[str, RememberedValue]] = {}
    for one in remembered:
        if one.variable.startswith(THING):
            name, kind, attribute = one.variable.removeprefix(THING).split(" ", 2)
            attributes.setdefault((name, kind), {})[attribute] = one
    return [RememberedThing(name, kind, found) for (name, kind), found in sorted(attributes.items())]
