"""Run a module's perceivers once on the pictures of a simulated scene, as `aeros run` runs them.

The pictures come from the plant's own cameras, with the errors that the site declares, and the values from
`PerceivingPlant`: the same workers, limits and checks as in a run. Only the plant's truth is added.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any, Final, NamedTuple

from aeros.runtime.execution.governor import FixedGovernor
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.perception.perceiver_run import OpenPerceiver, Perceived, PerceiverRun, ViewInput
from aeros.runtime.perception.perceiving_plant import PerceivingPlant
from aeros.runtime.ports import CameraPicture, MotionCompletion, Plant, Reading, Readings, newest_pictures
from aeros.sim.referee import truth_by_variable, truth_of
from aeros.skill import act
from aeros.spec.expr import terms as t
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.perception import Definition, Perceiver
from aeros.spec.model.site import Site
from aeros.spec.model.task_parameters import arguments_in_force
from aeros.spec.model.variables import Declared

_TRIES: Final = 5
"""Pictures that are taken until one arrives: a camera with dropouts loses some."""

_WAIT_S: Final = 10.0
"""Plant time in which a camera delivers its picture at the latest, s."""


@dataclass(frozen=True)
class SeenValue:
    """One variable of the module after the look.

    Attributes:
        declared: its declaration.
        value: its value (SI); None if it is unknown.
        uncertainty: standard uncertainty that the perceiver gave (SI); None if it gave none.
        time: plant time of the value, s; None if it is unknown.
        reason: why it is unknown; empty if it is known.
        truth: its truth in the simulator; None if the scene does not define it.
    """

    declared: Declared
    value: Any
    uncertainty: Any
    time: float | None
    reason: str
    truth: int | None

    @property
    def is_false(self) -> bool:
        """True if the value is known and the simulator's truth is another."""
        return self.value is not None and self.truth is not None and self.value != self.truth


class PerceiverLook(NamedTuple):
    """One perceiver's look.

    Attributes:
        perceiver: the perceiver.
        fault: why it gave no values; empty if it gave some.
        seconds: real time of its call, s.
        values: each variable that it provides.
        is_left_out: True if it was not called because its camera was not chosen.
    """

    perceiver: Perceiver
    fault: str
    seconds: float
    values: tuple[SeenValue, ...]
    is_left_out: bool = False


class DefinedValue(NamedTuple):
    """A predicate by definition after the look.

    Attributes:
        seen: its value and truth.
        text: the definition.
        parts: the readings that the definition reads, by full name; unknown ones are absent.
        missing: full names of those that are unknown.
    """

    seen: SeenValue
    text: str
    parts: Mapping[str, Reading]
    missing: tuple[str, ...]


class Look(NamedTuple):
    """Everything that one look at a scene showed.

    Attributes:
        site: the site with the variables of all modules.
        time: plant time at the end, s.
        pictures: the pictures, by camera.
        perceivers: each perceiver of the module.
        definitions: each predicate that the module defines.
    """

    site: Site
    time: float
    pictures: Mapping[str, CameraPicture]
    perceivers: tuple[PerceiverLook, ...]
    definitions: tuple[DefinedValue, ...]

    @property
    def is_right(self) -> bool:
        """True if every perceiver that was not left out gave values, and none differs from the truth."""
        every = [one for look in self.perceivers for one in look.values]
        every += [one.seen for one in self.definitions]
        has_failed = any(look.fault and not look.is_left_out for look in self.perceivers)
        return not has_failed and not any(one.is_false for one in every)


def look(
    configuration: Configuration,
    module: str,
    plant: Plant,
    open_perceiver: OpenPerceiver,
    *,
    cameras: Collection[str] | None = None,
    stated: Mapping[str, Any],
) -> Look:
    """Take the pictures that a module's perceivers ask for, and let the perceivers look at them once.

    Args:
        configuration: the site and the modules.
        module: id of the module.
        plant: a simulator, just opened; the caller closes it.
        open_perceiver: opens runs of perceivers.
        cameras: the site's names of the cameras that take a picture; None for all that the perceivers of this
            module, and of those that it requires, ask for.
        stated: values (SI) of parameters of tasks, by full name; the others have their defaults.

    Returns:
        The values, beside the truth.
    """
    notes = _Notes(open_perceiver)
    watched = PerceivingPlant(plant, FixedGovernor(configuration), notes.open, notes.record)
    watched.attend(frozenset({module}))
    watched.set_parameters(stated)
    asked = dict.fromkeys(one for ecm in configuration.modules.values() for one in _asked_cameras(ecm))
    lost = {}
    try:
        if any(one.rate is not None for one in configuration.modules[module].perceivers.values()):
            watched.observe()  # from here on readings are sampled
        for camera in asked if cameras is None else cameras:
            fault = _take_picture(watched, camera)
            if fault:
                lost[camera] = fault
        readings = watched.observe()
    finally:
        watched.close_perceivers()
    ecm = configuration.modules[module]
    arguments = arguments_in_force(configuration.modules.values(), stated)
    truth = truth_by_variable(truth_of(plant), module, arguments)
    pictures = newest_pictures(plant)

    def seen(name: str, uncertainty: Any, reason: str) -> SeenValue:
        reading = readings.get(name)
        if reading is None:
            return SeenValue(ecm.state[name], None, uncertainty, None, reason, truth.get(name))
        return SeenValue(ecm.state[name], reading.value, uncertainty, reading.time, "", truth.get(name))

    perceivers = []
    for perceiver in ecm.perceivers.values():
        key = (module, perceiver.id)
        fault = notes.faults.get(key, "")
        is_left_out = False
        if key not in notes.answers and not fault:
            fault = _reason_not_called(perceiver, pictures, lost)
            is_left_out = cameras is not None and not any(one.camera in cameras for one in perceiver.pictures)
        answer = notes.answers.get(key, {})
        values = []
        for name in perceiver.provides:
            given = answer.get(name.partition(".")[2])
            uncertainty = None if given is None else given.uncertainty
            reason = "" if fault else "not given" if given is None else "less certain than declared"
            values.append(seen(name, uncertainty, reason))
        seconds = notes.seconds.get(key, 0.0)
        perceivers.append(PerceiverLook(perceiver, fault, seconds, tuple(values), is_left_out))
    definitions = tuple(
        _defined(seen(name, None, _unknown_reason(one, readings)), one.text, one.term, readings)
        for name, one in ecm.definitions.items()
    )
    return Look(configuration.site, plant.now(), pictures, tuple(perceivers), definitions)


def _unknown_reason(definition: Definition, readings: Readings) -> str:
    """Say why a predicate has no value, should it have none."""
    if definition.margin and t.variables_of(definition.term).keys() <= readings.keys():
        return (
            f"nearer to a bound than its margin, {float(definition.margin):g} times the declared uncertainty"
        )
    return "a reading is unknown or old"


@dataclass
class _Notes:
    """Answers of perceivers before they are checked, and failures of perceivers.

    Attributes:
        opener: opens runs of perceivers.
        answers: the latest answer by module and perceiver.
        faults: the latest failure by module and perceiver.
        seconds: real time of the latest call by module and perceiver, s.
    """

    opener: OpenPerceiver
    answers: dict[tuple[str, str], Perceived] = field(default_factory=dict)
    faults: dict[tuple[str, str], str] = field(default_factory=dict)
    seconds: dict[tuple[str, str], float] = field(default_factory=dict)

    def open(self, site: Site, ecm: Ecm, perceiver: Perceiver) -> PerceiverRun:
        return _NotedRun(self.opener(site, ecm, perceiver), self, (ecm.id, perceiver.id))

    def record(self, event: str, details: Mapping[str, Any]) -> None:
        if event == "perceiver-failed":
            self.faults[(details["module"], details["perceiver"])] = details["reason"]


class _NotedRun:
    """A run of a perceiver whose answers are noted."""

    def __init__(self, run: PerceiverRun, notes: _Notes, key: tuple[str, str]) -> None:
        self._run, self._notes, self._key = run, notes, key

    def perceive(self, view: ViewInput, seconds: float) -> Perceived:
        began = perf_counter()
        try:
            answer = self._run.perceive(view, seconds)
        finally:
            self._notes.seconds[self._key] = perf_counter() - began
        self._notes.answers[self._key] = answer
        return answer

    def close(self) -> None:
        self._run.close()


def _asked_cameras(ecm: Ecm) -> list[str]:
    return [asked.camera for one in ecm.perceivers.values() for asked in one.pictures]


def _take_picture(plant: Plant, camera: str) -> str:
    """Take a picture; return why there is none, or an empty text."""
    for _ in range(_TRIES):
        began = plant.now()
        motion = plant.begin(act("look", camera=camera))
        if isinstance(motion, MotionCompletion):
            return motion.reason or "the plant refuses"
        ended: Mapping[Any, MotionCompletion] = {}
        while motion not in ended and plant.now() < began + _WAIT_S:
            ended = plant.advance(lambda now, values: None, began + _WAIT_S)
        end = ended.get(motion)
        if end is not None and not end.completed:
            return end.reason or "the plant ended the action"
        picture = newest_pictures(plant).get(camera)
        if picture is not None and picture.time >= began:
            return ""
    return f"the camera lost {_TRIES} pictures"


def _reason_not_called(
    perceiver: Perceiver, pictures: Mapping[str, CameraPicture], lost: Mapping[str, str]
) -> str:
    missing = [one for one in perceiver.pictures if one.camera not in pictures]
    named = (f"`{one.camera}`" + (f" ({lost[one.camera]})" if one.camera in lost else "") for one in missing)
    return f"not called: no picture of {', '.join(named)}" if missing else "not called"


def _defined(seen: SeenValue, text: str, term: t.Term, readings: Readings) -> DefinedValue:
    names = sorted(t.variables_of(term))
    parts = {name: readings[name] for name in names if name in readings}
    return DefinedValue(seen, text, parts, tuple(name for name in names if name not in readings))
