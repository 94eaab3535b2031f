"""Resolved module (ECM): skills, tasks and permissions. Names, types and units are settled; frozen, in SI.

Only `elaborate` builds it; obligations, the gate and planners read it.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any, Final

from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.expr import terms as t
from aeros.spec.expr.effects import QuantityRange
from aeros.spec.expr.units import format_number
from aeros.spec.model.composition import Composition, Step
from aeros.spec.model.configured import BoundNames
from aeros.spec.model.expected_time import UNKNOWN_DURATION_S
from aeros.spec.model.models import ModuleModel
from aeros.spec.model.perception import Definition, Perceiver, Thing
from aeros.spec.model.policy import Access, WorkerLimits
from aeros.spec.model.rules import Conjunct, Risk
from aeros.spec.model.step_graph import map_graph_steps, steps_of
from aeros.spec.model.task_parameters import TaskParameter
from aeros.spec.model.variables import Declared

VERDICT_VALUE: Final = re.compile(r"\{([^{}]*)\}")
"""A state variable in a verdict, whose measured value is put there."""


@dataclass(frozen=True)
class Outcome:
    """One way a skill may end.

    Attributes:
        id: name of the outcome in its skill.
        effects: value (SI) that each affected state variable has afterwards, or an increment of it
            (`aeros.spec.expr.effects`).
        failure: True if the outcome counts as a failure.
        probability: declared probability, in [0, 1]; None if none is declared.
        duration: declared duration, s; None if none is declared.
        ranges: ranges in which quantities are afterwards.
        verdict: reason why no other try can succeed, with full names of state variables in braces; empty if
            another try may.
        consequences: values of predicates with a definition that its effects do not state, and that may have
            changed; None for one that may be either (`aeros.spec.consequences`).
    """

    id: str
    effects: Mapping[str, Any]
    failure: bool
    probability: Fraction | None
    duration: Fraction | None
    ranges: tuple[QuantityRange, ...] = ()
    verdict: str = ""
    consequences: Mapping[str, bool | None] = field(default_factory=dict)

    @property
    def known_effects(self) -> Mapping[str, Any]:
        """Its effects, and the values that follow from them."""
        decided = {name: value for name, value in self.consequences.items() if value is not None}
        return {**self.effects, **decided} if decided else self.effects

    @property
    def known_duration(self) -> Fraction:
        """Its duration, s, or what an outcome without one counts as."""
        return Fraction(UNKNOWN_DURATION_S) if self.duration is None else self.duration

    @property
    def unsettled(self) -> tuple[str, ...]:
        """Predicates that may be either afterwards."""
        return tuple(name for name, value in self.consequences.items() if value is None)

    @property
    def effect_count(self) -> int:
        """Number of effects and ranges: of several measured outcomes, the one with the most counts."""
        return len(self.effects) + len(self.ranges)


@dataclass(frozen=True)
class ActionCondition:
    """Condition on actions of one kind, in an envelope or a permission.

    Attributes:
        term: the condition.
        text: its source text.
        span: place in the manifest.
        conjuncts: the conditions that the term is the conjunction of.
        kind_name: the manifest's name for the action kind; empty for a condition that is on no action.
    """

    term: t.Term
    text: str
    span: SourceSpan
    conjuncts: tuple[Conjunct, ...] = ()
    kind_name: str = ""


@dataclass(frozen=True)
class Skill:
    """Skill with its envelope by action kind.  The fields `*_span` are places in the manifest.

    Attributes:
        id: name of the skill in its module.
        module_name: Python module of its function, relative to the module's folder.
        function: name of the generator function.
        inputs: declared inputs by name.
        precondition: condition that must be measured before it starts, including the predicates of
            `hold_condition`.
        outcomes: declared outcomes by id.
        envelope: condition on the actions that it may ask for, by action kind.
        actuators: actuators that it moves.
        resources: resources of the site that it occupies while it runs.
        risk: declared risk: low, medium or high.
        timeout: seconds after which it is halted.
        runtime_checked: invariants that the envelope does not imply and the gate decides, and where each is
            listed.
        span: place of its name.
        risk_span: place of its `risk`.
        entry_span: place of its `entry`.
        outputs: declared outputs by name.
        idempotent: by its author's word, running it twice does no more than running it once.
        hold_condition: condition that must be measured as long as it runs.
        models: names of the models that it receives.
        leaves_any_to_gate: the manifest does not name the invariants that it leaves to the gate.
        wear: time that one may wait to spare the wear of one try, s.
        disturbed: predicates with a definition that it may change, and for each, in words, something that it
            follows from and the skill changes.
    """

    id: str
    module_name: str
    function: str
    inputs: Mapping[str, Declared]
    precondition: ActionCondition | None
    outcomes: Mapping[str, Outcome]
    envelope: Mapping[str, ActionCondition]
    actuators: frozenset[str]
    resources: frozenset[str]
    risk: Risk
    timeout: Fraction
    runtime_checked: Mapping[str, SourceSpan]
    span: SourceSpan
    risk_span: SourceSpan
    entry_span: SourceSpan
    outputs: Mapping[str, Declared] = field(default_factory=dict)
    idempotent: bool = False
    hold_condition: ActionCondition | None = None
    models: tuple[str, ...] = ()
    leaves_any_to_gate: bool = False
    disturbed: Mapping[str, str] = field(default_factory=dict)
    wear: Fraction = Fraction(0)

    @property
    def success_outcomes(self) -> tuple[Outcome, ...]:
        """Outcomes that are no failure."""
        return tuple(outcome for outcome in self.outcomes.values() if not outcome.failure)

    @property
    def unsettled(self) -> frozenset[str]:
        """Predicates with a definition that may be either after one of its outcomes, or after a halt."""
        after = (name for one in self.outcomes.values() for name in one.unsettled)
        return frozenset(after if self.hold_condition is None else self.disturbed)

    def failures_with_more_effects(self, outcome: Outcome) -> list[Outcome]:
        """List the failures that are measured in place of an outcome if their effects hold, too.

        The measured outcome with the most effects counts (`agent.execution.supervisor`).

        Args:
            outcome: one of the outcomes.

        Returns:
            The failures, in the order declared.
        """
        return [
            one for one in self.outcomes.values() if one.failure and one.effect_count > outcome.effect_count
        ]


@dataclass(frozen=True)
class PlanningRule:
    """Planning rule `unless CONDITION do SKILL`.

    Attributes:
        satisfied_condition: condition on the state that makes the skill unnecessary.
        text: the condition as written.
        skill: id of the skill.
        inputs: values of its inputs, SI.
        retry: number of further tries after a failure.
        between_tries: skill that runs between two tries; None for none.
        on_failure: skill that runs after the last try has failed, before the agent plans again; None for
            none.
        span: place in the manifest.
    """

    satisfied_condition: t.Term
    text: str
    skill: str
    inputs: Mapping[str, Any]
    retry: int
    between_tries: str | None
    on_failure: str | None
    span: SourceSpan


@dataclass(frozen=True)
class TaskInvariant:
    """Task invariant: a condition on the state that must hold from the start of a task to its end.

    Attributes:
        id: name of the invariant in its task.
        term: the condition.
        text: its source text.
        span: place in the manifest.
    """

    id: str
    term: t.Term
    text: str
    span: SourceSpan


@dataclass(frozen=True)
class Task:
    """Task: the words that route to it, its goal, and its planning rules in order.

    Attributes:
        id: name of the task in its module.
        trigger_phrases: patterns of phrases that ask for it: verbs, if it has object phrases.
        goal: condition on the state.
        goal_text: the goal as written.
        goal_conjuncts: the conditions that the goal is the conjunction of.
        rules: planning rules, in order.
        scene: scene that a simulator builds for it; None for those of the tasks that it composes, if any.
        invariants: conditions that must hold from its start to its end.
        span: place in the manifest.
        word_spans: places of the trigger phrases.
        initial: typical value (SI) of each state variable at the start.
        object_phrases: phrases for what it acts on, of which an instruction must name one, if there are any.
        extra_phrases: phrases that an instruction may add, and that ask for nothing more.
        condition_phrases: conditions that an instruction may make, by their phrase.
        parameters: what an instruction may say of it, by name; each is a state variable of its module.
        reported: full names of the state variables whose values a result says beside those of the goal.
        composed: tasks of required modules whose work it asks for, by module.
    """

    id: str
    trigger_phrases: tuple[str, ...]
    goal: t.Term
    goal_text: str
    rules: tuple[PlanningRule, ...]
    initial: Mapping[str, Any]
    scene: str | None
    span: SourceSpan
    invariants: tuple[TaskInvariant, ...] = ()
    goal_conjuncts: tuple[Conjunct, ...] = ()
    word_spans: tuple[SourceSpan, ...] = ()
    object_phrases: tuple[str, ...] = ()
    extra_phrases: tuple[str, ...] = ()
    condition_phrases: Mapping[str, ActionCondition] = field(default_factory=dict)
    parameters: Mapping[str, TaskParameter] = field(default_factory=dict)
    reported: tuple[str, ...] = ()
    composed: Mapping[str, Task] = field(default_factory=dict)

    @property
    def start(self) -> dict[str, Any]:
        """Typical start with what the composed tasks add; a simulator without physics starts from it."""
        of_others = {
            name: value for one in reversed([*self.composed.values()]) for name, value in one.start.items()
        }
        return of_others | dict(self.initial)

    def rehearsals(self, module: str) -> tuple[tuple[str, Task], ...]:
        """List the tasks whose scenes make up the cell in which a simulator runs it.

        Args:
            module: id of its module.

        Returns:
            Module and task of each: itself if it names a scene or composes no others.
        """
        if self.scene is not None or not self.composed:
            return ((module, self),)
        return tuple(part for id_, one in self.composed.items() for part in one.rehearsals(id_))

    def complete_arguments(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """Add the defaults to arguments.

        Args:
            given: values (SI) of some of its parameters, by name.

        Returns:
            The arguments in the order of the parameters; those without value and default are absent.
        """
        values = {name: given.get(name, one.default) for name, one in self.parameters.items()}
        return {name: one for name, one in values.items() if one is not None}


@dataclass(frozen=True)
class CapabilityInterface:
    """Promise of every alternative that provides a capability.

    Attributes:
        inputs: inputs that each has, by name, with the range that it accepts at least.
        outputs: outputs that each has, by name, with the range that it keeps.
        precondition: condition on state and inputs under which each can start; None for every state.
        achieves: condition on the state after each success; None if there is none.
        span: place of the interface in the manifest.
    """

    inputs: Mapping[str, Declared]
    outputs: Mapping[str, Declared]
    precondition: ActionCondition | None
    achieves: ActionCondition | None
    span: SourceSpan


@dataclass(frozen=True)
class Alternative:
    """One way to do what a step names.

    Attributes:
        name: name of a skill or composition; `MODULE.NAME` for one of another module.
        composition: the composition, whose steps are named as the caller names them; None for a skill.
    """

    name: str
    composition: Composition | None = None

    @property
    def skills(self) -> tuple[str, ...]:
        """The skills that it may run, as the caller names them, each once."""
        if self.composition is None:
            return (self.name,)
        steps = (*steps_of(self.composition.body), *self.composition.handlers.values())
        return tuple(dict.fromkeys(name for step in steps for name in step.runs))


@dataclass(frozen=True)
class ForeignNames:
    """The skills and capabilities of other modules that the steps of a module may name.

    Attributes:
        modules: required modules that were found, by name.
        skills: their skills by `MODULE.SKILL`, whose ids are these names.
        capabilities: alternatives by `MODULE.CAPABILITY`, and by the name of each required capability.
        owners: every module that owns one of the skills, by name.
        unsuitable: modules that provide a required capability in another version, with that version, by the
            capability's name.
    """

    modules: Mapping[str, Ecm] = field(default_factory=dict)
    skills: Mapping[str, Skill] = field(default_factory=dict)
    capabilities: Mapping[str, tuple[Alternative, ...]] = field(default_factory=dict)
    owners: Mapping[str, Ecm] = field(default_factory=dict)
    unsuitable: Mapping[str, tuple[tuple[str, str], ...]] = field(default_factory=dict)

    @property
    def public_variables(self) -> dict[str, Declared]:
        """Variables that the required modules let others read, by full name."""
        found = (variables for one in self.modules.values() for variables in one.state.items())
        return {name: declared for name, declared in found if declared.is_public}


@dataclass(frozen=True)
class Ecm:
    """Embodied Capability Module.  The fields `*span*` are places in the manifest.

    Attributes:
        id: name of the module.
        version: its version.
        folder: its folder.
        manifest_digest: SHA-256 of the manifest, in hexadecimal.
        code_digest: SHA-256 of its code files.
        capabilities: names of the skills and compositions that provide each capability, by its name.
        skills: skills by id.
        tasks: tasks by id.
        requested_access: actuators, sensors, channels and computing devices that it asks for.
        permitted_actions: condition on all its actions, by action kind.
        required_modules: other modules it depends on, by name, with a PEP 440 specifier.
        requires_spans: place of the specifier of each required module, by the module's name.
        required_aeros_version: versions of AEROS it works with, a PEP 440 specifier.
        runtime_span: place of the specifier of AEROS.
        access_span: place of its permissions.
        span: place of its name.
        compositions: compositions by id.
        model_digests: SHA-256 of each file that a model names, by its path in the module.
        models: its models by name.
        state: its own state variables by full name, as in `kettle.water_hot`; the sensor of each is the full
            name of the perceiver that provides it, or its own where it has a definition.
        perceivers: perceivers by id.
        definitions: conditions of the predicates that have one, by full name.
        things: things that its variables describe, by name.
        capability_versions: version of each of its capabilities, by name.
        required_capabilities: capabilities that it needs some module for, by name, with a PEP 440 specifier.
        capability_spans: place of each of these.
        interfaces: interface of each own or required capability that has one, by its name.
        foreign: skills and capabilities of other modules that its steps may name.
        names: the site's names for what it needs, and the values of its parameters.
        worker: limits on the processes of its skills; None for those of the site.
        access_spans: place of each name in its permissions, by the module's own name.
    """

    id: str
    version: str
    folder: str
    manifest_digest: str
    code_digest: str
    capabilities: Mapping[str, tuple[str, ...]]
    skills: Mapping[str, Skill]
    tasks: Mapping[str, Task]
    requested_access: Access
    permitted_actions: Mapping[str, ActionCondition]
    required_modules: Mapping[str, str]
    requires_spans: Mapping[str, SourceSpan]
    required_aeros_version: str
    runtime_span: SourceSpan
    access_span: SourceSpan
    span: SourceSpan
    compositions: Mapping[str, Composition] = field(default_factory=dict)
    model_digests: Mapping[str, str] = field(default_factory=dict)
    models: Mapping[str, ModuleModel] = field(default_factory=dict)
    state: Mapping[str, Declared] = field(default_factory=dict)
    perceivers: Mapping[str, Perceiver] = field(default_factory=dict)
    definitions: Mapping[str, Definition] = field(default_factory=dict)
    things: Mapping[str, Thing] = field(default_factory=dict)
    capability_versions: Mapping[str, str] = field(default_factory=dict)
    required_capabilities: Mapping[str, str] = field(default_factory=dict)
    capability_spans: Mapping[str, SourceSpan] = field(default_factory=dict)
    interfaces: Mapping[str, CapabilityInterface] = field(default_factory=dict)
    foreign: ForeignNames = field(default_factory=ForeignNames)
    names: BoundNames = field(default_factory=BoundNames)
    worker: WorkerLimits | None = None
    access_spans: Mapping[str, SourceSpan] = field(default_factory=dict)

    @property
    def configuration(self) -> Mapping[str, str]:
        """The site's name for everything that it needs, and the value of each parameter, by its own names."""
        return {**self.names.bindings, **self.names.parameters}

    @property
    def behaviour_digest(self) -> str:
        """Digest of its code and of the values of its parameters, which decide how well its skills do.

        That of its code alone if it has no parameters.
        """
        if not self.names.parameters:
            return self.code_digest
        values = json.dumps([self.code_digest, dict(self.names.parameters)], sort_keys=True)
        return hashlib.sha256(values.encode()).hexdigest()

    @property
    def task_parameters(self) -> Mapping[str, TaskParameter]:
        """Parameters of all its tasks, by full name."""
        return {one.full_name: one for task in self.tasks.values() for one in task.parameters.values()}

    @property
    def used_models(self) -> frozenset[str]:
        """Names of the models that its skills and perceivers receive."""
        of_skills = (name for skill in self.skills.values() for name in skill.models)
        return frozenset((*of_skills, *(name for one in self.perceivers.values() for name in one.models)))

    @property
    def with_owners(self) -> tuple[Ecm, ...]:
        """The module, and all others whose skills its steps may run."""
        return (self, *self.foreign.owners.values())

    @property
    def resources(self) -> Mapping[str, str]:
        """Limits that it declares on the processes of its skills, and shares of a core of its perceivers."""
        limits: dict[str, str] = {}
        if self.worker is not None:
            limits["skills.memory"] = f"{self.worker.memory >> 20} MiB"
            limits["skills.answer_within"] = f"{format_number(self.worker.answer_within)} s"
            limits["skills.processor"] = f"{format_number(self.worker.processor * 100)} %"
        for name, perceiver in self.perceivers.items():
            if perceiver.processor < 1:
                limits[f"{name}.processor"] = f"{format_number(perceiver.processor * 100)} %"
        return limits

    @property
    def callable_skills(self) -> Mapping[str, Skill]:
        """The skills that its steps may run: its own by name, others by `MODULE.SKILL`."""
        return {**self.skills, **self.foreign.skills} if self.foreign.skills else self.skills

    def alternatives(self, name: str) -> tuple[Alternative, ...]:
        """Return the ways any of which may be taken where a step names a skill or a capability.

        Args:
            name: name of a skill or capability; `MODULE.NAME` for one of a required module.

        Returns:
            The alternatives; empty if there is nothing of that name.
        """
        if name in self.skills or name in self.foreign.skills:
            return (Alternative(name),)
        if name in self.capabilities:
            names = self.capabilities[name]
            if not all(one in self.skills or one in self.compositions for one in names):
                return ()
            own = tuple(Alternative(one, self.compositions.get(one)) for one in names)
            return own + self.foreign.capabilities.get(name, ())  # of others if it requires it, too
        return self.foreign.capabilities.get(name, ())

    def providers(self, name: str) -> tuple[str, ...]:
        """Return the skills any of which may run where a step names a skill or a capability.

        Args:
            name: name of a skill, or of a capability that skills alone provide; `MODULE.NAME` for one of a
                required module.

        Returns:
            Names of the skills, as in `callable_skills`; empty if `name` is neither.
        """
        found = self.alternatives(name)
        return tuple(one.name for one in found) if all(one.composition is None for one in found) else ()


def owner_of(name: str, module: str) -> tuple[str, str]:
    """Split the name by which a module calls a skill or capability.

    Args:
        name: a name of its own, or `MODULE.NAME`.
        module: id of the calling module.

    Returns:
        The module that owns it, and its name there.
    """
    owner, dot, own_name = name.rpartition(".")
    return (owner, own_name) if dot else (module, name)


def as_seen_by_others(module: str, composition: Composition) -> Composition:
    """Name the steps of a composition as another module names them.

    Args:
        module: id of the module that declares it.
        composition: the composition.

    Returns:
        The composition with each skill as `MODULE.SKILL`.
    """

    def renamed(step: Step) -> Step:
        names = tuple(".".join(owner_of(name, module)) for name in step.runs)
        return replace(step, skill=".".join(owner_of(step.skill, module)), choices=names)

    handlers = {name: renamed(step) for name, step in composition.handlers.items()}
    return replace(composition, body=map_graph_steps(composition.body, renamed), handlers=handlers)
