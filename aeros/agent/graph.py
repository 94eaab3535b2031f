"""The task graph that a planner returns, and what must be true of it before its first step.

A planner is untrusted, so `verify_plan` takes anything: what it finds no problem in is a
`TaskGraph` of active skills with fitting inputs and bounded retries.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import networkx as nx

from aeros.agent.values import UnusableValueError, exact
from aeros.spec.diagnostics import did_you_mean
from aeros.spec.expr import terms as t
from aeros.spec.model import Ecm, Site, Skill

MOST_STEPS: Final = 100
"""The most steps of one plan: with the caps on retries and re-plans it bounds every run."""


@dataclass(frozen=True, slots=True)
class Step:
    """One skill invocation of a plan.

    inputs: SI, by name; those with defaults may be left out.
    retry: how often a failed try is repeated.
    on_failure: the skill of the same module, run with its default inputs, between two tries.
    unless: the step is left out where this is measured when its turn comes.
    """

    module: str
    skill: str
    inputs: Mapping[str, Any] = field(default_factory=dict)
    retry: int = 0
    on_failure: str | None = None
    unless: t.Term | None = None

    def __str__(self) -> str:
        recovery = "" if self.on_failure is None else f", on_failure {self.on_failure}"
        return f"{self.module}.{self.skill}" + (f" (retry {self.retry}{recovery})" if self.retry else "")


@dataclass(frozen=True, slots=True)
class TaskGraph:
    """A plan: its steps in order."""

    steps: tuple[Step, ...]


_FORM: Final[tuple[tuple[str, tuple[Any, ...]], ...]] = (
    ("module", (str,)),
    ("skill", (str,)),
    ("inputs", (Mapping,)),
    ("retry", (int,)),
    ("on_failure", (str, type(None))),
    ("unless", (t.Term, type(None))),
)


def verify_plan(graph: object, modules: Mapping[str, Ecm], site: Site) -> list[str]:
    """Every reason not to start this plan; empty iff it may be started.  `modules`: the active ones."""
    if not isinstance(graph, TaskGraph) or not isinstance(graph.steps, tuple):
        return [f"the planner returned a {type(graph).__name__}, not a task graph"]
    if not graph.steps:
        return ["the plan is empty, and the goal is not measured"]
    if len(graph.steps) > MOST_STEPS:
        return [f"the plan has {len(graph.steps)} steps; at most {MOST_STEPS} are allowed"]
    malformed = [f"step {n}: {text}" for n, step in enumerate(graph.steps, 1) if (text := _malformed(step))]
    if malformed:
        return malformed
    problems = [
        f"step {number}, `{step.module}.{step.skill}`: {text}"
        for number, step in enumerate(graph.steps, 1)
        for text in _step_problems(step, modules, site)
    ]
    return problems + _recovery_cycles(graph)


def _malformed(step: object) -> str | None:
    if not isinstance(step, Step):
        return f"a {type(step).__name__} is not a step"
    for name, allowed in _FORM:
        value = getattr(step, name)
        if not isinstance(value, allowed) or isinstance(value, bool):
            return f"`{name}` is of type {type(value).__name__}"
    return None


def _step_problems(step: Step, modules: Mapping[str, Ecm], site: Site) -> list[str]:
    problems: list[str] = []
    if not 0 <= step.retry <= site.limits.retries:
        problems.append(f"{step.retry} retries; this site allows 0 to {site.limits.retries}")
    module = modules.get(step.module)
    if module is None:
        return [*problems, f"no active module is named `{step.module}`"]
    skill = module.skills.get(step.skill)
    if skill is None:
        problems.append(_unknown_skill(step.skill, module))
    else:
        problems += input_problems(skill, step.inputs)
    if step.on_failure is not None:
        recovery = module.skills.get(step.on_failure)
        if recovery is None:
            problems.append("on_failure: " + _unknown_skill(step.on_failure, module))
        else:
            problems += [f"on_failure `{step.on_failure}`: {text}" for text in input_problems(recovery, {})]
    return problems


def _unknown_skill(name: str, module: Ecm) -> str:
    nearest = did_you_mean(name, module.skills)
    hint = f"; did you mean `{nearest}`?" if nearest else ""
    return f"`{module.id}` has no skill `{name}`{hint}"


def input_problems(skill: Skill, inputs: Mapping[str, Any]) -> list[str]:
    """Why `skill` cannot be run with `inputs`; empty iff it can, defaults filled in."""
    problems = [f"`{name}` is no input of it" for name in inputs if name not in skill.inputs]
    for name, declared in skill.inputs.items():
        if name not in inputs:
            if declared.default is None:
                problems.append(f"it needs the input `{name}`")
            continue
        try:
            exact(declared, inputs[name])
        except UnusableValueError as error:
            problems.append(f"the input `{name}` {error}")
    return problems


def _recovery_cycles(graph: TaskGraph) -> list[str]:
    """A skill that recovers, over whatever others, by itself: what failed cannot be its own cure."""
    recoveries = nx.DiGraph(
        (f"{step.module}.{step.skill}", f"{step.module}.{step.on_failure}")
        for step in graph.steps
        if step.on_failure is not None
    )
    return [
        "on_failure goes round in a circle: " + " → ".join(f"`{skill}`" for skill in (*cycle, cycle[0]))
        for cycle in nx.simple_cycles(recoveries)
    ]
