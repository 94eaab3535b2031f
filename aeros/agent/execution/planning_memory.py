"""Memory for planners: the s of the planning function F(o, s) of the paper."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

from aeros.agent.memory.experience import ExperiencedModules
from aeros.agent.memory.sightings import sighting_of_free_space, sighting_of_obstacle, sightings_of
from aeros.agent.memory.store import Memory
from aeros.agent.memory.things import sightings_of_things
from aeros.agent.world.things import ThingState, things_of
from aeros.agent.world.world import WorldModel
from aeros.runtime.ports import Runtime
from aeros.spec.model.cause import Cause
from aeros.spec.model.ecm import Ecm


class PlanningMemory:
    """Memory as planners see it.

    Args:
        runtime: has the site, which declares the variables.
        memory: the agent's memory.
    """

    def __init__(self, runtime: Runtime, memory: Memory) -> None:
        self._runtime = runtime
        self._memory = memory
        self._obstacles: frozenset[str] = frozenset()

    def note(self, world: WorldModel) -> None:
        """Remember what is known in a world, with its things, and the obstacles of now.

        Args:
            world: the world.
        """
        self._note(world, self._things(world))

    def _note(self, world: WorldModel, things: Iterable[ThingState]) -> None:
        obstacles = self._runtime.obstacles()
        names = frozenset(one.name for one in obstacles)
        self._memory.note_sightings(
            (
                *sightings_of(world, self._runtime.site.state),
                *sightings_of_things(things, world, self._runtime.site.state),
                *map(sighting_of_obstacle, obstacles),
                *(sighting_of_free_space(name, world.time) for name in sorted(self._obstacles - names)),
            )
        )
        self._obstacles = names

    def view(self, world: WorldModel, failures: Sequence[Cause]) -> WorldModel:
        """Add memories to a world, for a planner.

        Args:
            world: the world as last measured, which is remembered, too.
            failures: causes of step failures since the previous plan.

        Returns:
            The world with the failures, its things, the last values seen of what is unknown in it, and what
            hindered each skill before.
        """
        things = tuple(self._things(world))
        self._note(world, things)
        remembered = {
            name: one.value for name, one in self._memory.remembered_values().items() if name in world.unknown
        }
        described = {one.name: one.to_json() for one in things}
        hindrances = {
            skill: [one._asdict() for one in found] for skill, found in self._memory.hindrances().items()
        }
        return replace(
            world, failures=tuple(failures), remembered=remembered, things=described, hindrances=hindrances
        )

    def _things(self, world: WorldModel) -> Iterator[ThingState]:
        return things_of(world, self._runtime.active_modules().values())

    def recall(self, modules: Mapping[str, Ecm]) -> Mapping[str, Ecm]:
        """Give modules the probabilities and durations that memory has learned.

        Args:
            modules: modules by id.

        Returns:
            The same modules; each is read from memory when it is asked for.
        """
        return ExperiencedModules(modules, self._memory.experience)
