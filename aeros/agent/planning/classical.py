"""Classical planning of PDDL problems with the library unified-planning.

This is the only module that imports unified-planning, which the extra `pddl` installs. Planners
(“engines”) are packages of their own; the extra installs one. Disjunctions and negations are compiled away
first, so that any engine can be used.
"""

from __future__ import annotations

import warnings
from importlib.util import find_spec
from typing import Any

from aeros.agent.errors import AgentError
from aeros.distribution import install_command


class ClassicalEngineError(Exception):
    """An engine that neither found a plan nor decided that there is none; the message says why."""


class UnifiedPlanningEngine:
    """A classical planner. `name` is an installed engine; with None unified-planning chooses one."""

    def __init__(self, name: str | None = None) -> None:
        if find_spec("unified_planning") is None:
            raise AgentError(f"--planner pddl needs {install_command('pddl')} (unified_planning is missing)")
        self._name = name

    def solve(self, domain: str, problem: str) -> list[str] | None:
        """Solve a planning problem.

        Args:
            domain: PDDL text of the domain.
            problem: PDDL text of the problem.

        Returns:
            The names of the plan's actions; None if the engine finds that there is no plan.

        Raises:
            ClassicalEngineError: the engine fails or does not decide.
        """
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of engines, about themselves
            try:
                return self._solve(domain, problem)
            except ClassicalEngineError:
                raise
            except Exception as error:  # engines raise what they like
                raise ClassicalEngineError(f"{type(error).__name__}: {error}") from error

    def _solve(self, domain: str, problem: str) -> list[str] | None:
        from unified_planning.engines import CompilationKind, PlanGenerationResultStatus
        from unified_planning.environment import get_environment
        from unified_planning.io import PDDLReader

        # Not one of its own: its parser makes the fluents of conditional effects in this one.
        environment = get_environment()
        environment.credits_stream = None
        factory = environment.factory
        posed = PDDLReader(environment).parse_problem_string(domain, problem)
        steps: list[Any] = []
        for kind in (
            CompilationKind.CONDITIONAL_EFFECTS_REMOVING,
            CompilationKind.DISJUNCTIVE_CONDITIONS_REMOVING,
            CompilationKind.NEGATIVE_CONDITIONS_REMOVING,
        ):
            with factory.Compiler(problem_kind=posed.kind, compilation_kind=kind) as compiler:
                compiled = compiler.compile(posed, kind)
            steps.insert(0, compiled.map_back_action_instance)
            posed = compiled.problem
        chosen = {"problem_kind": posed.kind} if self._name is None else {"name": self._name}
        with factory.OneshotPlanner(**chosen) as engine:
            found = engine.solve(posed)
        if found.plan is None:
            unsolvable = (
                PlanGenerationResultStatus.UNSOLVABLE_PROVEN,
                PlanGenerationResultStatus.UNSOLVABLE_INCOMPLETELY,
            )
            if found.status in unsolvable:
                return None
            raise ClassicalEngineError(f"{engine.name} ends with {found.status.name}")
        plan = found.plan
        for map_back in steps:
            plan = plan.replace_action_instances(map_back)
        return [one.action.name for one in plan.actions]
