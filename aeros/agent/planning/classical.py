"""Has a classical planner of unified-planning solve a problem in PDDL.

The sole importer of unified-planning, which is there with `pip install 'aeros[pddl]'`; planners (“engines”)
are packages of their own, of which that brings one.  Disjunctions and negations are compiled away first, so
that any of them will do.
"""

from __future__ import annotations

import warnings
from importlib.util import find_spec
from typing import Any

from aeros.agent.errors import AgentError


class ClassicalEngineError(Exception):
    """The engine has neither a plan nor found that there is none; the message says why."""


class UnifiedPlanningEngine:
    """A classical planner.

    name: of an installed engine; None leaves the choice to unified-planning.
    """

    def __init__(self, name: str | None = None) -> None:
        if find_spec("unified_planning") is None:
            raise AgentError("--planner pddl needs `pip install 'aeros[pddl]'` (unified_planning is missing)")
        self._name = name

    def solve(self, domain: str, problem: str) -> list[str] | None:
        """The names of the actions of a plan; None where the engine finds that there is none.

        Raises `ClassicalEngineError`.
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
        from unified_planning.environment import Environment
        from unified_planning.io import PDDLReader

        environment = Environment()
        environment.credits_stream = None
        factory = environment.factory
        posed = PDDLReader(environment).parse_problem_string(domain, problem)
        steps: list[Any] = []
        for kind in (
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
