"""Steps that name a capability in place of one of its providers, so that the agent chooses among these.

Planners that search, and language models, name skills. Where another skill provides the same capability, and
the plan leads to the goal with each of them, the step names the capability. Then the dispatcher chooses by
memory when the step is due, as for planning rules: it explores with a bound, and records the reason.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import count
from typing import Final, TypeAlias

from aeros.agent.planning.task_graph import PlanStep, TaskGraph, input_problems, skills_behind
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.step_graph import map_graph_steps

MAX_CHECKS: Final = 20
"""Largest number of single replacements that are tried in one plan."""

Replacements: TypeAlias = Mapping[int, PlanStep]
"""Steps that name a capability, by the place of the step that each replaces, in the order written."""


def capability_steps(
    graph: TaskGraph, modules: Mapping[str, Ecm], barred_skills: frozenset[str], preferred: str
) -> dict[int, PlanStep]:
    """Find the steps of a plan that another skill could do as well.

    Args:
        graph: a verified plan.
        modules: active modules by id.
        barred_skills: skills that must not be used, as MODULE.SKILL.
        preferred: module whose capabilities are taken first; else those with the most providers.

    Returns:
        The step that names the capability, for each of these; the plan is not checked with it yet.
    """
    found = {}
    for place, step in enumerate(graph.steps):
        # The outputs of a step with an id are read elsewhere, and other providers have other outputs.
        if step.id or step.flows:
            continue
        names = [
            (module != preferred, -len(providers), module, name)
            for module, name, providers in _capabilities(f"{step.module}.{step.skill}", modules)
            if barred_skills.isdisjoint(providers) and _fits_all(step, providers, modules)
        ]
        if names:
            *_, module, name = min(names)
            found[place] = replace(step, module=module, skill=name)
    return found


def with_capabilities(graph: TaskGraph, replacements: Replacements) -> TaskGraph:
    """Let steps of a plan name capabilities.

    Args:
        graph: the plan.
        replacements: steps in place of those of the plan.

    Returns:
        The plan with these steps.
    """
    places = count()

    def become(step: PlanStep) -> PlanStep:
        return replacements.get(next(places), step)

    return replace(graph, parts=tuple(map_graph_steps(part, become) for part in graph.parts))


def accepted_places(
    graph: TaskGraph, replacements: Replacements, is_accepted: Callable[[TaskGraph], bool]
) -> list[int]:
    """Find the replacements with which a plan still leads to the goal.

    Args:
        graph: the plan.
        replacements: those that are possible.
        is_accepted: check of a plan.

    Returns:
        Their places.
    """
    if is_accepted(with_capabilities(graph, replacements)):
        return list(replacements)
    accepted: list[int] = []
    for place in list(replacements)[:MAX_CHECKS] if len(replacements) > 1 else ():
        tried = {one: replacements[one] for one in (*accepted, place)}
        if is_accepted(with_capabilities(graph, tried)):
            accepted.append(place)
    return accepted


def _capabilities(skill: str, modules: Mapping[str, Ecm]) -> Iterator[tuple[str, str, list[str]]]:
    """Yield each capability that this skill and at least one other active skill provide."""
    for module, ecm in modules.items():
        for name in {*ecm.capabilities, *ecm.foreign.capabilities}:
            # A name with a dot is of another module, which has it itself; a composition cannot be checked.
            if "." in name or not ecm.providers(name):
                continue
            providers = skills_behind(module, name, modules)
            is_active = all(one.partition(".")[0] in modules for one in providers)
            if is_active and skill in providers and len(providers) > 1:
                yield module, name, providers


def _fits_all(step: PlanStep, providers: Sequence[str], modules: Mapping[str, Ecm]) -> bool:
    """Return True if each provider can run with the inputs of the step."""
    skills = [modules[owner].skills[name] for owner, name in (one.split(".", 1) for one in providers)]
    return not any(input_problems(skill, step.inputs) for skill in skills)
