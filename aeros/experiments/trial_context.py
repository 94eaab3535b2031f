"""Context of a real trial: skills run through executor and gate, and a runtime that counts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import inf
from typing import Any, cast

from aeros.agent.execution.supervisor import StepAssessment, assess_step, start_obstacle
from aeros.agent.planning.base import RulePlanner
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import PlanStep
from aeros.agent.world.values import CachingConverter, to_exact
from aeros.agent.world.world import WorldModel, world_from_readings
from aeros.experiments.architecture import (
    MAX_CALLS,
    NO_BUDGET,
    Budget,
    BudgetSpentError,
    CallLimitError,
    RunningStep,
)
from aeros.runtime.ports import EndedStep, Readings, Runtime, StepHandle, StepRequest, StepResult
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import Environment
from aeros.spec.model.ecm import Skill, owner_of
from aeros.spec.model.site import Site


def is_goal_measured(goal: t.Term, site: Site, readings: Readings, now: float) -> bool:
    """Evaluate a goal for the harness.

    No object that an architecture has is asked: an entry may have changed its context, or its calls may be
    used up.

    Args:
        goal: the task's goal.
        site: declares the variables.
        readings: of the plant itself.
        now: plant time, s.

    Returns:
        True if the goal holds in the measured state.
    """
    return world_from_readings(site.state, readings, now).truth_by_known_values(goal) is True


class CountingRuntime:
    """Runtime that counts the calls made to it, and passes everything on to another runtime.

    Args:
        runtime: the runtime that does the work.
        counted_skill: module and name of a skill whose tries are counted too.
        judge_by_measurement: also count the tries of that skill that failed, by what is measured.
        budget: what it lets begin.

    Attributes:
        judged: True if failed tries are counted.
        steps: skills that began.
        actions: actions that the gate let begin.
        denied: actions that the gate denied.
        tries: ended tries of the counted skill.
        failed_tries: those of them that failed.
        first_failed: True if the first of them failed.
    """

    def __init__(
        self,
        runtime: Runtime,
        counted_skill: tuple[str, str] | None = None,
        *,
        judge_by_measurement: bool = False,
        budget: Budget = NO_BUDGET,
    ) -> None:
        self._runtime = runtime
        self._watched = counted_skill
        self._budget = budget
        self._starts = 0
        self.judged = judge_by_measurement
        self._under_way: dict[StepHandle, Mapping[str, Any]] = {}
        self.steps = 0
        self.actions = 0
        self.denied = 0
        self.tries = 0
        self.failed_tries = 0
        self.first_failed = False

    def start(self, request: StepRequest) -> StepHandle | StepResult:
        """Implement `Runtime.start`.

        Raises:
            BudgetSpentError: the budget allows no further try of the counted skill, or no further step.
        """
        is_counted = (request.module, request.skill) == self._watched
        tries, seconds = self._budget.tries, self._budget.seconds
        has_no_try = is_counted and tries is not None and self._starts >= tries
        if has_no_try or (seconds is not None and self._runtime.now() >= seconds):
            raise BudgetSpentError
        started = self._runtime.start(request)
        if not isinstance(started, StepResult):
            self.steps += 1
            if is_counted:
                self._starts += 1
                self._under_way[started] = self._world().predicates
        return started

    def wait(self, until: float = inf) -> EndedStep | None:
        """Implement `Runtime.wait`."""
        ended = self._runtime.wait(until)
        if ended is not None:
            self.actions += ended.result.allowed + ended.result.attenuated
            self.denied += ended.result.denied
            if ended.step in self._under_way:
                before = self._under_way.pop(ended.step)
                self.tries += 1
                if self.judged:
                    failed = self._has_failed(ended.result, before)
                    self.failed_tries += failed
                    self.first_failed = failed if self.tries == 1 else self.first_failed
        return ended

    def _has_failed(self, result: StepResult, before: Mapping[str, Any]) -> bool:
        """Judge the ended try by what is measured now, and was measured when it began."""
        assert self._watched is not None  # noqa: S101  only what is watched is under way
        module, name = self._watched
        skill = self._runtime.active_modules()[module].skills[name]
        return assess_step(module, skill, result, self._world(), before).failed

    def _world(self) -> WorldModel:
        return world_from_readings(self._runtime.site.state, self._runtime.observe(), self._runtime.now())

    def __getattr__(self, name: str) -> Any:
        """Pass on what the port has; all else is the harness's, the truth in the simulator among it.

        Raises:
            AttributeError: the port has no such attribute.
        """
        if not hasattr(Runtime, name):
            raise AttributeError(f"`{name}` is not part of the runtime's port")
        return getattr(self._runtime, name)


class TrialContextImpl:
    """Implementation of `architecture.TrialContext` on a real runtime."""

    def __init__(self, runtime: CountingRuntime, routed: RoutedTask, seed: int) -> None:
        self._runtime = cast(Runtime, runtime)
        self._routed = routed
        self._seed = seed
        self._exactly = CachingConverter()
        self._planner = RulePlanner()
        self._asked = 0
        self._readings: Readings | None = None
        self._world: WorldModel | None = None

    @property
    def task(self) -> RoutedTask:
        """The task and its module."""
        return self._routed

    @property
    def seed(self) -> int:
        """The seed of the trial."""
        return self._seed

    @property
    def runtime(self) -> Runtime:
        """The runtime, which counts."""
        return self._runtime

    def world(self) -> WorldModel:
        """Implement `TrialContext.world`.

        Raises:
            CallLimitError: the architecture has used up its calls.
        """
        self._asked += 1
        if self._asked > MAX_CALLS:
            raise CallLimitError
        runtime = self._runtime
        readings, now = runtime.observe(), runtime.now()
        # The same readings object at the same time gives the same world, which is reused.
        if self._world is None or readings is not self._readings or now != self._world.time:
            self._readings = readings
            self._world = world_from_readings(runtime.site.state, readings, now, self._exactly)
        return self._world

    def is_goal_reached(self) -> bool:
        """Implement `TrialContext.is_goal_reached`."""
        return self.world().truth_by_known_values(self._routed.task.goal) is True

    def plan(self) -> tuple[PlanStep, ...]:
        """Implement `TrialContext.plan`."""
        return self._planner.plan(self._routed, self.world(), self._runtime.active_modules()).steps

    def run(self, step: PlanStep) -> StepAssessment:
        """Implement `TrialContext.run`.

        Raises:
            MisuseError: the runtime stopped waiting without a deadline.
        """
        started = self.begin(step)
        if isinstance(started, StepAssessment):
            return started
        ended = started.wait(inf)
        if ended is None:
            raise MisuseError("wait() returned nothing without a deadline")
        return ended

    def begin(self, step: PlanStep) -> RunningStep | StepAssessment:
        """Implement `TrialContext.begin`; of a capability the first provider that may start begins.

        Raises:
            MisuseError: the module has no such skill.
        """
        world, modules = self.world(), self._runtime.active_modules()
        owned = [owner_of(name, step.module) for name in modules[step.module].providers(step.skill)]
        providers = [
            (modules[owner], modules[owner].skills[name]) for owner, name in owned if owner in modules
        ]
        if not providers:
            raise MisuseError(f"`{step.module}` has no skill `{step.skill}`")
        problems = [start_obstacle(of.id, one, world, _environment(one, step)) for of, one in providers]
        able = [one for one, problem in zip(providers, problems, strict=True) if problem is None]
        if not able:
            return StepAssessment(None, True, False, "; ".join(str(problem) for problem in problems))
        (module, skill), before = able[0], world.predicates
        started = self._runtime.start(StepRequest(module.id, skill.id, _with_defaults(skill, step.inputs)))

        def assess(result: StepResult) -> StepAssessment:
            return assess_step(module.id, skill, result, self.world(), before)

        return (
            assess(started)
            if isinstance(started, StepResult)
            else _RunningStep(self._runtime, started, assess)
        )


class _RunningStep:
    """Implementation of `RunningStep`; nothing else is under way."""

    def __init__(
        self, runtime: Runtime, step: StepHandle, assess: Callable[[StepResult], StepAssessment]
    ) -> None:
        self._runtime, self._step, self._assess = runtime, step, assess

    def wait(self, seconds: float) -> StepAssessment | None:
        ended = self._runtime.wait(self._runtime.now() + seconds)
        return None if ended is None else self._assess(ended.result)

    def halt(self) -> None:
        self._runtime.cancel(self._step, "the architecture halts it")
        self._runtime.wait()


def _with_defaults(skill: Skill, inputs: Mapping[str, Any]) -> dict[str, Any]:
    return {name: inputs.get(name, declared.default_value) for name, declared in skill.inputs.items()}


def _environment(skill: Skill, step: PlanStep) -> Environment:
    """Return the skill's inputs, exact, by the names that its conditions use."""
    filled = _with_defaults(skill, step.inputs)
    return {declared.name: to_exact(declared, filled[name]) for name, declared in skill.inputs.items()}
