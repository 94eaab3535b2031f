"""Errands of one instruction: position in it, skills that a prohibition bars, and the report of all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from aeros.agent.execution.report import RunReport
from aeros.agent.instructions.understand import Errand, Understanding
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import PlanStep, TaskGraph
from aeros.spec.model.ecm import Task


@dataclass(frozen=True, slots=True)
class ErrandPosition:
    """Position of an errand in its instruction.

    Attributes:
        number: errands before it.
        earlier_reports: their reports.
        barred_skills: skills that its plans must not use, as MODULE.SKILL.
    """

    number: int = 0
    earlier_reports: tuple[RunReport, ...] = ()
    barred_skills: frozenset[str] = frozenset()


def barred_skills(understanding: Understanding, errand: Errand) -> frozenset[str]:
    """Collect the skills that prohibited tasks use and the task of an errand does not.

    Args:
        understanding: meaning of the whole instruction.
        errand: one of its errands.

    Returns:
        Their names, as MODULE.SKILL.
    """
    barred: set[str] = set()
    for routed in understanding.prohibited:
        barred |= _skills_of(routed)
    return frozenset(barred - _skills_of(errand.routed))


def barred_steps(graph: TaskGraph, barred: frozenset[str]) -> list[str]:
    """List the steps of a plan that the user prohibited.

    Args:
        graph: a verified plan.
        barred: skills that must not be used, as MODULE.SKILL.

    Returns:
        A reason for each such step; empty iff the plan may be started.
    """
    if not barred:
        return []
    return [
        f"`{name}` belongs to a task that the instruction prohibits"
        for name in dict.fromkeys(_used_skills(graph))
        if name in barred
    ]


def combined_report(instruction: str, reports: Sequence[RunReport]) -> RunReport:
    """Combine the reports of an instruction's errands.

    Args:
        instruction: words of the user.
        reports: at least one, in order; only the last may be of an errand that was not reached.

    Returns:
        The only report, or one with the steps of all, the last one's task, and all goals in order.
    """
    *_, last = reports
    if len(reports) == 1:
        return last
    goals = ", then ".join(f"({one.goal})" for one in reports)
    measured = {name: value for one in reports for name, value in one.measured.items()}
    steps = tuple(step for one in reports for step in one.steps)
    replans = sum(one.replans for one in reports)
    reason = None if last.reason is None else f"{last.module}.{last.task}: {last.reason}"
    return RunReport(
        instruction, last.module, last.task, goals, last.reached, measured, steps, replans, reason
    )


def _skills_of(routed: RoutedTask) -> set[str]:
    return {f"{routed.module}.{skill}" for skill in _rule_skills(routed.task)}


def _rule_skills(task: Task) -> set[str]:
    return {name for rule in task.rules for name in (rule.skill, rule.on_failure) if name is not None}


def _used_skills(graph: TaskGraph) -> list[str]:
    """Return the skills of all steps and of their handlers, as MODULE.SKILL."""
    used: list[str] = []
    for step in graph.steps:
        run: PlanStep | None = step
        while run is not None:
            used.append(f"{run.module}.{run.skill}")
            if run.on_failure is not None:
                used.append(f"{run.module}.{run.on_failure}")
            run = run.handler
    return used
