"""Architectures of somebody else's, as they could be entered."""

from __future__ import annotations

from dataclasses import replace
from random import Random

from aeros.agent.planning.task_graph import PlanStep
from aeros.experiments.architecture import ArchitectureReport, TrialContext


class Stubborn:
    """Does the first step of a new plan, again and again."""

    def __init__(self, patience: int = 12) -> None:
        self._patience = patience

    def pursue(self, context: TrialContext) -> ArchitectureReport:
        for made in range(self._patience):
            if context.is_goal_reached():
                return ArchitectureReport(replans=made)
            needed = [step for step in context.plan() if context.world().evaluate(_unless(step)) is not True]
            context.run(needed[0])
        return ArchitectureReport(replans=self._patience, reason="patience is over")


def _unless(step: PlanStep):  # type: ignore[no-untyped-def]
    assert step.unless is not None
    return step.unless


class Dicey:
    """Chooses by chance what to do, and by other than what it is given."""

    _random = Random(1)  # noqa: S311

    def pursue(self, context: TrialContext) -> ArchitectureReport:
        for step in context.plan():
            for _ in range(self._random.randint(1, 4)):
                context.run(step)
        return ArchitectureReport()


class Endless:
    """Never gives up."""

    def pursue(self, context: TrialContext) -> ArchitectureReport:
        while not context.is_goal_reached():
            context.run(PlanStep(context.task.module, "recover"))
        return ArchitectureReport()


class Raising:
    """Has a fault."""

    def pursue(self, context: TrialContext) -> ArchitectureReport:
        raise ZeroDivisionError("mine")


class Boastful:
    """Does nothing, and makes its context say that all is true."""

    def pursue(self, context: TrialContext) -> ArchitectureReport:
        world = context.world()
        truths = {name: True if value is False else value for name, value in world.known.items()}
        for name, value in {
            "world": lambda: replace(world, known=truths),
            "is_goal_reached": lambda: True,
            "is_goal_measured": lambda: True,
        }.items():
            setattr(context, name, value)
        setattr(context.runtime, "observe", lambda: dict.fromkeys(world.known, (True, 0.0)))  # noqa: B010
        assert context.is_goal_reached()
        return ArchitectureReport()


class NoArchitecture:
    """Cannot pursue anything."""
