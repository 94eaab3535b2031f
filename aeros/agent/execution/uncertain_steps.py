"""Steps that must not start again while they may already have succeeded.

A step that was started, and whose success the measurements do not exclude, is barred for every planner until
they exclude each of its successes. An unknown value excludes nothing.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import Any

from aeros.agent.execution.supervisor import is_excluded
from aeros.agent.world.values import to_json_value
from aeros.agent.world.world import WorldModel
from aeros.spec.model.ecm import Skill


class UncertainSteps:
    """Barred steps of one run, by module, skill and inputs."""

    def __init__(self) -> None:
        self._barred: set[str] = set()

    @property
    def to_checkpoint(self) -> tuple[str, ...]:
        """Barred steps as text for a checkpoint, sorted."""
        return tuple(sorted(self._barred))

    def restore(self, saved: Iterable[str]) -> None:
        """Bar the steps that an earlier session had barred.

        Args:
            saved: steps as `to_checkpoint` gives them.
        """
        self._barred.update(saved)

    def add(self, module: str, skill: str, inputs: Mapping[str, Any]) -> None:
        """Bar a step: it starts again only if measurements show that it has not succeeded.

        Args:
            module: id of the module.
            skill: id of the skill.
            inputs: inputs by name (SI).
        """
        self._barred.add(_key(module, skill, inputs))

    def reason_not_to_start(
        self, module: str, skill: Skill, inputs: Mapping[str, Any], world: WorldModel
    ) -> str | None:
        """Return the reason that a step must not start in `world`.

        Args:
            module: id of the module.
            skill: skill to start.
            inputs: inputs by name (SI).
            world: current state.

        Returns:
            The reason in words; None if the step may start.
        """
        if not self._barred or _key(module, skill.id, inputs) not in self._barred:
            return None
        possible = possible_success(skill, world)
        if possible is None:
            return None
        return f"it began before a crash, and the measurements do not exclude that `{possible}` happened"


def possible_success(skill: Skill, world: WorldModel, before: Mapping[str, Any] | None = None) -> str | None:
    """Find a success of `skill` that the measurements do not exclude.

    Args:
        skill: skill that may have run.
        world: current state.
        before: predicates measured before it began, as JSON values; None if unknown.

    Returns:
        The id of the outcome; None if all successes are excluded.
    """
    for outcome in skill.success_outcomes:
        if not is_excluded(outcome, world, before):
            return outcome.id
    return None


def _key(module: str, skill: str, inputs: Mapping[str, Any]) -> str:
    return json.dumps(
        [module, skill, {name: to_json_value(value) for name, value in inputs.items()}], sort_keys=True
    )
