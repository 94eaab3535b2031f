"""Things in the agent's world: their kinds, where they are, and what they are on, in or held by.

The values come from the world model only, so a thing is known no better than the variables that describe it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from aeros.agent.world.values import to_json_value
from aeros.agent.world.world import WorldModel
from aeros.spec.expr import terms as t
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.perception import Thing


@dataclass(frozen=True, slots=True)
class ThingState:
    """Knowledge of a thing at one time.

    Attributes:
        name: full name, as in `clean_table.sponge`.
        kind: its kind; None if it is unknown.
        position: position in W, m; None if it is unknown or not measured.
        count: number of such things; None if it is unknown or not counted.
        measured_by: full names of the variables that have the position and the count that are known, by
            `position` and `count`.
        held: whether the robot holds it; None if it is unknown.
        relations: whether each relation holds, as `on tray`; without those that are unknown.
        derived_from: full names of the variables that each attribute follows from, those that its condition
            reads included, by `position`, `count`, `held` and the names of `relations`.
    """

    name: str
    kind: str | None
    position: tuple[float, ...] | None = None
    count: int | None = None
    measured_by: Mapping[str, str] = field(default_factory=dict)
    held: bool | None = None
    relations: Mapping[str, bool] = field(default_factory=dict)
    derived_from: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @property
    def is_known(self) -> bool:
        """True if more than its kind is known."""
        return bool(self.relations) or any(one is not None for one in (self.position, self.count, self.held))

    def to_json(self) -> dict[str, Any]:
        """Return it as JSON values.

        Returns:
            The known attributes by name, without those that are absent.
        """
        values = {
            "kind": self.kind,
            "position": None if self.position is None else list(self.position),
            "count": self.count,
            "held": self.held,
            "relations": dict(self.relations) or None,
        }
        return {name: value for name, value in values.items() if value is not None}


def things_of(world: WorldModel, modules: Iterable[Ecm]) -> Iterator[ThingState]:
    """Say what is known of the things that modules declare.

    Args:
        world: the world.
        modules: the modules.

    Yields:
        Each thing of which more than its kind is known.
    """
    for module in modules:
        for thing in module.things.values():
            state = _state_of(thing, world)
            if state.is_known:
                yield state


def _state_of(thing: Thing, world: WorldModel) -> ThingState:
    names = {"position": thing.position, "count": thing.count}
    measured_by = {one: name for one, name in names.items() if name is not None and name in world.known}
    values = {one: to_json_value(world.known[name]) for one, name in measured_by.items()}
    kind: str | None = thing.kind
    kind_names = () if thing.kind_from is None else (thing.kind_from,)
    if thing.kind_from is not None:
        kind = to_json_value(world.known.get(thing.kind_from))
    relations = {name: world.evaluate(term) for name, term in thing.relations.items()}
    conditions = dict(thing.relations) if thing.held is None else {"held": thing.held, **thing.relations}
    read = {one: {name} for one, name in measured_by.items()}
    read |= {one: set(t.variables_of(term)) for one, term in conditions.items()}
    return ThingState(
        name=thing.name,
        kind=kind,
        position=tuple(values["position"]) if "position" in values else None,
        count=int(values["count"]) if "count" in values else None,
        measured_by=measured_by,
        held=None if thing.held is None else world.evaluate(thing.held),
        relations={name: holds for name, holds in relations.items() if holds is not None},
        derived_from={one: tuple(sorted({*names, *kind_names})) for one, names in read.items()},
    )
