"""AEROS itself as an architecture: the shipped agent with its planning rules, whole or in part."""

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
from aeros.spec.closed_loop.giving_up import AgentBeliefs, declared_beliefs
from aeros.spec.closed_loop.loop_variables import StateSpaceError
from aeros.spec.closed_loop.markov_chain import Prediction, predict
from aeros.spec.closed_loop.transition_system import TransitionSystem
from aeros.spec.expr.doubles import to_doubles
from aeros.spec.model.site import Site


class AerosAgent:
    """A new agent for each trial, like that of `aeros run` but without memory of earlier tasks.

    Args:
        retries: most retries of each step; None for those of the planning rules.
        recovery: True if `between_tries` and `on_failure` run after failures.
        replans: most plans after the first; None for the site's limit, 0 for a plan made once.
        planning_timeout: seconds for each plan, which is then made while plant time goes on; None to plan in
            place, without a limit.
        first_plan_delay_s: time that the first plan takes, s.
        replan_delay_s: time that each plan after a failure takes, s.
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
        self._planning_timeout = planning_timeout
        self._plan_delays_s = (first_plan_delay_s, replan_delay_s)

    def pursue(self, context: TrialContext) -> ArchitectureReport:
        """Implement `Architecture.pursue`."""
        site = self._with_limits(context.runtime.site)
        runtime = (
            context.runtime
            if site is context.runtime.site
            else cast(Runtime, _LimitedRuntime(context.runtime, site))
        )
        planner = SlowPlanner(*self._plan_delays_s, self.ablate)
        late: list[AgentEvent] = []

        def on_event(event: AgentEvent) -> None:
            if event.kind == "planning-timeout":
                late.append(event)

        with open_temporary_agent(
            site.id, runtime, planner, on_event, context.seed, self._planning_timeout
        ) as agent:
            report = agent.run(str(context.task))
        return ArchitectureReport(
            report.retries, report.recoveries, report.replans, report.reason or "", len(late)
        )

    def predict(self, model: TrialModel) -> Prediction:
        """Implement `SelfPredicting.predict`: the shipped prediction, of rules with the same parts left out.

        If no plan can be ready in time, no step ever starts, however often the agent plans.

        Raises:
            StateSpaceError: a late plan is replaced by the rest of the previous one, which is not modelled.
        """
        return self._predict(model, model.beliefs or declared_beliefs(model.ecm))

    def predict_within(self, model: TrialModel, counted_skill: str, most_tries: int) -> Prediction:
        """Implement `PredictsBudgets.predict_within`: retries and re-plans are not those of the report.

        Raises:
            StateSpaceError: as for `predict`; or the task runs compositions, whose tries are not counted.
        """
        if any(one.composition for rule in model.task.rules for one in model.ecm.alternatives(rule.skill)):
            raise StateSpaceError("tries within a composition are not counted")
        beliefs = model.beliefs or declared_beliefs(model.ecm)
        return self._predict(model, replace(beliefs, counted_skill=counted_skill, most_tries=most_tries))

    def _predict(self, model: TrialModel, beliefs: AgentBeliefs) -> Prediction:
        first_delay_s, replan_delay_s = self._plan_delays_s
        replans = self._with_limits(model.site).limits.replans
        if (
            self._planning_timeout is not None
            and first_delay_s >= self._planning_timeout
            and replan_delay_s >= self._planning_timeout
        ):
            return Prediction(*map(Fraction, (0, 0, 0, 0, replans)))
        if (
            self._planning_timeout is not None
            and max(first_delay_s, replan_delay_s) >= self._planning_timeout
        ):
            raise StateSpaceError("the rest of the previous plan replaces a late plan")
        rules = tuple(
            replace(
                rule,
                retry=self._capped_retries(rule.retry),
                between_tries=rule.between_tries if self._recovery else None,
                on_failure=rule.on_failure if self._recovery else None,
            )
            for rule in model.task.rules
        )
        task = replace(model.task, rules=rules, invariants=())
        system = TransitionSystem(model.ecm, task, model.site, beliefs)
        return predict(system, system.start(initial_values(model.site, to_doubles(task.start))), replans)

    def ablate(self, step: PlanStep) -> PlanStep:
        """Remove from a step the retries and the recovery that this variant leaves out.

        Args:
            step: a step of a plan.

        Returns:
            The step as this variant runs it.
        """
        retry = self._capped_retries(step.retry)
        if self._recovery:
            return replace(step, retry=retry)
        return replace(step, retry=retry, between_tries=None, on_failure=None)

    def _capped_retries(self, retries: int) -> int:
        return retries if self._retries is None else min(retries, self._retries)

    def _with_limits(self, site: Site) -> Site:
        if self._replans is None:
            return site
        return replace(site, limits=replace(site.limits, replans=self._replans))


class _LimitedRuntime:
    """Runtime that shows the agent a site with other limits; the gate decides by the site itself."""

    def __init__(self, runtime: Runtime, site: Site) -> None:
        self._runtime = runtime
        self.site = site

    def __getattr__(self, name: str) -> Any:
        return getattr(self._runtime, name)
