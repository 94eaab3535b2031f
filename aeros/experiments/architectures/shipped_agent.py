"""AEROS itself: the shipped agent with its planning rules, whole or with parts of it left out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, cast

from aeros.agent.graph import Step, TaskGraph
from aeros.agent.loop import awake_once
from aeros.agent.planner import RulePlanner
from aeros.agent.routing import Routed
from aeros.agent.world import World
from aeros.experiments.architecture import Means, Model, Told
from aeros.runtime.ports import Runtime
from aeros.sim.symbolic_state import initial_values
from aeros.spec.closed_loop.chain import Prediction, predict
from aeros.spec.closed_loop.transition_system import TransitionSystem
from aeros.spec.doubles import as_doubles
from aeros.spec.model import Ecm, Site


class ShippedAgent:
    """A new agent, as `aeros run` has it but for memory of earlier tasks.

    retries: of each step at most; None as the rules say.
    recovery: whether `on_failure` runs between two tries.
    replans: at most; None as the site says, and 0 is a plan made once.
    """

    def __init__(
        self, retries: int | None = None, *, recovery: bool = True, replans: int | None = None
    ) -> None:
        self._retries = retries
        self._recovery = recovery
        self._replans = replans

    def pursue(self, means: Means) -> Told:
        """See `Architecture`."""
        site = self._limited(means.runtime.site)
        runtime = means.runtime if site is means.runtime.site else cast(Runtime, _Under(means.runtime, site))
        with awake_once(site.id, runtime, _Planner(self), seed=means.seed) as agent:
            report = agent.run(means.routed.task.words[0])
        return Told(report.retries, report.recoveries, report.replans, report.reason or "")

    def predict(self, model: Model) -> Prediction:
        """See `Predicting`: the shipped prediction, of rules with the same parts left out."""
        rules = tuple(
            replace(
                rule, retry=self._most(rule.retry), on_failure=rule.on_failure if self._recovery else None
            )
            for rule in model.task.rules
        )
        system = TransitionSystem(model.ecm, replace(model.task, rules=rules, invariants=()), model.site)
        return predict(system, start_of(model, system.names), self._limited(model.site).limits.replans)

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


class _Planner:
    """The planning rules, each step with what is left of it."""

    name = "rules"

    def __init__(self, variant: ShippedAgent) -> None:
        self._variant = variant
        self._rules = RulePlanner()

    def plan(self, routed: Routed, world: World, modules: Mapping[str, Ecm]) -> TaskGraph:
        """See `Planner`."""
        graph = self._rules.plan(routed, world, modules)
        return TaskGraph(tuple(self._variant.without(step) for step in graph.steps))


class _Under:
    """A runtime whose site has other limits, for the agent alone: whoever decides goes by the site itself."""

    def __init__(self, runtime: Runtime, site: Site) -> None:
        self._runtime = runtime
        self.site = site

    def __getattr__(self, name: str) -> Any:
        return getattr(self._runtime, name)
