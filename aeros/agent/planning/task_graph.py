"""Task graph of a plan, and its verification before the first step.

It consists of the same parts (`spec.model.step_graph`) as a module's compositions.

A planner is untrusted, so `verify_plan` accepts any object as input. A plan without problems is a `TaskGraph`
of active skills with fitting inputs and bounded retries, whose parallel branches share no resource, no
actuator and no effect (as `obligations.parallel` decides for compositions). Joint rules are not checked here:
the gate checks them for each action.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import islice
from typing import Any, Final, TypeAlias, cast

from aeros.agent.world.values import UnusableValueError, to_exact
from aeros.spec.diagnostics.codes import did_you_mean
from aeros.spec.diagnostics.source import Source, SourceSpan
from aeros.spec.expr import terms as t
from aeros.spec.model import composition as spec
from aeros.spec.model import step_graph as parts
from aeros.spec.model.ecm import ActionCondition, Ecm, Skill, owner_of
from aeros.spec.model.site import Site
from aeros.spec.model.step_graph import (
    MAX_DEPTH,
    MAX_RUNS,
    FailingPart,
    Fallback,
    HeldPart,
    If,
    Par,
    RetriedPart,
    Seq,
    StoppablePart,
    TimedPart,
    children_of,
    map_graph_steps,
    plan_size_fault,
    steps_of,
    walk_parts,
)
from aeros.spec.obligations.parallel import interference_claims

MAX_REMARK_CHARS: Final = 4000

PLAN_SPAN: Final = Source("plan", "plan").span(0, 4)
"""The place of what a planner makes up, and no file says."""


@dataclass(frozen=True, slots=True)
class PlanStep:
    """One skill invocation of a plan.

    Attributes:
        module: id of the module.
        skill: id of a skill, or a capability of the module; the dispatcher chooses one of its providers.
        inputs: inputs by name (SI); inputs with defaults may be left out.
        retry: number of repetitions of a failed attempt.
        between_tries: step that runs between two attempts.
        on_failure: step that runs after the last attempt has failed; then this step has failed.
        unless: the step is skipped if this is measured as true at its turn.
        needs_recovery: this step fails for good if `between_tries` does, as a step of a composition; else
            the next attempt follows, which checks its precondition.
        id: name by which other steps refer to its outputs.
        flows: for each such input, the `id` and the output of an earlier step that has succeeded.
    """

    module: str
    skill: str
    inputs: Mapping[str, Any] = field(default_factory=dict)
    retry: int = 0
    between_tries: PlanStep | None = None
    on_failure: PlanStep | None = None
    unless: t.Term | None = None
    needs_recovery: bool = False
    id: str = ""
    flows: Mapping[str, tuple[str, str]] = field(default_factory=dict)

    def __str__(self) -> str:
        notes = [f"retry {self.retry}"] if self.retry else []
        notes += [f"{word} {self.helper_name(helper)}" for word, helper in self.helpers]
        return f"{self.module}.{self.skill}" + (f" ({', '.join(notes)})" if notes else "")

    @property
    def helpers(self) -> tuple[tuple[str, PlanStep], ...]:
        """The steps that a failure leads to, each with the field that names it."""
        pairs = (("between_tries", self.between_tries), ("on_failure", self.on_failure))
        return tuple((word, helper) for word, helper in pairs if helper is not None)

    def helper_name(self, helper: PlanStep) -> str:
        """Name a step that a failure leads to, as a plan writes it.

        Args:
            helper: one of `helpers`.

        Returns:
            The skill; `MODULE.SKILL` if it is of another module than this step.
        """
        return helper.skill if helper.module == self.module else f"{helper.module}.{helper.skill}"


Part: TypeAlias = parts.Part[PlanStep]


@dataclass(frozen=True, slots=True)
class TaskGraph:
    """A plan.

    Attributes:
        parts: its parts, which run in this order.
        remark: the planner's note for the record; empty if there is none.
    """

    parts: tuple[Part, ...]
    remark: str = ""

    @property
    def body(self) -> Part:
        """All parts as one."""
        return Seq(self.parts)

    @property
    def steps(self) -> tuple[PlanStep, ...]:
        """All steps in the order written, without handlers."""
        return tuple(steps_of(self.body))


_STEP_FIELD_TYPES: Final[tuple[tuple[str, tuple[Any, ...]], ...]] = (
    ("module", (str,)),
    ("skill", (str,)),
    ("inputs", (Mapping,)),
    ("retry", (int,)),
    ("between_tries", (PlanStep, type(None))),
    ("on_failure", (PlanStep, type(None))),
    ("unless", (t.Term, type(None))),
    ("id", (str,)),
    ("flows", (Mapping,)),
)


def verify_plan(graph: object, modules: Mapping[str, Ecm], site: Site) -> list[str]:
    """List the reasons not to start a plan.

    Args:
        graph: object that a planner returned.
        modules: active modules by id.
        site: site whose limits apply.

    Returns:
        The reasons in words; empty iff the plan may be started.
    """
    if not isinstance(graph, TaskGraph) or not isinstance(graph.parts, tuple):
        return [f"the planner returned a {type(graph).__name__}, not a task graph"]
    if type(graph.remark) is not str or len(graph.remark) > MAX_REMARK_CHARS:
        return [f"its remark is not a text of at most {MAX_REMARK_CHARS} characters"]
    misshapen = _shape_problems(graph.body, 0, site.limits.retries)
    if misshapen is not None:
        return [misshapen]
    pars = (part for part in walk_parts(graph.body) if isinstance(part, Par))
    if any(not any(steps_of(branch)) for par in pars for branch in par.branches):
        return ["a branch of a `par` has no step"]
    if not graph.steps:
        return ["the plan is empty, but the goal is not reached"]
    too_large = plan_size_fault(graph.body, len(graph.steps))
    if too_large is not None:
        return [too_large]
    runs = [
        (f"step {n}{of}", run)
        for n, step in enumerate(graph.steps, 1)
        for of, run in islice(_step_and_helpers(step), MAX_RUNS + 1)
    ]
    too_large = plan_size_fault(graph.body, len(runs))
    if too_large is not None:
        return [too_large]
    malformed = [f"{which}: {text}" for which, run in runs if (text := _field_problems(run))]
    if malformed:
        return malformed
    problems = [
        f"{which}, `{run.module}.{run.skill}`: {text}"
        for which, run in runs
        for text in _step_problems(run, modules, site)
    ]
    return problems + _recovery_cycles(graph, modules) or _parallel_conflicts(graph, modules, site)


def _step_and_helpers(step: PlanStep, of: str = "", depth: int = 0) -> Iterator[tuple[str, PlanStep]]:
    """Yield a step, the steps that its failure leads to, those that their failure leads to, and so on."""
    yield of, step
    for word in ("between_tries", "on_failure") if depth < MAX_DEPTH else ():
        helper = getattr(step, word)
        if isinstance(helper, PlanStep):
            yield from _step_and_helpers(helper, f"{of}, its `{word}`", depth + 1)


def _shape_problems(part: object, depth: int, most_retries: int) -> str | None:
    """Return the reason that an object is not a graph of parts, whatever its steps are."""
    if depth > MAX_DEPTH:
        return f"the plan is nested more than {MAX_DEPTH} deep"
    match part:
        case Seq(parts=inner) if isinstance(inner, tuple):
            pass
        case Par(branches=inner, span=SourceSpan()) if isinstance(inner, tuple) and len(inner) > 1:
            pass
        case Par(span=SourceSpan()):
            return "a `par` has not two branches"
        case If(condition=condition, text=str(), span=SourceSpan()) if isinstance(condition, t.Term):
            inner = children_of(part)
        case Fallback(parts=inner, span=SourceSpan()) if isinstance(inner, tuple) and inner:
            pass
        case RetriedPart(retry=retry, span=SourceSpan()) if type(retry) is int and retry >= 0:
            if retry > most_retries:
                return f"{retry} retries of a part; this site allows 0 to {most_retries}"
            inner = children_of(part)
        case HeldPart(condition=ActionCondition(term=condition, text=str(), span=SourceSpan())) if isinstance(
            condition, t.Term
        ):
            inner = children_of(part)
        case TimedPart(timeout=Fraction() as timeout) if timeout > 0:
            inner = children_of(part)
        case FailingPart(text=str(), span=SourceSpan()):
            return None
        case Seq() | Par() | If() | Fallback() | RetriedPart() | StoppablePart() | FailingPart():
            return f"a {type(part).__name__} is malformed"
        case PlanStep():
            return None
        case _:
            return f"a {type(part).__name__} is not a step"
    faults = (_shape_problems(one, depth + 1, most_retries) for one in inner)
    return next((fault for fault in faults if fault is not None), None)


def _field_problems(step: object) -> str | None:
    if not isinstance(step, PlanStep):
        return f"a {type(step).__name__} is not a step"
    for name, allowed in _STEP_FIELD_TYPES:
        value = getattr(step, name)
        if not isinstance(value, allowed) or isinstance(value, bool):
            return f"`{name}` is of type {type(value).__name__}"
    for name, source in step.flows.items():
        if not isinstance(name, str) or not _is_source(source):
            return "`flows` does not name an output of a step for each input"
    return None


def _is_source(source: object) -> bool:
    return isinstance(source, tuple) and len(source) == 2 and all(isinstance(name, str) for name in source)


def _step_problems(step: PlanStep, modules: Mapping[str, Ecm], site: Site) -> list[str]:
    problems: list[str] = []
    if not 0 <= step.retry <= site.limits.retries:
        problems.append(f"{step.retry} retries; this site allows 0 to {site.limits.retries}")
    module = modules.get(step.module)
    if module is None:
        return [*problems, f"no active module is named `{step.module}`"]
    alternatives = module.alternatives(step.skill)
    if not alternatives:
        problems.append(_unknown_skill(step.skill, module))
    inactive: list[str] = []
    for one in alternatives:
        owners = {owner_of(name, module.id)[0] for name in one.skills}
        inactive += sorted(owners - modules.keys())[:1]
        if one.composition is None:
            problems += input_problems(module.callable_skills[one.name], step.inputs, step.flows)
        elif step.inputs or step.flows:
            problems.append(f"`{one.name}`, which provides it, has no input")
    if alternatives and len(inactive) == len(alternatives):
        problems.append(f"no active module is named `{inactive[0]}`")
    return problems


def _unknown_skill(name: str, module: Ecm) -> str:
    nearest = did_you_mean(name, module.skills)
    hint = f"; did you mean `{nearest}`?" if nearest else ""
    return f"`{module.id}` has no skill `{name}`{hint}"


def input_problems(skill: Skill, inputs: Mapping[str, Any], flows: Collection[str] = ()) -> list[str]:
    """List the reasons that a skill cannot run with these inputs.

    Args:
        skill: skill to run.
        inputs: inputs by name (SI); defaults are filled in.
        flows: names of inputs that are known only when the skill starts.

    Returns:
        The reasons in words; empty iff it can run.
    """
    problems = [f"`{name}` is not an input of it" for name in (*inputs, *flows) if name not in skill.inputs]
    for name, declared in skill.inputs.items():
        if name not in inputs:
            if declared.default_value is None and name not in flows:
                problems.append(f"it needs the input `{name}`")
            continue
        try:
            to_exact(declared, inputs[name])
        except UnusableValueError as error:
            problems.append(f"the input `{name}` {error}")
    return problems


def _recovery_cycles(graph: TaskGraph, modules: Mapping[str, Ecm]) -> list[str]:
    """Find skills whose failure leads back to them through others."""
    recoveries = [
        (skill, cure)
        for step in graph.steps
        # Handlers of a composition, whose steps have ids, are finite: `verify` refuses any that lead back.
        if step.module in modules and not step.id
        for _, helper in step.helpers
        if modules[step.module].providers(step.skill)  # what a composition runs has handlers of its own
        for skill in skills_behind(step.module, step.skill, modules)
        for cure in skills_behind(helper.module, helper.skill, modules)
    ]
    if {skill for skill, _ in recoveries}.isdisjoint(cure for _, cure in recoveries):
        return []
    import networkx as nx  # 80 ms, which plans whose recoveries have none themselves need not pay

    return [
        "a failure leads back to itself: " + " → ".join(f"`{skill}`" for skill in (*cycle, cycle[0]))
        for cycle in nx.simple_cycles(nx.DiGraph(recoveries))
    ]


def skills_behind(module: str, name: str, modules: Mapping[str, Ecm]) -> list[str]:
    """List the skills that may run where a step names a skill or a capability.

    Args:
        module: id of the module that the step names.
        name: the skill or capability of it.
        modules: active modules by id.

    Returns:
        The skills as MODULE.SKILL; empty if there is no such module, skill or capability.
    """
    ecm = modules.get(module)
    alternatives = () if ecm is None else ecm.alternatives(name)
    return [".".join(owner_of(skill, module)) for one in alternatives for skill in one.skills]


def _parallel_conflicts(graph: TaskGraph, modules: Mapping[str, Ecm], site: Site) -> list[str]:
    """Find resources, actuators and effects that parallel branches share."""
    composed = _CompositionView(modules)
    # Parts in place of steps make a graph of parts again.
    body = cast("spec.Part", map_graph_steps(graph.body, composed.part))
    composition = spec.Composition("plan", t.TRUE, None, body, composed.handlers, PLAN_SPAN)
    claims = interference_claims(composition, composed.skills, site)
    return [claim.diagnostic.headline for claim in claims if claim.diagnostic is not None]


class _CompositionView:
    """View of a plan's steps as those of a composition over the skills of all modules, by MODULE.SKILL."""

    def __init__(self, modules: Mapping[str, Ecm]) -> None:
        self._modules = modules
        self.skills: dict[str, Skill] = {}
        self.handlers: dict[str, spec.Step] = {}
        self._count = 0

    def part(self, step: PlanStep) -> spec.Part:
        """Convert a step; a capability becomes all that it may run, in sequence: any choice is checked."""
        steps = tuple(self._step(step, name) for name in self._known(step))
        return steps[0] if len(steps) == 1 else Seq(steps)

    def _known(self, step: PlanStep) -> list[str]:
        """List the skills of active modules that a step may run."""
        names = skills_behind(step.module, step.skill, self._modules)
        return [name for name in names if name.partition(".")[0] in self._modules]

    def _step(self, step: PlanStep, name: str) -> spec.Step:
        self._count += 1
        owner, _, skill = name.partition(".")
        id_ = f"{self._count} {name}"
        self.skills[name] = self._modules[owner].skills[skill]
        made = {word: self._step(helper, self._known(helper)[0]) for word, helper in step.helpers}
        self.handlers |= {one.id: one for one in made.values()}
        names = {word: one.id for word, one in made.items()}
        return spec.Step(
            id_, name, {}, {}, step.retry, names.get("between_tries"), names.get("on_failure"), PLAN_SPAN
        )
