"""Schema of `ecm.yaml`, unresolved and closed.

`E = (C, S, M, P, D)` of the paper: capabilities, skills, models and tools, permissions, dependencies and
metadata; and the planning rules of its tasks.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

from aeros.spec.declared.capability import Capability, RequiredCapability
from aeros.spec.declared.composition import Composition
from aeros.spec.declared.configuration import Need, Parameter
from aeros.spec.declared.field_types import ByVariable, Identifier, Named, Reference, RiskWord, Slug
from aeros.spec.declared.models import Model, UsedModels
from aeros.spec.declared.perception import OwnVariable, Perceiver, Thing
from aeros.spec.declared.policy import Access
from aeros.spec.declared.quantity import Quantity
from aeros.spec.declared.task_parameters import TaskParameter
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.text.fields import (
    BooleanField,
    ExpressionField,
    IntegerField,
    MappingField,
    NumberField,
    Pattern,
    TextField,
    ValueBounds,
)


@dataclass(frozen=True)
class Input(Quantity):
    """A typed input of a skill."""

    default: ExpressionField | None = field(
        default=None, metadata={"doc": "its value if a step gives none, as in `default: 200 mm/s`"}
    )


@dataclass(frozen=True)
class Outcome:
    """One possible end of a skill.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    effects: ByVariable[ExpressionField] = field(
        default=MappingField(),
        metadata={
            "doc": "the state after this outcome, as in `effects: {wrapper_aligned: true}`; `+= 1` counts a "
            "whole number, `in [380 mm, 420 mm]` says where a quantity or a component, as `position.y`, is"
        },
    )
    failure: BooleanField | None = field(
        default=None, metadata={"doc": "`true` if this outcome is a failure"}
    )
    probability: NumberField | None = field(
        default=None,
        metadata={
            "doc": "its probability, between 0 and 1; one of 0 is left out of proofs and predictions about "
            "tasks, for what ends a task such as an object that is not there; `aeros verify` lists them"
        },
    )
    duration: TextField | None = field(default=None, metadata={"doc": "its usual duration, as in `12 s`"})
    verdict: TextField | None = field(
        default=None,
        metadata={
            "doc": "of a failure that another try cannot change: its reason, with measured values in braces; "
            "the task is given up, or help is asked for, as in `verdict: out of reach at {object_position}`"
        },
    )


@dataclass(frozen=True)
class Skill:
    """An atomic executable, and the actions that it may ask for.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    description: TextField = field(metadata={"doc": "the skill's purpose, for people"})
    entry: Annotated[TextField, Pattern("entry")] = field(
        metadata={"doc": "the generator function, as in `entry: skills:wrap`"}
    )
    outcomes: Named[Outcome] = field(metadata={"doc": "all its possible outcomes"})
    envelope: Named[ExpressionField] = field(
        metadata={"doc": "the actions that it may ask for, as in `grip: force <= 12 N`"}
    )
    risk: RiskWord = field(metadata={"doc": "`low`, `medium` or `high`"})
    timeout: TextField = field(metadata={"doc": "the time after which it is halted, as in `timeout: 60 s`"})
    wear: TextField | None = field(
        default=None,
        metadata={
            "doc": "the time that one may wait to spare the robot the wear of one try, as in `wear: 20 s`; "
            "it is added to the time of each try where a skill or a plan is chosen"
        },
    )
    inputs: Named[Input] = field(default=MappingField(), metadata={"doc": "typed inputs"})
    outputs: Named[Quantity] = field(
        default=MappingField(), metadata={"doc": "the values that it may return at its end"}
    )
    models: UsedModels = field(
        default=(),
        metadata={"doc": "models that it receives as a third argument, as in `models: [policy]`"},
    )
    idempotent: BooleanField | None = field(
        default=None,
        metadata={
            "doc": "`true` if running it twice has the effect of once, so a crashed run may be repeated"
        },
    )
    precondition: ExpressionField | None = field(
        default=None, metadata={"doc": "the condition that must hold before it starts"}
    )
    hold: ExpressionField | None = field(
        default=None,
        metadata={"doc": "the condition that must hold while it runs; otherwise it is halted"},
    )
    actuators: tuple[Identifier, ...] = field(default=(), metadata={"doc": "the actuators that it moves"})
    resources: tuple[Identifier, ...] = field(
        default=(), metadata={"doc": "the resources that it holds while it runs"}
    )
    gated: tuple[Slug, ...] = field(
        default=(),
        metadata={
            "doc": "invariants that its envelope does not imply; the gate checks them at run time; `[any]` "
            "for all such invariants of any site"
        },
    )


@dataclass(frozen=True)
class PlanningRule:
    """`unless CONDITION do SKILL retry N between_tries SKILL on_failure SKILL`, or `do CAPABILITY`.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    unless: ExpressionField = field(metadata={"doc": "the step is skipped if this condition holds"})
    do: Reference = field(
        metadata={
            "doc": "the skill of the step, or a capability: one of its alternatives runs; `MODULE.NAME` if "
            "it is of a required module"
        }
    )
    inputs: Named[ExpressionField] = field(
        default=MappingField(), metadata={"doc": "inputs, as in `inputs: {force: 8 N}`"}
    )
    retry: Annotated[IntegerField, ValueBounds(0, 100)] | None = field(
        default=None, metadata={"doc": "how many times a failed step is retried"}
    )
    between_tries: Reference | None = field(
        default=None, metadata={"doc": "the skill that runs between two tries"}
    )
    on_failure: Reference | None = field(
        default=None,
        metadata={"doc": "the skill that runs when the last try has failed, before the agent plans again"},
    )


@dataclass(frozen=True)
class TaskInvariant:
    """Condition that holds from the start of a task to its end, for all outcomes of its skills.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    id: Slug = field(metadata={"doc": "its name, as in `wrapped-before-cooked`"})
    require: ExpressionField = field(metadata={"doc": "the condition that holds in every reachable state"})


@dataclass(frozen=True)
class NamedCondition:
    """Condition on the state, with the words that people use for it.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    words: tuple[TextField, ...] = field(
        metadata={"doc": "the phrases for it, as in `words: [the table is dirty]`"}
    )
    require: ExpressionField = field(metadata={"doc": "the condition, as in `require: not table_wiped`"})


@dataclass(frozen=True)
class Task:
    """A goal that a person can ask for, and the rules that lead to it from any state.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    description: TextField = field(metadata={"doc": "the task's result, for people"})
    words: tuple[TextField, ...] = field(
        metadata={
            "doc": "the phrases that ask for this task: verbs, as in `words: [clean, tidy up]`, if it has "
            "`objects`; verbs may be said in their -ing form; words in brackets may be left out, and of "
            "those parted by bars one is said, as in `clear (all) the (clutter|mess) from`"
        }
    )
    goal: ExpressionField = field(metadata={"doc": "the condition that must hold at the end"})
    rules: tuple[PlanningRule, ...] = field(metadata={"doc": "the planning rules, in order"})
    initial: ByVariable[ExpressionField] = field(
        default=MappingField(),
        metadata={
            "doc": "the typical state at the start, as in `door_open: true`; a simulator takes what is "
            "absent from the tasks of required modules that it composes"
        },
    )
    invariants: tuple[TaskInvariant, ...] = field(
        default=(), metadata={"doc": "conditions that hold from the start to the end, proved for every path"}
    )
    scene: Identifier | None = field(
        default=None,
        metadata={
            "doc": "the simulated scene in which the task can be rehearsed; those of the tasks of required "
            "modules that it composes if absent, as in `scene: fetch`"
        },
    )
    objects: tuple[TextField, ...] = field(
        default=(),
        metadata={
            "doc": "the phrases for what it acts on, one of which an instruction must name: in the singular "
            "for one thing, in the plural if the task is done for all there are, as in `objects: [table]`"
        },
    )
    extras: tuple[TextField, ...] = field(
        default=(),
        metadata={
            "doc": "phrases that may be said as well and ask for nothing more; words in brackets may be left "
            "out, and articles are free, as in `extras: [to me, into (two) trays]`"
        },
    )
    conditions: tuple[NamedCondition, ...] = field(
        default=(),
        metadata={"doc": "conditions that an instruction may make, with their words"},
    )
    parameters: Named[TaskParameter] = field(
        default=MappingField(),
        metadata={
            "doc": "parts that an instruction says, as in `parameters: {object: {type: objects}}`; each is a "
            "state variable of the module"
        },
    )
    report: tuple[Annotated[TextField, Pattern("dotted")], ...] = field(
        default=(),
        metadata={
            "doc": "state variables whose values the result of a run says beside those of the goal, as in "
            "`report: [shelf_full]`"
        },
    )


@dataclass(frozen=True)
class WorkerLimits:
    """Limits on the process of each of its skills, within those of the site.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    memory: TextField | None = field(
        default=None, metadata={"doc": "the memory that it needs at most, as in `memory: 64 MiB`"}
    )
    answer_within: TextField | None = field(
        default=None,
        metadata={
            "doc": "the real time that it needs at most before each action, as in `answer_within: 1 s`"
        },
    )
    processor: TextField | None = field(
        default=None,
        metadata={"doc": "the share of one core that it needs at most, as in `processor: 50 %`"},
    )


@dataclass(frozen=True)
class Permissions(Access):
    """Permissions (P): the access that the module asks for, and the largest set of its actions."""

    actions: Named[ExpressionField] = field(
        default=MappingField(),
        kw_only=True,
        metadata={
            "doc": "the widest set of actions that its skills may ask for, as in `grip: force <= 15 N`"
        },
    )
    worker: WorkerLimits | None = field(
        default=None,
        kw_only=True,
        metadata={"doc": "limits on the processes of its skills; those of the site if absent"},
    )


@dataclass(frozen=True)
class Dependencies:
    """Versions of AEROS and other modules that the module needs.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    aeros: TextField = field(
        metadata={"doc": 'the versions of AEROS that it works with, as in `aeros: ">=0.1,<0.2"`'}
    )
    modules: Named[TextField] = field(
        default=MappingField(), metadata={"doc": "other modules and their versions"}
    )
    capabilities: Named[TextField | RequiredCapability] = field(
        default=MappingField(),
        metadata={
            "doc": "capabilities of any other modules and their versions, as in "
            '`capabilities: {grasping: ">=1.2"}`, or with the interface that it relies on'
        },
    )

    @property
    def required_capabilities(self) -> tuple[tuple[TextField, RequiredCapability], ...]:
        """The required capabilities in one form, each with its name."""
        return tuple(
            (name, RequiredCapability(one.span, one) if isinstance(one, TextField) else one)
            for name, one in self.capabilities
        )


@dataclass(frozen=True)
class Ecm:
    """A whole `ecm.yaml`.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    schema: Literal["aeros/ecm/2"] = field(metadata={"doc": "`schema: aeros/ecm/2`"})
    id: Identifier = field(metadata={"doc": "the module's name, the name of its folder"})
    version: TextField = field(metadata={"doc": "its semantic version, as in `version: 1.0.0`"})
    description: TextField = field(metadata={"doc": "the module's purpose, for people"})
    license: TextField = field(metadata={"doc": "an SPDX expression, as in `license: Apache-2.0`"})
    capabilities: Named[Capability] = field(
        default=MappingField(), kw_only=True, metadata={"doc": "the capabilities that it gives the robot"}
    )
    skills: Named[Skill] = field(
        default=MappingField(),
        kw_only=True,
        metadata={"doc": "its skills; a module without any runs those of the modules that it requires"},
    )
    permissions: Permissions = field(metadata={"doc": "the actions and access that it may use at most"})
    dependencies: Dependencies = field(metadata={"doc": "the versions and modules that it requires"})
    compositions: Named[Composition] = field(
        default=MappingField(), metadata={"doc": "graphs of skills that are proved together"}
    )
    tasks: Named[Task] = field(default=MappingField(), metadata={"doc": "tasks that a person can ask for"})
    models: Named[Model] = field(
        default=MappingField(), metadata={"doc": "networks, tables and files that its skills use"}
    )
    needs: Named[Need] = field(
        default=MappingField(),
        metadata={
            "doc": "things of the site that it calls by names of its own, as in "
            "`needs: {surface: {is: volume, offers: surface}}`"
        },
    )
    parameters: Named[Parameter] = field(
        default=MappingField(),
        metadata={
            "doc": "constants that `aeros configure` sets, as in "
            "`parameters: {cooking_time: {type: real, unit: s, range: [2, 20], default: 6 s}}`"
        },
    )
    state: Named[OwnVariable] = field(
        default=MappingField(),
        metadata={
            "doc": "predicates and quantities that it measures itself, as in "
            "`state: {water_hot: {type: bool, max_age: 10 s}}`"
        },
    )
    perceivers: Named[Perceiver] = field(
        default=MappingField(), metadata={"doc": "the functions that measure them"}
    )
    things: Named[Thing] = field(
        default=MappingField(),
        metadata={
            "doc": "the things that these describe, for the world model, as in "
            "`things: {cube: {kind: cube, position: cube_position, held: cube_held}}`"
        },
    )

    @property
    def capability_versions(self) -> dict[str, str]:
        """Version of each capability by its name; the module's where a capability has none."""
        return {name.value: (one.version or self.version).value for name, one in self.capabilities}
