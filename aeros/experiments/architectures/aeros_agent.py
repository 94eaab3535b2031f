"""AEROS itself: the shipped agent with its planning rules, whole or with parts of it left out."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any, cast

from aeros.agent.agent import open_temporary_agent
from aeros.agent.execution.journal import AgentEvent
from aeros.agent.planning.task_graph import PlanStep
from aeros.experiments.architecture import ArchitectureReport, TrialContext, TrialModel
from aeros.experiments.slow_planner import SlowPlanner
from aeros.runtime.ports import Runtime
from aeros.sim.symbolic.state import initial_values
from aeros.spec.closed_loop.markov_chain import Prediction, predict
from aeros.spec.closed_loop.transition_system import StateSpaceError, TransitionSystem
from aeros.spec.expr.doubles import to_doubles
from aeros.spec.model.model import Site


class AerosAgent:
    """A new agent, as `aeros run` has it but for memory of earlier tasks.

    retries: of each step at most; None as the rules say.
    recovery: whether `on_failure` runs between two tries.
    replans: at most; None as the site says, and 0 is a plan made once.
    within: seconds for each plan, which is then made beside the plant's time; None where it is made in place.
    first, again: what the first plan takes, and each that follows a failure, s.
    """

    def __init__(
        self,
        retries: int | None = None,
        *,
        recovery: bool = True,
        replans: int | None = None,
        planning_timeout: float | None = None,
        first_plan_delay_s: float = 0.0,
        replan_delay_s: float = 0.0,
    ) -> None:
        self._retries = retries
        self._recovery = recovery
        self._replans = replans
        self._within = planning_timeout
        self._takes = (first_plan_delay_s, replan_delay_s)

    def pursue(self, means: TrialContext) -> ArchitectureReport:
        """See `Architecture`."""
        site = self._with_limits(means.runtime.site)
        runtime = (
            means.runtime
            if site is means.runtime.site
            else cast(Runtime, _LimitedRuntime(means.runtime, site))
        )
        planner = SlowPlanner(*self._takes, self.ablate)
        late: list[AgentEvent] = []

        def told(event: AgentEvent) -> None:
            if event.kind == "plan-late":
                late.append(event)

        with open_temporary_agent(site.id, runtime, planner, told, means.seed, self._within) as agent:
            report = agent.run(means.task.task.trigger_phrases[0])
        return ArchitectureReport(
            report.retries, report.recoveries, report.replans, report.reason or "", len(late)
        )

    def predict(self, model: TrialModel) -> Prediction:
        """See `SelfPredicting`: the shipped prediction, of rules with the same parts left out.

        Where no first plan comes in time nothing is begun, however often it is asked for.
        """
        first, again = self._takes
        replans = self._with_limits(model.site).limits.replans
        if self._within is not None and first >= self._within and again >= self._within:
            return Prediction(*map(Fraction, (0, 0, 0, 0, replans)))
        if self._within is not None and max(first, again) >= self._within:
            raise StateSpaceError("what is left of the plan before is followed in place of one that is late")
        rules = tuple(
            replace(
                rule,
                retry=self._capped_retries(rule.retry),
                on_failure=rule.on_failure if self._recovery else None,
            )
            for rule in model.task.rules
        )
        system = TransitionSystem(model.ecm, replace(model.task, rules=rules, invariants=()), model.site)
        return predict(system, initial_state(model, system.names), replans)

    def ablate(self, step: PlanStep) -> PlanStep:
        """`step` as this variant takes it."""
        helper = step.on_failure if self._recovery else None
        return replace(step, retry=self._capped_retries(step.retry), on_failure=helper)

    def _capped_retries(self, retries: int) -> int:
        return retries if self._retries is None else min(retries, self._retries)

    def _with_limits(self, site: Site) -> Site:
        if self._replans is None:
            return site
        return replace(site, limits=replace(site.limits, replans=self._replans))


def initial_state(model: TrialModel, names: tuple[str, ...]) -> tuple[Any, ...]:
    """Where a trial of the task begins: the values of `names`, as the symbolic plant has them."""
    values = initial_values(model.site, to_doubles(model.task.initial))
    return tuple(values[name] for name in names)


class _LimitedRuntime:
    """A runtime whose site has other limits, for the agent alone: whoever decides goes by the site itself."""

    def __init__(self, runtime: Runtime, site: Site) -> None:
        self._runtime = runtime
        self.site = site

    def __getattr__(self, name: str) -> Any:
        return getattr(self._runtime, name)
