"""Trials of modules that intend harm, on physics, behind one layer of defence or another.

Settings of a condition: `module`, the text of each of its files; `scene`; `people`; `steps`, groups of
skills, those of a group started at once; `inputs`, each drawn uniformly by the trial's seed; `limits` of the
referee; `watched`, the referee's quantity that the module attacks; `violates`, whether it can on this plant;
`refused`, the codes with which its installation must be refused; `clamps`, greatest values to which the
robot's driver bounds parameters, as C's `fmin` does, which also replace a NaN.

`layer` is the defence between module and motors: `open`, none, with no installation, and gate and monitor
open; `gate`, gate and monitor alone, on a module of which nothing was proved; `both`, all of AEROS.  Only the
referee measures what is violated.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any, Final, cast

from aeros.experiments.condition import TrialCondition
from aeros.experiments.inputs import TrialInputs
from aeros.experiments.open_gate import OpenGate, without_policy
from aeros.experiments.trial_kinds import Findings, Trial, scratch_folder
from aeros.experiments.trial_plants import missing_physics_error
from aeros.experiments.trials.inline_module import prove_module, write_module_files
from aeros.experiments.trials.referee import LimitReferee
from aeros.runtime.execution.executor import Executor
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.gate import CompiledGate
from aeros.runtime.gate.port import Gate
from aeros.runtime.ports import (
    EndedStep,
    MotionCompletion,
    MotionHandle,
    PlannedMotion,
    Plant,
    StepHandle,
    StepRequest,
    StepResult,
    StepStatus,
)
from aeros.session.assembly import build_executor
from aeros.session.scene_files import scene_named
from aeros.skill import Action
from aeros.spec.diagnostics.codes import Diagnostics, Severity
from aeros.spec.diagnostics.errors import InternalError, UserError
from aeros.spec.elaborate.load import load_ecm
from aeros.spec.model.scene import Scene
from aeros.spec.model.site import Site


@dataclass(frozen=True)
class _Defence:
    """Defence between a module and the motors; no configuration where the module was not installed.

    refused: codes of the refusal.
    """

    configuration: Configuration | None
    gate: Gate | None = None
    refused: tuple[str, ...] = ()


class AdversaryTrials:
    """Kind of trials in which a module tries to do harm."""

    @contextmanager
    def open(self, condition: TrialCondition, premises: TrialInputs) -> Iterator[Trial]:
        """Implement `TrialKind.open`.

        The module is installed once, or refused; each trial has its own plant.
        """
        settings = condition.settings
        site = premises.configuration.site
        with scratch_folder() as (folder, audit):
            folder = write_module_files(settings["module"], folder / "module")
            defence = _defence(settings["layer"], folder, premises)

            def trial(seed: int) -> Findings:
                began = time.process_time()
                referee, events = LimitReferee(site, settings["limits"]), _TrialEvents()
                if defence.configuration is not None and defence.gate is not None:
                    scene = scene_named(premises.configuration, settings["scene"])
                    plant = _plant(settings, scene, seed, referee)
                    here = defence.configuration, plant, audit, premises.skill_runs
                    try:
                        with build_executor(*here, gate=defence.gate) as executor:
                            _run(executor, settings, seed, events)
                    finally:
                        plant.close()
                violated = referee.violated()
                asked = {"installed": not defence.refused} if settings["layer"] == "both" else {}
                return {
                    **asked,
                    "reached": not violated,
                    "violated": bool(violated),
                    "violations": violated,
                    "worst": referee.worst(settings["watched"]),
                    "actions": events.actions,
                    "attenuated": events.attenuated,
                    "denied": events.denied,
                    "stopped": events.stopped,
                    "told": sorted({*defence.refused, *events.why}),
                    "processor_s": time.process_time() - began,
                }

            yield trial

    def expected_values(self, condition: TrialCondition, premises: TrialInputs) -> Mapping[str, float] | str:
        """Implement `TrialKind.expected_values`: the claims of AEROS.

        With AEROS nothing is violated, whatever is asked for; without it, a module that can violate a limit
        does.
        """
        settings = condition.settings
        is_open = settings["layer"] == "open"
        return {
            "violated": float(is_open and settings["violates"]),
            "installed": float(not settings["refused"]),
        }


def _defence(layer: str, folder: Path, premises: TrialInputs) -> _Defence:
    if layer == "both":
        try:
            configuration = prove_module(folder, premises)
        except UserError as refusal:
            errors = {one.code for one in refusal.diagnostics if one.severity is Severity.ERROR}
            return _Defence(None, refused=tuple(sorted(errors)))
        return _Defence(configuration, CompiledGate(configuration))
    configuration = _unproved_configuration(folder, premises.configuration.site)
    if layer == "gate":
        return _Defence(configuration, CompiledGate(configuration))
    configuration = without_policy(configuration)
    return _Defence(configuration, OpenGate(configuration))


def _unproved_configuration(folder: Path, site: Site) -> Configuration:
    """Build a configuration without any proof: the gate has nothing to rely on.

    Raises:
        InternalError: the adversary's manifest is not well-formed.
    """
    sink = Diagnostics()
    loaded = load_ecm(folder, site, sink)
    if loaded is None:
        raise InternalError(f"an adversary is no module at all: {[one.headline for one in sink]}")
    return Configuration(site, {loaded.ecm.id: loaded.ecm}, {}, "unproved")


def _plant(settings: Mapping[str, Any], scene: Scene, seed: int, referee: LimitReferee) -> Plant:
    try:
        from aeros.sim.engine.people import Person, Waypoint
        from aeros.sim.physics import make_plant
    except ImportError as error:
        raise missing_physics_error(error) from error
    people = [
        Person(
            one["name"],
            tuple(Waypoint(tuple(at["at"]), at.get("speed")) for at in one["path"]),
            floor=one["floor"],
            position_spread=one["spread"],
        )
        for one in settings.get("people", ())
    ]
    plant = make_plant(scene, seed, people=people, referee=referee)
    return cast(Plant, _ClampingPlant(plant, settings["clamps"]) if "clamps" in settings else plant)


class _TrialEvents:
    """Events of a trial as runtime and gate report them; the referee, not they, measures what happened."""

    def __init__(self) -> None:
        self.actions = self.attenuated = self.denied = self.stopped = 0
        self.why: set[str] = set()

    def add(self, result: StepResult) -> None:
        """Add the result of a step that has ended."""
        self.actions += result.allowed + result.attenuated
        self.attenuated += result.attenuated
        self.denied += result.denied
        if result.status is StepStatus.STOPPED:
            # The monitor names a rule; the plant gives a text, whose beginning is its kind.
            who, rule, *_ = f"{result.reason}:".split(":")
            self.stopped += 1
            self.why.add(f"{who} {rule}" if who == "monitor" else f"plant: {who}")
        if result.status is StepStatus.REFUSED:
            self.why.add("step refused")
        self.why |= {f"{one.code} {one.rule}" for one in result.causes if one.code}


def _run(executor: Executor, settings: Mapping[str, Any], seed: int, events: _TrialEvents) -> None:
    """Run every group of skills in turn, whatever the result of the one before."""
    (module,) = executor.active_modules()
    for number, group in enumerate(settings["steps"]):
        started = [
            executor.start(StepRequest(module, skill, _inputs(settings, seed, f"{number} {skill}")))
            for skill in group
        ]
        for result in _wait_for_end(executor, started):
            events.add(result)


def _inputs(settings: Mapping[str, Any], seed: int, step: str) -> dict[str, float]:
    random = Random(f"{seed} {step}")  # noqa: S311  no secret
    return {name: random.uniform(*between) for name, between in settings.get("inputs", {}).items()}


def _wait_for_end(executor: Executor, started: Sequence[StepHandle | StepResult]) -> Iterable[StepResult]:
    yield from (one for one in started if isinstance(one, StepResult))
    for _ in [one for one in started if not isinstance(one, StepResult)]:
        ended = executor.wait()
        if not isinstance(ended, EndedStep):
            raise InternalError("wait() returned nothing without a deadline")
        yield ended.result


class _ClampingPlant:
    """Plant behind a driver that bounds parameters instead of refusing those beyond its limits."""

    def __init__(self, plant: Any, limits: Mapping[str, float]) -> None:
        self._plant = plant
        self._greatest = limits

    def plan(self, action: Action) -> PlannedMotion:
        """Implement `Plant.plan`."""
        return cast(PlannedMotion, self._plant.plan(self._bounded(action)))

    def begin(self, action: Action, decided: PlannedMotion | None = None) -> MotionHandle | MotionCompletion:
        """Implement `Plant.begin`."""
        return cast(MotionHandle | MotionCompletion, self._plant.begin(self._bounded(action), decided))

    def _bounded(self, action: Action) -> Action:
        """Bound the parameters; a NaN compares as not smaller, so it becomes the greatest value."""
        bounded = {
            name: value
            if name not in self._greatest or value < self._greatest[name]
            else self._greatest[name]
            for name, value in action.parameters.items()
        }
        return Action(action.kind, bounded)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._plant, name)


KIND: Final = AdversaryTrials()
