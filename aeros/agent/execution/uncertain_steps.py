"""What is not begun again while it may have happened already.

A step that was begun, and whose success nobody can exclude, is barred: for whatever planner proposes it,
until what is measured excludes each of its successes.  Unknown excludes nothing.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import Any

from aeros.agent.world.values import to_json_value
from aeros.agent.world.world import WorldModel
from aeros.spec.model.model import Skill


class UncertainSteps:
    """The barred steps of one run, by module, skill and inputs."""

    def __init__(self) -> None:
        self._barred: set[str] = set()

    @property
    def to_checkpoint(self) -> tuple[str, ...]:
        """What is barred, as a checkpoint holds it."""
        return tuple(sorted(self._barred))

    def restore(self, saved: Iterable[str]) -> None:
        """Bar what an earlier session had barred."""
        self._barred.update(saved)

    def add(self, module: str, skill: str, inputs: Mapping[str, Any]) -> None:
        """From now on it is begun only where it has measurably not succeeded."""
        self._barred.add(_key(module, skill, inputs))

    def reason_not_to_start(
        self, module: str, skill: Skill, inputs: Mapping[str, Any], world: WorldModel
    ) -> str | None:
        """Why it may not be begun in `world`; None where it may."""
        if not self._barred or _key(module, skill.id, inputs) not in self._barred:
            return None
        possible = possible_success(skill, world)
        if possible is None:
            return None
        return (
            f"it was begun before a crash, and what is measured does not exclude that `{possible}` happened"
        )


def possible_success(skill: Skill, world: WorldModel) -> str | None:
    """A success of `skill` that may be what happened, for all that is measured; None where there is none."""
    for outcome in skill.success_outcomes:
        if all(world.known.get(name, value) == value for name, value in outcome.effects.items()):
            return outcome.id
    return None


def _key(module: str, skill: str, inputs: Mapping[str, Any]) -> str:
    return json.dumps(
        [module, skill, {name: to_json_value(value) for name, value in inputs.items()}], sort_keys=True
    )
