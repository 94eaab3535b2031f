"""Errands of one instruction: position in it, skills that a prohibition bars, and the report of all."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

from aeros.agent.execution.report import RunReport
from aeros.agent.instructions.meaning import Errand, Understanding
from aeros.agent.planning.base import Planner, RulePlanner
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import TaskGraph, skills_behind
from aeros.runtime.ports import Runtime
from aeros.spec.expr import terms as t
from aeros.spec.model.ecm import Ecm, owner_of


@dataclass(frozen=True, slots=True)
class ErrandPosition:
    """Position of an errand in its instruction.

    Attributes:
        number: errands before it.
        earlier_reports: their reports.
        barred_skills: skills that its plans must not use, as MODULE.SKILL.
        proposed_plan: unverified plan that came with the meaning of the instruction; None without one.
    """

    number: int = 0
    earlier_reports: tuple[RunReport, ...] = ()
    barred_skills: frozenset[str] = frozenset()
    proposed_plan: TaskGraph | None = None


def barred_skills(understanding: Understanding, errand: Errand, modules: Mapping[str, Ecm]) -> frozenset[str]:
    """Collect the skills that prohibited tasks may use and the task of an errand may not.

    Args:
        understanding: meaning of the whole instruction.
        errand: one of its errands.
        modules: active modules by id.

    Returns:
        Their names, as MODULE.SKILL.
    """
    barred: set[str] = set()
    for routed in understanding.prohibited:
        barred |= _skills_of_task(routed, modules)
    return frozenset(barred - _skills_of_task(errand.routed, modules))


def modules_of(understanding: Understanding) -> frozenset[str]:
    """Collect the modules whose tasks an instruction asks for, or whose variables its conditions read.

    Args:
        understanding: meaning of the whole instruction.

    Returns:
        Ids of modules.
    """
    errands = understanding.errands
    conditions = [one.condition for one in errands if one.condition is not None]
    conditions += [one.routed.task.goal for one in errands]
    read = {name.partition(".")[0] for term in conditions for name in t.variables_of(term) if "." in name}
    return frozenset({one.routed.module for one in errands} | read)


@contextmanager
def attending(understanding: Understanding, runtime: Runtime, planner: Planner) -> Iterator[None]:
    """Attend to the modules that matter while an instruction is pursued, and to all afterwards.

    Args:
        understanding: meaning of the whole instruction.
        runtime: the runtime, which calls the perceivers of modules.
        planner: the planner; one that does not follow rules may use the skills of every module.

    Yields:
        Once.
    """
    runtime.attend(modules_of(understanding) if isinstance(planner, RulePlanner) else None)
    try:
        yield
    finally:
        runtime.set_parameters({})
        runtime.set_memories({})
        runtime.attend(None)


def barred_steps(graph: TaskGraph, barred: frozenset[str], modules: Mapping[str, Ecm]) -> list[str]:
    """List the skills that the user prohibited and a plan may use.

    Args:
        graph: a verified plan.
        barred: skills that must not be used, as MODULE.SKILL.
        modules: active modules by id.

    Returns:
        A reason for each such step; empty iff the plan may be started.
    """
    if not barred:
        return []
    return [
        f"`{skill}` belongs to a task that the instruction prohibits"
        + ("" if skill == name else f", and `{name}` may run it")
        for name, skills in dict(_skills_of_plan(graph, modules)).items()
        for skill in sorted(skills & barred)
    ]


def combined_report(instruction: str, reports: Sequence[RunReport]) -> RunReport:
    """Combine the reports of an instruction's errands.

    Args:
        instruction: words of the user.
        reports: at least one, in order; only the last may be of an errand that failed.

    Returns:
        The only report, or one with the steps of all, the task of the last one that was not skipped, and all
        goals in order. It is skipped if all are.
    """
    if len(reports) == 1:
        return reports[0]
    *_, last = [one for one in reports if not one.skipped] or reports
    goals = ", then ".join(f"({one.goal})" + (" skipped" if one.skipped else "") for one in reports)
    measured = {name: value for one in reports if not one.skipped for name, value in one.measured.items()}
    steps = tuple(step for one in reports for step in one.steps)
    replans = sum(one.replans for one in reports)
    reason = None if last.reason is None else f"{last.module}.{last.task}: {last.reason}"
    return replace(
        last,
        instruction=instruction,
        goal=goals,
        measured=measured,
        steps=steps,
        replans=replans,
        reason=reason,
    )


def _skills_of_task(routed: RoutedTask, modules: Mapping[str, Ecm]) -> set[str]:
    used: set[str] = set()
    for rule in routed.task.rules:
        for name in (rule.skill, rule.between_tries, rule.on_failure):
            if name is not None:
                used |= _runnable_skills(*owner_of(name, routed.module), modules)
    return used


def _skills_of_plan(graph: TaskGraph, modules: Mapping[str, Ecm]) -> Iterator[tuple[str, set[str]]]:
    """Yield for each step of a plan, and each step that its failure leads to, its name and its skills."""
    pending = list(reversed(graph.steps))
    while pending:
        step = pending.pop()
        yield f"{step.module}.{step.skill}", _runnable_skills(step.module, step.skill, modules)
        pending += [helper for _, helper in reversed(step.helpers)]


def _runnable_skills(module: str, name: str, modules: Mapping[str, Ecm]) -> set[str]:
    """Collect the skills any of which may run; what no active module has stands for itself."""
    return set(skills_behind(module, name, modules)) or {f"{module}.{name}"}
