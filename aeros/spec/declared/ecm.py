"""Schema of `ecm.yaml`, unresolved and closed.

`E = (C, S, M, P, D)` of the paper: capabilities, skills, models and tools, permissions, dependencies and
metadata; and the planning rules of its tasks.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

from aeros.spec.declared.composition import Composition
from aeros.spec.declared.site import Access, Identifier, Named, Quantity, RiskWord, Slug
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
        default=None, metadata={"doc": "its value when a step gives none, as in `default: 200 mm/s`"}
    )


@dataclass(frozen=True)
class Outcome:
    """One way in which a skill may end."""

    span: SourceSpan
    effects: Named[ExpressionField] = field(
        default=MappingField(),
        metadata={"doc": "what is then measured, as in `effects: {wrapper_aligned: true}`"},
    )
    failure: BooleanField | None = field(
        default=None, metadata={"doc": "`true` if the skill has then failed"}
    )
    probability: NumberField | None = field(
        default=None, metadata={"doc": "how likely it is, between 0 and 1"}
    )
    duration: TextField | None = field(
        default=None, metadata={"doc": "how long it usually takes, as in `12 s`"}
    )


@dataclass(frozen=True)
class Skill:
    """An atomic executable and everything it may ask for."""

    span: SourceSpan
    description: TextField = field(metadata={"doc": "what the skill does"})
    entry: Annotated[TextField, Pattern("entry")] = field(
        metadata={"doc": "the generator function, as in `entry: skills:wrap`"}
    )
    outcomes: Named[Outcome] = field(metadata={"doc": "every way in which it may end"})
    envelope: Named[ExpressionField] = field(
        metadata={"doc": "which actions it may ask for, as in `grip: force <= 12 N`"}
    )
    risk: RiskWord = field(metadata={"doc": "`low`, `medium` or `high`"})
    timeout: TextField = field(metadata={"doc": "when it is halted, as in `timeout: 60 s`"})
    inputs: Named[Input] = field(default=MappingField(), metadata={"doc": "typed inputs"})
    outputs: Named[Quantity] = field(
        default=MappingField(), metadata={"doc": "what it may return at its end"}
    )
    idempotent: BooleanField | None = field(
        default=None,
        metadata={"doc": "`true` if running it twice does no more than once, so that it may follow a crash"},
    )
    precondition: ExpressionField | None = field(
        default=None, metadata={"doc": "what must be measured before it starts"}
    )
    hold: ExpressionField | None = field(
        default=None,
        metadata={"doc": "what must be measured as long as it runs; it is halted once it is not"},
    )
    actuators: tuple[Identifier, ...] = field(default=(), metadata={"doc": "what it moves"})
    resources: tuple[Identifier, ...] = field(default=(), metadata={"doc": "what it holds while it runs"})
    gated: tuple[Slug, ...] = field(
        default=(),
        metadata={"doc": "invariants that its envelope does not imply: the gate decides them, each time"},
    )


@dataclass(frozen=True)
class Capability:
    """Something that skills provide; a step that names it runs any one of them, so each must do alone."""

    span: SourceSpan
    description: TextField = field(metadata={"doc": "what the robot can then do"})
    provided_by: tuple[Identifier, ...] = field(
        metadata={"doc": "skills or compositions, as in `provided_by: [wrap]`"}
    )


@dataclass(frozen=True)
class PlanningRule:
    """`unless CONDITION do SKILL retry N on_failure SKILL`, or `do CAPABILITY`."""

    span: SourceSpan
    unless: ExpressionField = field(metadata={"doc": "the step is left out where this is measured"})
    do: Identifier = field(metadata={"doc": "the skill of the step, or a capability: any one of its skills"})
    inputs: Named[ExpressionField] = field(
        default=MappingField(), metadata={"doc": "inputs, as in `inputs: {force: 8 N}`"}
    )
    retry: Annotated[IntegerField, ValueBounds(0, 100)] | None = field(
        default=None, metadata={"doc": "how often a failed step is tried again"}
    )
    on_failure: Identifier | None = field(default=None, metadata={"doc": "the skill run between two tries"})


@dataclass(frozen=True)
class TaskInvariant:
    """Condition that stays measured all through a task, whatever outcomes its skills have."""

    span: SourceSpan
    id: Slug = field(metadata={"doc": "its name, as in `wrapped-before-cooked`"})
    require: ExpressionField = field(metadata={"doc": "what is measured in every state that can be reached"})


@dataclass(frozen=True)
class Task:
    """Something a person can ask for, and how to get there from any state."""

    span: SourceSpan
    description: TextField = field(metadata={"doc": "what the person gets"})
    words: tuple[TextField, ...] = field(metadata={"doc": "the words that route an instruction to this task"})
    goal: ExpressionField = field(metadata={"doc": "what must be measured at the end"})
    rules: tuple[PlanningRule, ...] = field(metadata={"doc": "the planning rules, in order"})
    initial: Named[ExpressionField] = field(
        default=MappingField(),
        metadata={"doc": "what is typically measured at the start, as in `door_open: true`"},
    )
    invariants: tuple[TaskInvariant, ...] = field(
        default=(), metadata={"doc": "what stays measured from the start to the end, proved of every path"}
    )
    scene: Identifier | None = field(
        default=None, metadata={"doc": "the simulated scene in which the task can be rehearsed"}
    )


@dataclass(frozen=True)
class Tool:
    """A model or tool adapter that skills use."""

    span: SourceSpan
    description: TextField = field(metadata={"doc": "what it is for"})
    kind: Literal["model", "tool"] = field(metadata={"doc": "`model` or `tool`"})
    file: TextField | None = field(default=None, metadata={"doc": "a file of this module it is read from"})


@dataclass(frozen=True)
class Permissions(Access):
    """`P`: what the module asks to be permitted, and which actions at most."""

    actions: Named[ExpressionField] = field(
        kw_only=True, metadata={"doc": "which actions at most, as in `grip: force <= 15 N`"}
    )


@dataclass(frozen=True)
class Dependencies:
    """Versions of AEROS and other modules that the module needs."""

    span: SourceSpan
    aeros: TextField = field(metadata={"doc": 'the runtimes it works with, as in `aeros: ">=0.1,<0.2"`'})
    modules: Named[TextField] = field(
        default=MappingField(), metadata={"doc": "other modules and their versions"}
    )


@dataclass(frozen=True)
class Ecm:
    """A whole `ecm.yaml`."""

    span: SourceSpan
    schema: Literal["aeros/ecm/1"] = field(metadata={"doc": "`schema: aeros/ecm/1`"})
    id: Identifier = field(metadata={"doc": "the module's name, the name of its folder"})
    version: TextField = field(metadata={"doc": "its semantic version, as in `version: 1.0.0`"})
    description: TextField = field(metadata={"doc": "what it is, for people"})
    license: TextField = field(metadata={"doc": "an SPDX expression, as in `license: Apache-2.0`"})
    capabilities: Named[Capability] = field(metadata={"doc": "what it makes the robot able to do"})
    skills: Named[Skill] = field(metadata={"doc": "its skills"})
    permissions: Permissions = field(metadata={"doc": "the most it may ever do"})
    dependencies: Dependencies = field(metadata={"doc": "what it needs around it"})
    compositions: Named[Composition] = field(
        default=MappingField(), metadata={"doc": "skills put together, proved together"}
    )
    tasks: Named[Task] = field(default=MappingField(), metadata={"doc": "what a person can ask for"})
    models: Named[Tool] = field(default=MappingField(), metadata={"doc": "models and tool adapters"})
