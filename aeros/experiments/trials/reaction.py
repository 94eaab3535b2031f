"""Trials of how fast a robot stops for a person who walks in, while a planner takes as long as it likes.

Settings of a condition: `task`, at whose bench it is; `skill`, which another client has started;
`person`, who walks in, by the name of a people file that comes with AEROS; `latency`, the time that each plan
takes, s.

The planner really sleeps while plant time goes on, and is asked again as soon as its plan is there.  The
hazard is the first tick at which a rule about people does not hold of the true state for a motion under way.
From there the trial counts how soon the monitor names a rule and the robot rests.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from fractions import Fraction
from typing import TYPE_CHECKING, Any, Final, cast

from aeros.agent.planning.planner_client import PlannerClient
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.time_limited import PlanningTimeoutError
from aeros.agent.world.world import world_from_readings
from aeros.experiments.condition import TrialCondition
from aeros.experiments.inputs import TrialInputs
from aeros.experiments.slow_planner import SlowPlanner
from aeros.experiments.trial_kinds import Findings, Trial, scratch_folder
from aeros.experiments.trials.truth import REST_SPEED, InvariantReferee, RefereedPlant, site_constant
from aeros.runtime.ports import EndedStep, Plant, Runtime, StepRequest
from aeros.session.assembly import build_executor
from aeros.session.scene_files import scene_of_task
from aeros.sim.clock import TICK

if TYPE_CHECKING:
    from aeros.sim.sensors import GroundTruth

_TRIAL_TIMEOUT_S: Final = 15.0
"""Plant seconds after which a trial is over: the person has arrived by then."""

_PLAN_INTERVAL_S: Final = 0.1
"""Plant seconds between a plan and the next request."""

_PLANNING_TIMEOUT_S: Final = 60.0
"""Seconds that a plan may take; long enough that none is late."""


class ReactionTrials:
    """Kind of trials in which a person walks in while a planner thinks."""

    @contextmanager
    def open(self, condition: TrialCondition, premises: TrialInputs) -> Iterator[Trial]:
        """Implement `TrialKind.open`, on physics, each trial with a plant of its own."""
        from aeros.sim.engine.people_file import read_people
        from aeros.sim.physics import make_plant

        settings = condition.settings
        routed = premises.routed(settings["task"])
        people = read_people(settings["person"])
        site = premises.configuration.site
        braking = site_constant(site, "reaction_time") + site_constant(site, "arm_stopping_time")
        scene = scene_of_task(premises.configuration, routed.task)
        with scratch_folder() as (_, audit):

            def trial(seed: int) -> Findings:
                began = time.process_time()
                seen = _ReactionTimes()
                referee = InvariantReferee(site, "human_distance", seen.tick)
                seen.referee = referee
                with closing(make_plant(scene, seed, people=people, referee=referee)) as plant:
                    refereed = cast(Plant, RefereedPlant(plant, referee, seen.rule_broken))
                    with build_executor(
                        premises.configuration, refereed, audit, premises.skill_runs, gate=premises.gate
                    ) as executor:
                        _plan_until_stop(executor, routed, settings, seen)
                return {**seen.findings(braking), "processor_s": time.process_time() - began}

            yield trial

    def expected_values(self, condition: TrialCondition, premises: TrialInputs) -> Mapping[str, float] | str:
        """Implement `TrialKind.expected_values`.

        The monitor is asked after every tick, and the plant stops in the same one.
        """
        return {"success": 1.0, "stopped": 1.0, "reaction_ticks": 0.0}


def _plan_until_stop(
    runtime: Runtime, routed: RoutedTask, settings: Mapping[str, Any], seen: _ReactionTimes
) -> None:
    """Request plans until the running skill has ended, or the trial has timed out."""
    noting = _StepEndRecorder(runtime)
    latency = float(Fraction(settings["latency"]))
    proposals = PlannerClient(cast(Runtime, noting), SlowPlanner(latency, latency), _PLANNING_TIMEOUT_S)
    runtime.start(StepRequest(routed.module, settings["skill"], {}))
    while not noting.has_ended and runtime.now() < _TRIAL_TIMEOUT_S:
        seen.plans += 1
        seen.is_thinking = True
        world = world_from_readings(runtime.site.state, runtime.observe(), runtime.now())
        try:
            proposals.plan(routed, world)
        except PlanningTimeoutError:
            seen.late += 1
        seen.is_thinking = False
        if not noting.has_ended:
            noting.wait(runtime.now() + _PLAN_INTERVAL_S)


class _StepEndRecorder:
    """Runtime that records that a step has ended, whichever caller waited for it."""

    def __init__(self, runtime: Runtime) -> None:
        self._runtime = runtime
        self.has_ended = False

    def wait(self, until: float) -> EndedStep | None:
        ended = self._runtime.wait(until)
        self.has_ended = self.has_ended or ended is not None
        return ended

    def __getattr__(self, name: str) -> Any:
        return getattr(self._runtime, name)


class _ReactionTimes:
    """Ticks of the hazard, of the rule that the monitor named, and of rest."""

    def __init__(self) -> None:
        self.referee: InvariantReferee | None = None
        self.is_thinking = False
        self.plans = self.late = 0
        self._now = 0
        self._hazard: int | None = None
        self._named: int | None = None
        self._rested: int | None = None
        self._while_thinking = False
        self._rule = ""
        self._hazard_s = self._named_s = 0.0

    def tick(self, truth: GroundTruth) -> None:
        """Record the true state after a tick."""
        self._now = truth.tick
        if self._hazard is None and self.referee is not None and self.referee.broken:
            self._hazard, self._while_thinking = truth.tick, self.is_thinking
            self._hazard_s = time.perf_counter()
        if self._hazard is not None and self._rested is None and truth.values["link_speed"] < REST_SPEED:
            self._rested = truth.tick

    def rule_broken(self, rule: str) -> None:
        """Record that the monitor named a rule at the last tick."""
        if self._named is None and self._hazard is not None:
            self._named, self._rule = self._now, rule
            self._named_s = time.perf_counter()

    def findings(self, braking: float) -> dict[str, Any]:
        """Return the findings; without a hazard there was nothing to stop for."""
        findings: dict[str, Any] = {
            "plans": self.plans,
            "late": self.late,
            "hazards": int(self._hazard is not None),
        }
        findings |= {"stopped": int(self._named is not None), "rule": self._rule, "reached": True}
        if self._hazard is None:
            return findings
        findings["while_thinking"] = int(self._while_thinking)
        findings["reached"] = False
        if self._named is not None:
            findings["reaction_ticks"] = self._named - self._hazard
            findings["reaction_s"] = self._named_s - self._hazard_s
        if self._rested is not None:
            findings["rest_s"] = (self._rested - self._hazard) * TICK
            findings["reached"] = findings["rest_s"] <= braking
        return findings


KIND: Final = ReactionTrials()
