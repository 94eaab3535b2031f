"""AEROS's plan check and planner on a converted task: what `aeros plan` does with its files, in process."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from aeros.agent.world.values import to_exact
from aeros.apps.goal import parse_goal, parse_value
from aeros.cli.author.plan import capability_providers
from aeros.spec.closed_loop.invocation import State
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.planning.domain import PlanningDomain, domain_for
from aeros.spec.planning.plan_check import find_step_problems, read_plan
from aeros.spec.planning.quickest import quickest_strategy
from aeros.spec.planning.strong_cyclic import StrongCyclicStrategy
from benchmarks.external.is_bench.conversion.module import MODULE, Conversion, skill_id


@dataclass(frozen=True)
class PlanChecker:
    """A converted task, loaded by AEROS from its files.

    Attributes:
        conversion: the conversion.
        domain: planning domain of its skills and goal.
        start: state at the start.
        providers: skills of each action that became several.
    """

    conversion: Conversion
    domain: PlanningDomain
    start: State
    providers: dict[str, tuple[str, ...]]

    def problems(self, plan: Sequence[str]) -> list[str]:
        """List the reasons to refuse a plan; empty iff it is accepted.

        Args:
            plan: steps of the benchmark, as `OPEN(oven.n.01_1)`.
        """
        steps = read_plan(self.conversion.plan(plan))
        strategy = StrongCyclicStrategy(self.domain)
        return find_step_problems(strategy, self.start, steps, self.providers, every_step=True)

    def find_plan(self) -> list[str] | None:
        """Search for a plan.

        Returns:
            Its steps, as the benchmark writes them; None if it is proved that there is none.

        Raises:
            PlanUndecidedError: the search was given up.
        """
        strategy = quickest_strategy(self.domain, self.start, 0)
        if not strategy.solves(self.start):
            return None
        actions = {
            name: one.action
            for one in self.conversion.skills
            for name in (skill_id(one.action), *self.providers.get(f"{MODULE}.{skill_id(one.action)}", ()))
        }
        steps, state = [], self.start
        while self.domain.goal(state) is not True:
            choice = strategy.chosen[state]
            name, *things = actions.get(choice.skill.id) or actions[choice.name]
            steps.append(f"{name.upper()}({', '.join(things)})")
            ((state, _, _),) = self.domain.after(choice, state)
        return steps


def load(conversion: Conversion) -> PlanChecker:
    """Write a conversion to files and load them.

    Args:
        conversion: the conversion.

    Returns:
        What checks plans.

    Raises:
        UserError: AEROS refuses a file.
    """
    with tempfile.TemporaryDirectory() as folder:
        conversion.write(Path(folder))
        diagnostics = Diagnostics()
        site = load_site(Path(folder, "site.yaml"), diagnostics)
        loaded = None if site is None else load_ecm(Path(folder, MODULE), site, diagnostics)
        diagnostics.raise_if_errors()
    if site is None or loaded is None:
        raise InternalError("files of a conversion that were not read were not reported")
    modules = {MODULE: loaded.ecm}
    site = site.with_modules(modules.values())
    known = {}
    for name, text in conversion.vocabulary.initial.items():
        full, value = parse_value(name, text, site)
        known[full] = to_exact(site.state[full], value)
    goal = parse_goal(conversion.goal, site)
    everything = {f"{MODULE}.{skill}".casefold() for skill in loaded.ecm.skills}
    domain = domain_for(modules, site, known, goal.term, extra_variables=everything)
    return PlanChecker(conversion, domain, domain.state(known), capability_providers(modules))
