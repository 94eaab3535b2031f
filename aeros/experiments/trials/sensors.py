"""Trials of one task with a bad sensor, while a person walks about: its cost, and the danger.

Settings of a condition: `task`; `person`, by the name of a people file that comes with AEROS; `of`, the
quantity that is measured badly all the time, and one of `noise` (standard deviation, SI), `latency` (s) and
`dropout` (the share of readings that never come).

A referee reads the true state.  What a protective stop cannot prevent is no violation: a rule about people is
violated where something keeps moving against it for longer than the site allows for reacting and stopping.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from fractions import Fraction
from math import dist
from typing import TYPE_CHECKING, Any, Final, cast

from aeros.experiments.architecture import build_architecture
from aeros.experiments.condition import TrialCondition
from aeros.experiments.inputs import TrialInputs
from aeros.experiments.trial_context import CountingRuntime, TrialContextImpl, is_goal_measured
from aeros.experiments.trial_kinds import Findings, Trial, scratch_folder
from aeros.experiments.trials.truth import REST_SPEED, InvariantReferee, RefereedPlant, site_constant
from aeros.runtime.ports import EndedStep, Plant, Runtime, StepStatus
from aeros.session.assembly import build_executor
from aeros.session.scene_files import scene_of_task
from aeros.sim.clock import TICK
from aeros.sim.sensor_model import SensorModel
from aeros.spec.model.site import Site

if TYPE_CHECKING:
    from aeros.sim.sensors import GroundTruth

_SENSOR_KEYS: Final = ("noise", "latency", "dropout")


class BadSensorTrials:
    """Kind of trials in which one quantity is measured badly."""

    @contextmanager
    def open(self, condition: TrialCondition, premises: TrialInputs) -> Iterator[Trial]:
        """Implement `TrialKind.open`, on physics, each trial with a plant of its own."""
        from aeros.sim.engine.people_file import read_people
        from aeros.sim.physics import make_plant

        settings = condition.settings
        routed = premises.routed(settings["task"])
        people = read_people(settings["person"])
        sensors = {settings["of"]: sensor_model(settings)}
        site = premises.configuration.site
        scene = scene_of_task(premises.configuration, routed.task)
        with scratch_folder() as (_, audit):

            def trial(seed: int) -> Findings:
                began = time.process_time()
                longest = _LongestViolation(site)
                referee = InvariantReferee(site, "human_distance", longest.tick)
                longest.referee = referee
                with closing(
                    make_plant(scene, seed, people=people, sensors=sensors, referee=referee)
                ) as plant:
                    refereed = cast(Plant, RefereedPlant(plant, referee, lambda _: None))
                    with build_executor(
                        premises.configuration, refereed, audit, premises.skill_runs, gate=premises.gate
                    ) as executor:
                        counting = _SensorCounters(executor)
                        context = TrialContextImpl(counting, routed, seed)
                        report = build_architecture("aeros", {}).pursue(context)
                        now = executor.now()
                        reached = is_goal_measured(routed.task.goal, site, executor.observe(), now)
                        found = {"reached": reached, **report.findings()}
                        found |= {"simulated_s": plant.now(), **counting.findings(), **longest.findings()}
                return {**found, "processor_s": time.process_time() - began}

            yield trial

    def expected_values(self, condition: TrialCondition, premises: TrialInputs) -> Mapping[str, float] | str:
        """Implement `TrialKind.expected_values`.

        Late or missing readings stop the robot, so nothing is violated; noise has no such promise.
        """
        return {} if "noise" in condition.settings else {"violated": 0.0}


def sensor_model(settings: Mapping[str, Any]) -> SensorModel:
    """Build the model of the bad sensor.

    Args:
        settings: of the condition: any of `noise`, `latency` and `dropout`.

    Returns:
        The model; what is not given is perfect.
    """
    return SensorModel(**{name: float(Fraction(settings[name])) for name in _SENSOR_KEYS if name in settings})


class _SensorCounters(CountingRuntime):
    """Runtime that also counts denials and stops, and how many were for want of a reading."""

    def __init__(self, runtime: Runtime) -> None:
        super().__init__(runtime)
        self._unread = self._stops = self._blind_stops = 0

    def wait(self, until: float = float("inf")) -> EndedStep | None:
        """Implement `Runtime.wait`."""
        ended = super().wait(until)
        if ended is not None:
            result = ended.result
            self._unread += result.denied > 0 and any(one.kind == "reading" for one in result.causes)
            is_stop = result.status is StepStatus.STOPPED
            self._stops += is_stop
            self._blind_stops += is_stop and result.reason.startswith("monitor:input:")
        return ended

    def findings(self) -> dict[str, Any]:
        """Return the counts by name."""
        return {
            "steps": self.steps,
            "denied": self.denied,
            "unread": self._unread,
            "stops": self._stops,
            "blind_stops": self._blind_stops,
        }


class _LongestViolation:
    """Longest time for which something kept moving though a rule did not hold of the true state."""

    def __init__(self, site: Site) -> None:
        self.referee: InvariantReferee | None = None
        self._reaction = site_constant(site, "reaction_time")
        self._arm = site_constant(site, "arm_stopping_time")
        self._deceleration = site_constant(site, "drive_deceleration")
        self._base: tuple[float, ...] | None = None
        self._since: int | None = None
        self._allowed = 0.0
        self._longest = 0.0
        self._violated: set[str] = set()

    def tick(self, truth: GroundTruth) -> None:
        """Record the true state after a tick."""
        values, before = truth.values, self._base
        self._base = values["base_position"]
        drives = 0.0 if before is None else dist(self._base, before) / TICK
        broken = () if self.referee is None else self.referee.broken
        if not broken or values["link_speed"] < REST_SPEED:
            self._since = None
            return
        if self._since is None:
            arm = self._arm if values["link_speed"] > drives + REST_SPEED else 0.0
            self._since = truth.tick
            self._allowed = self._reaction + max(arm, drives / self._deceleration)
        lasted = (truth.tick - self._since) * TICK
        self._longest = max(self._longest, lasted)
        if lasted > self._allowed:
            self._violated |= set(broken)

    def findings(self) -> dict[str, Any]:
        """Return violated rules, and the longest time, s."""
        return {
            "violated": bool(self._violated),
            "rules": sorted(self._violated),
            "longest_s": self._longest,
        }


KIND: Final = BadSensorTrials()
