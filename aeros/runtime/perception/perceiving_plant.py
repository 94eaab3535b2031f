"""Plant wrapper that measures with the perceivers and definitions of active modules, too.

Perceivers run in `observe`, never inside `advance`: no control tick waits for one. On a simulator the clock
stands still meanwhile, so that the same run gives the same values. On a plant that runs in real time they
run only while nothing is under way; until then their values age. Each `observe` evaluates the definitions.

Where the site looks for obstacles, the runtime itself looks at every new picture, after the perceivers: no
module provides that reading, and none can take it away.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any, Final

from aeros.runtime.execution.governor import Governor
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.perception.active_definition import ActiveDefinition
from aeros.runtime.perception.active_perceiver import ActivePerceiver
from aeros.runtime.perception.needed_modules import needed_modules
from aeros.runtime.perception.obstacle_watch import ObstacleWatch
from aeros.runtime.perception.perceiver_run import OpenPerceiver
from aeros.runtime.ports import (
    CameraPicture,
    Monitor,
    MotionCompletion,
    MotionHandle,
    Obstacle,
    PlannedMotion,
    Plant,
    Reading,
    Readings,
    announce_parameters,
    announce_stop,
    plan_sequence,
)
from aeros.runtime.records.failed_measurements import RecordEvent
from aeros.skill import Action
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.expr.doubles import to_doubles
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.perception import Perceiver
from aeros.spec.model.site import Site
from aeros.spec.model.task_parameters import parameters_behind_variables

SIMULATED_TIMEOUT_S: Final = 5.0
"""Minimum timeout of a perceiver in simulation, s of real time.

A simulator's clock stands still while a perceiver computes, so a run must not depend on how busy the
machine is.
"""

_PerceiverKey = tuple[str, ...]


class PerceivingPlant:
    """Plant that behaves as `plant` and measures what the modules in force perceive or define, too.

    A plant that measures itself what a module perceives or defines, as the symbolic one, is believed: the
    module's perceivers do not run, and its definitions are not evaluated. Nor are those of modules that the
    agent does not attend to. The parameters of tasks are readings, too: as the instruction says them, or else
    their defaults.

    Args:
        plant: the wrapped plant; closed with this one.
        governor: returns the configuration in force.
        open_perceiver: opens runs of perceivers.
        record: writes events of perceivers into the audit record.
        attends_to_all: True to run all perceivers, whatever the agent attends to.
    """

    def __init__(
        self,
        plant: Plant,
        governor: Governor,
        open_perceiver: OpenPerceiver,
        record: RecordEvent,
        *,
        attends_to_all: bool = False,
    ) -> None:
        self._plant = plant
        self._governor = governor
        self._open, self._record = open_perceiver, record
        self._generation: int | None = None
        self._attended: frozenset[str] | None = None
        self._attends_to_all = attends_to_all
        self._stated: dict[str, Any] = {}
        self._parameters: dict[str, Any] = {}
        self._memories: Mapping[str, Mapping[str, Any]] = {}
        self._perceivers: dict[_PerceiverKey, ActivePerceiver] = {}
        self._active: list[ActivePerceiver] = []
        self._definitions: dict[str, ActiveDefinition] = {}
        self._defined: dict[str, Reading] = {}
        self._in_invariants: frozenset[str] = frozenset()
        self._obstacle_watch = ObstacleWatch(plant, record)
        self._is_advancing = False
        self._under_way: set[MotionHandle] = set()
        self._perceived, self._modelled = set[str](), set[str]()
        # A plant stays what it is, and a hosted one would be asked over its socket.
        self.runs_in_real_time = bool(getattr(plant, "runs_in_real_time", False))

    def now(self) -> float:
        """Implements `Plant.now`."""
        return self._plant.now()

    def observe(self) -> Readings:
        """Implements `Plant.observe`: calls perceivers for which there is something new."""
        readings = self._plant.observe()
        if not self._is_advancing and not (self.runs_in_real_time and self._under_way):
            self._follow_configuration()
            self._obstacle_watch.note_posture(readings)
            if found := {_module_of(name) for name in self._perceived if name in readings}:
                self._modelled |= found
                self._perceived = {name for name in self._perceived if _module_of(name) not in found}
                self._leave_out_modelled()
            self._update(readings)
            self._obstacle_watch.look(readings, self._values())
        self._evaluate_definitions(readings)
        values, now = self._values(), self._plant.now()
        if not values and _states(readings, self._parameters, now):
            return readings
        return {**readings, **values, **self._parameter_readings()}

    def attend(self, modules: frozenset[str] | None) -> None:
        """Say whose values matter. Other perceivers end, and their values and definitions are unknown.

        Args:
            modules: ids of modules; `needed_modules` says what they need. None for all.
        """
        if modules != self._attended and not self._attends_to_all:
            self._attended, self._generation = modules, None

    def set_parameters(self, values: Mapping[str, Any]) -> None:
        """Say what the instruction says; the others have their defaults.

        Whatever depends on a parameter that changes is unknown until it is measured anew: its perceivers
        begin again.

        Args:
            values: values (SI) of parameters of tasks, by full name.
        """
        if dict(values) != self._stated:
            self._stated, self._generation = dict(values), None
            announce_parameters(self._plant, values)

    def set_memories(self, memories: Mapping[str, Mapping[str, Any]]) -> None:
        """Say what the agent remembers, for the perceivers that ask for it.

        Args:
            memories: a table for each module by its id.
        """
        self._memories = memories

    def pictures(self) -> Mapping[str, CameraPicture]:
        """Return the newest pictures of the plant; see `newest_pictures`.

        Returns:
            The pictures by camera, with the cameras where a picture shows them to be; empty if it has none.
        """
        return self._obstacle_watch.pictures()

    def obstacles(self) -> tuple[Obstacle, ...]:
        """Return what the pictures show and nobody declared, as of the latest `observe`.

        Returns:
            The obstacles, oldest first.
        """
        return self._obstacle_watch.obstacles()

    def plan(self, action: Action) -> PlannedMotion:
        """Implements `Plant.plan`."""
        plan = self._plant.plan(action)
        self._obstacle_watch.note_plan(plan)
        return plan

    def plan_sequence(self, actions: Sequence[Action]) -> Sequence[PlannedMotion] | None:
        """Plan actions one after the other; see `ports.plan_sequence`.

        Args:
            actions: the actions.

        Returns:
            A plan for each; None if the plant cannot plan ahead.
        """
        return plan_sequence(self._plant, actions)

    def begin(self, action: Action, decided: PlannedMotion | None = None) -> MotionHandle | MotionCompletion:
        """Implements `Plant.begin`."""
        motion = self._plant.begin(action, decided)
        if not isinstance(motion, MotionCompletion):
            self._under_way.add(motion)
        return motion

    def advance(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        """Implements `Plant.advance`; the monitor sees the values that the site lets its invariants read."""
        watched = [one for one in self._active if one.needs_sampling]
        shown = {name: one for name, one in self._values().items() if name in self._in_invariants}
        if watched or shown:
            monitor = _PerceivingMonitor(monitor, self._plant, watched, shown)
        monitor = self._obstacle_watch.noting_postures(monitor)
        self._is_advancing = True
        try:
            ended = self._plant.advance(monitor, until)
        finally:
            self._is_advancing = False
        self._under_way.difference_update(ended)
        return ended

    def halt(self, motion: MotionHandle) -> None:
        """Implements `Plant.halt`."""
        self._plant.halt(motion)

    def stop(self) -> None:
        """Implements `Plant.stop`."""
        self._plant.stop()
        self._under_way.clear()

    def skill_began(self, skill: str) -> None:
        """Implements `Plant.skill_began`."""
        self._plant.skill_began(skill)

    def skill_ended(self, skill: str, *, finished: bool) -> None:
        """Implements `Plant.skill_ended`."""
        self._plant.skill_ended(skill, finished=finished)

    def close(self) -> None:
        """Implements `Plant.close`: ends the perceivers first."""
        self.close_perceivers()
        self._plant.close()

    def close_perceivers(self) -> None:
        """End every perceiver; their values are unknown until the next `observe`. Safe to call twice."""
        for perceiver in self._perceivers.values():
            perceiver.close()
        self._perceivers, self._active, self._generation = {}, [], None

    def _update(self, readings: Readings) -> None:
        if not self._active:
            return
        now = self._plant.now()
        pictures = self.pictures() if any(one.needs_pictures for one in self._active) else {}
        least_timeout = 0.0 if self.runs_in_real_time else SIMULATED_TIMEOUT_S
        for perceiver in self._active:
            # What one perceiver of a module has just measured, a later one may read.
            known = {**readings, **self._values(), **self._parameter_readings()}
            perceiver.update(now, known, pictures, least_timeout)

    def _evaluate_definitions(self, readings: Readings) -> None:
        self._defined = {}
        if self._definitions:
            known = {**readings, **self._values(), **self._parameter_readings()}
            self._defined = _values_by_definition(dict(self._definitions), known, self._plant.now())

    def _follow_configuration(self) -> None:
        if self._governor.generation == self._generation:
            return
        definitions: dict[str, ActiveDefinition] = {}
        parameters: dict[str, Any] = {}
        found: dict[_PerceiverKey, ActivePerceiver] = {}
        provided: set[str] = set()
        # Without a configuration nothing is measured: what needs it is denied.
        with suppress(UserError):
            self._generation, configuration = self._governor.configuration()
            site = configuration.site
            self._obstacle_watch.set_configuration(configuration)
            self._in_invariants = site.perception.in_invariants
            needed = needed_modules(configuration, self._attended)
            parameters = _values_of_parameters(configuration, self._stated)
            behind = parameters_behind_variables(configuration.modules.values())
            for ecm in (one for name, one in configuration.modules.items() if name in needed):
                for name, definition in ecm.definitions.items():
                    definitions[name] = ActiveDefinition(definition, site)
                for perceiver in ecm.perceivers.values():
                    provided.update(perceiver.provides)
                    depends = frozenset[str]().union(*(behind.get(one, ()) for one in perceiver.provides))
                    values = {one: parameters.get(one) for one in sorted(depends)}
                    key = _perceiver_key(site, ecm, perceiver, values)
                    running = self._perceivers.pop(key) if key in self._perceivers else None
                    found[key] = (
                        ActivePerceiver(
                            site, ecm, perceiver, self._open, self._record, lambda: self._memories
                        )
                        if running is None
                        else running
                    )
        for ended in self._perceivers.values():
            ended.close()
        self._perceivers, self._definitions, self._parameters = found, definitions, parameters
        self._perceived = {*definitions, *provided}
        self._leave_out_modelled()

    def _leave_out_modelled(self) -> None:
        """Choose what is measured here: nothing of a module that the plant models."""
        self._active = [one for key, one in self._perceivers.items() if key[0] not in self._modelled]
        self._definitions = {
            name: one for name, one in self._definitions.items() if _module_of(name) not in self._modelled
        }

    def _parameter_readings(self) -> dict[str, Reading]:
        now = self._plant.now()
        return {name: Reading(value, now) for name, value in self._parameters.items()}

    def _values(self) -> dict[str, Reading]:
        perceived = {name: value for one in self._active for name, value in one.values.items()}
        return {**perceived, **self._defined} if self._defined else perceived


def _states(readings: Readings, values: Mapping[str, Any], now: float) -> bool:
    """Check if these values are among the readings that a plant makes now, of the same type.

    Then nothing is to be added, and a `Snapshot` stays one: the gate decides on it in less time.
    """
    for name, value in values.items():
        found = readings.get(name)
        if found is None or found.time != now or type(found.value) is not type(value) or found.value != value:
            return False
    return True


def _module_of(name: str) -> str:
    """Return the module of a variable."""
    return name.partition(".")[0]


def _values_by_definition(
    pending: dict[str, ActiveDefinition], known: dict[str, Reading], now: float
) -> dict[str, Reading]:
    """Evaluate definitions as long as there is something new: one may read another, of a later module."""
    defined: dict[str, Reading] = {}
    is_new = True
    while pending and is_new:
        is_new = False
        for name, definition in list(pending.items()):
            value = definition.evaluate(known, now)
            if value is not None:
                known[name] = defined[name] = value
                del pending[name]
                is_new = True
    return defined


def _perceiver_key(site: Site, ecm: Ecm, perceiver: Perceiver, values: Mapping[str, Any]) -> _PerceiverKey:
    """Return all that a running perceiver depends on; the module's id is first."""
    bound = (part for one in sorted(ecm.configuration.items()) for part in one)
    digests = (ecm.code_digest, ecm.manifest_digest, site.digest)
    stated = (f"{name}={value!r}" for name, value in values.items())
    return (ecm.id, perceiver.id, *digests, *bound, *stated)


def _values_of_parameters(configuration: Configuration, stated: Mapping[str, Any]) -> dict[str, Any]:
    """Return the value of each parameter that has one, by full name: as stated, or else its default."""
    defaults = {
        name: one.default
        for ecm in configuration.modules.values()
        for name, one in ecm.task_parameters.items()
        if one.default is not None or name in stated
    }
    return to_doubles({name: stated.get(name, default) for name, default in defaults.items()})


class _PerceivingMonitor:
    """A monitor that sees what was perceived, and samples readings for perceivers after it has answered."""

    def __init__(
        self,
        monitor: Monitor,
        plant: Plant,
        watched: list[ActivePerceiver],
        shown: Mapping[str, Reading],
    ) -> None:
        self._monitor, self._plant = monitor, plant
        self._watched, self._shown = watched, shown

    def __call__(self, now: float, measured: Mapping[str, Any]) -> str | None:
        answer = self._monitor(now, {**measured, **self._shown} if self._shown else measured)
        for perceiver in self._watched:
            perceiver.sample(now, measured, self._plant.observe)
        return answer

    def begin_stop(self, reason: str, now: float) -> None:
        announce_stop(self._monitor, reason, now)
