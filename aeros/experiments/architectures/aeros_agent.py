"""AEROS itself: the shipped agent with its planning rules, whole or with parts of it left out."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any, cast

from aeros.agent.agent import awake_once
from aeros.agent.execution.journal import Event
from aeros.agent.planning.task_graph import Step
from aeros.experiments.architecture import Means, Model, Told
from aeros.experiments.slow_planner import SlowPlanner
from aeros.runtime.ports import Runtime
from aeros.sim.symbolic.state import initial_values
from aeros.spec.closed_loop.markov_chain import Prediction, predict
from aeros.spec.closed_loop.transition_system import NotExploredError, TransitionSystem
from aeros.spec.expr.doubles import as_doubles
from aeros.spec.model.model import Site


class ShippedAgent:
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
        within: float | None = None,
        first: float = 0.0,
        again: float = 0.0,
    ) -> None:
        self._retries = retries
        self._recovery = recovery
        self._replans = replans
        self._within = within
        self._takes = (first, again)

    def pursue(self, means: Means) -> Told:
        """See `Architecture`."""
        site = self._limited(means.runtime.site)
        runtime = means.runtime if site is means.runtime.site else cast(Runtime, _Under(means.runtime, site))
        planner = SlowPlanner(*self._takes, self.without)
        late: list[Event] = []

        def told(event: Event) -> None:
            if event.kind == "plan-late":
                late.append(event)

        with awake_once(site.id, runtime, planner, told, means.seed, self._within) as agent:
            report = agent.run(means.routed.task.words[0])
        return Told(report.retries, report.recoveries, report.replans, report.reason or "", len(late))

    def predict(self, model: Model) -> Prediction:
        """See `Predicting`: the shipped prediction, of rules with the same parts left out.

        Where no first plan comes in time nothing is begun, however often it is asked for.
        """
        first, again = self._takes
        replans = self._limited(model.site).limits.replans
        if self._within is not None and first >= self._within and again >= self._within:
            return Prediction(*map(Fraction, (0, 0, 0, 0, replans)))
        if self._within is not None and max(first, again) >= self._within:
            raise NotExploredError("what is left of the plan before is followed in place of one that is late")
        rules = tuple(
            replace(
                rule, retry=self._most(rule.retry), on_failure=rule.on_failure if self._recovery else None
            )
            for rule in model.task.rules
        )
        system = TransitionSystem(model.ecm, replace(model.task, rules=rules, invariants=()), model.site)
        return predict(system, start_of(model, system.names), replans)

    def without(self, step: Step) -> Step:
        """`step` as this variant takes it."""
        helper = step.on_failure if self._recovery else None
        return replace(step, retry=self._most(step.retry), on_failure=helper)

    def _most(self, retries: int) -> int:
        return retries if self._retries is None else min(retries, self._retries)

    def _limited(self, site: Site) -> Site:
        if self._replans is None:
            return site
        return replace(site, limits=replace(site.limits, replans=self._replans))


def start_of(model: Model, names: tuple[str, ...]) -> tuple[Any, ...]:
    """Where a trial of the task begins: the values of `names`, as the symbolic plant has them."""
    values = initial_values(model.site, as_doubles(model.task.initial))
    return tuple(values[name] for name in names)


class _Under:
    """A runtime whose site has other limits, for the agent alone: whoever decides goes by the site itself."""

    def __init__(self, runtime: Runtime, site: Site) -> None:
        self._runtime = runtime
        self.site = site

    def __getattr__(self, name: str) -> Any:
        return getattr(self._runtime, name)
