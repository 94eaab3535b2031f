"""Schema of a site file, unresolved and closed.

Names and units are still text; `elaborate.site` gives them meaning.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal, TypeVar

from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.text.fields import (
    BooleanField,
    ChoiceField,
    ExpressionField,
    IntegerField,
    MappingField,
    NumberField,
    Pattern,
    TextField,
    ValueBounds,
)

Identifier = Annotated[TextField, Pattern("identifier")]
Slug = Annotated[TextField, Pattern("slug")]
_T = TypeVar("_T")
Named = Annotated[MappingField[_T], Pattern("identifier")]
"""A mapping whose keys are identifiers."""
RiskWord = ChoiceField[Literal["low", "medium", "high"]]


@dataclass(frozen=True)
class Quantity:
    """A typed variable: its type, unit and bounds."""

    span: SourceSpan
    type: TextField = field(
        metadata={"doc": "`bool`, `int`, `real`, `vec3` or the name of an enum, as in `type: real`"}
    )
    unit: TextField | None = field(default=None, metadata={"doc": "the unit of `range`, as in `unit: mm/s`"})
    range: tuple[NumberField, ...] | None = field(
        default=None, metadata={"doc": "lowest and highest value, as in `range: [0, 3]`"}
    )
    description: TextField | None = field(default=None, metadata={"doc": "its meaning, for people"})


@dataclass(frozen=True)
class StateVariable(Quantity):
    """One measured quantity of the vocabulary."""

    index: Identifier | None = field(
        default=None, metadata={"doc": "one value for each member of this enum, as in `index: joints`"}
    )
    sensor: Identifier = field(
        kw_only=True, metadata={"doc": "the sensor that measures it, as in `sensor: area_scanner`"}
    )
    max_age: TextField = field(
        kw_only=True, metadata={"doc": "older values are unknown, as in `max_age: 100 ms`"}
    )


@dataclass(frozen=True)
class Constant:
    """A named constant, or one for each member of an enum."""

    span: SourceSpan
    value: ExpressionField | None = field(default=None, metadata={"doc": "the value, as in `value: 500 mm`"})
    unit: TextField | None = field(default=None, metadata={"doc": "the unit of `values`, as in `unit: rad`"})
    index: Identifier | None = field(default=None, metadata={"doc": "the enum that indexes `values`"})
    values: tuple[NumberField, ...] | None = field(
        default=None, metadata={"doc": "one value for each member, in order"}
    )
    source: TextField | None = field(default=None, metadata={"doc": "the source of the number"})


@dataclass(frozen=True)
class Volume:
    """An axis-aligned box in the world frame W."""

    span: SourceSpan
    lower: tuple[TextField, ...] = field(
        metadata={"doc": "lower corner, as in `lower: [0.1 m, -0.6 m, 0 m]`"}
    )
    upper: tuple[TextField, ...] = field(
        metadata={"doc": "upper corner, as in `upper: [0.8 m, 0.6 m, 0.9 m]`"}
    )
    description: TextField | None = field(default=None, metadata={"doc": "its meaning, for people"})


@dataclass(frozen=True)
class ActionKind:
    """One kind of action that a skill may ask for."""

    span: SourceSpan
    description: TextField = field(metadata={"doc": "the plant's reaction, for people"})
    risk: RiskWord = field(metadata={"doc": "the least risk that a skill must declare to ask for it"})
    actuators: tuple[Identifier, ...] = field(
        default=(), metadata={"doc": "the actuators that it moves, as in `actuators: [arm]`"}
    )
    protective: BooleanField | None = field(
        default=None, metadata={"doc": "`true` for the protective stop, which every state must allow"}
    )
    parameters: Named[Quantity] = field(default=MappingField(), metadata={"doc": "typed parameters"})


@dataclass(frozen=True)
class Invariant:
    """A rule of the site (Φ): a condition that must hold for every state and action."""

    span: SourceSpan
    id: Slug = field(metadata={"doc": "a short name, as in `id: workspace`"})
    require: ExpressionField = field(metadata={"doc": "the condition, as in `require: speed <= 250 mm/s`"})
    rationale: TextField = field(metadata={"doc": "the reason for the rule"})
    source: TextField = field(metadata={"doc": "its source: a standard, data sheet or assessment"})
    on: tuple[Identifier, ...] | None = field(
        default=None, metadata={"doc": "the action kinds it governs; all but the protective stop if absent"}
    )
    attenuate: Named[ExpressionField] = field(
        default=MappingField(),
        metadata={"doc": "the reduced value of a violating parameter, as in `speed: min(speed, 0.25 m/s)`"},
    )


@dataclass(frozen=True)
class JointInvariant:
    """A rule about two actions that are executed at the same time."""

    span: SourceSpan
    id: Slug = field(metadata={"doc": "a short name, as in `id: combined-speed`"})
    on: Named[Identifier] = field(
        metadata={"doc": "two roles, each of an action kind, as in `on: {a: move_tool, b: move_base}`"}
    )
    require: ExpressionField = field(
        metadata={"doc": "the condition, as in `require: a.speed + b.speed <= 500 mm/s`"}
    )
    rationale: TextField = field(metadata={"doc": "the reason for the rule"})
    source: TextField = field(metadata={"doc": "its source: a standard, data sheet or assessment"})


@dataclass(frozen=True)
class MotionKind:
    """Meaning of an action kind's parameters for its motion."""

    span: SourceSpan
    tool_ends_at: Identifier | None = field(
        default=None, metadata={"doc": "the parameter with the tool's final position in W"}
    )
    joints_end_at: tuple[Identifier, ...] | None = field(
        default=None,
        metadata={"doc": "the parameters with the final joint positions, in order, as in `[q1, q2]`"},
    )
    base_ends_at: tuple[Identifier, ...] | None = field(
        default=None, metadata={"doc": "the parameters with the base's final position in W, as in `[x, y]`"}
    )
    peak_speed: Identifier | None = field(
        default=None,
        metadata={
            "doc": "the parameter that bounds the tool's speed in W; the base's, if only the base moves"
        },
    )


@dataclass(frozen=True)
class JointLimits:
    """Names of constants with the limits of the joints, one value for each joint."""

    span: SourceSpan
    lowest: Identifier = field(metadata={"doc": "lowest positions"})
    highest: Identifier = field(metadata={"doc": "highest positions"})
    speed: Identifier = field(metadata={"doc": "greatest speeds"})
    acceleration: Identifier = field(metadata={"doc": "greatest accelerations"})
    jerk: Identifier = field(metadata={"doc": "greatest jerks"})


@dataclass(frozen=True)
class ToolLimits:
    """Names of constants with the limits of the tool point."""

    span: SourceSpan
    speed: Identifier = field(metadata={"doc": "greatest speed"})
    acceleration: Identifier = field(metadata={"doc": "greatest acceleration"})
    jerk: Identifier = field(metadata={"doc": "greatest jerk"})
    turning_speed: Identifier = field(metadata={"doc": "greatest rotational speed"})
    turning_acceleration: Identifier = field(metadata={"doc": "greatest rotational acceleration"})
    turning_jerk: Identifier = field(metadata={"doc": "greatest rotational jerk"})


@dataclass(frozen=True)
class BaseLimits:
    """Names of constants with the limits of the base."""

    span: SourceSpan
    speed: Identifier = field(metadata={"doc": "greatest speed"})
    acceleration: Identifier = field(metadata={"doc": "greatest acceleration"})


@dataclass(frozen=True)
class Barrier:
    """A volume that links must stay out of, or inside, during every motion."""

    span: SourceSpan
    id: Slug = field(metadata={"doc": "a short name, as in `id: into-the-bench`"})
    volume: Identifier = field(metadata={"doc": "a volume of the site"})
    keep: ChoiceField[Literal["out", "in"]] = field(
        metadata={"doc": "`out`: links stay outside; `in`: they stay inside"}
    )
    rationale: TextField = field(metadata={"doc": "the reason for the barrier"})
    frame: ChoiceField[Literal["world", "base"]] | None = field(
        default=None, metadata={"doc": "the frame of the volume's corners; `world` if absent"}
    )
    links: tuple[Identifier, ...] | None = field(
        default=None, metadata={"doc": "the links that it applies to; all if absent"}
    )


@dataclass(frozen=True)
class MotionPolicy:
    """Limits that the gate checks on the whole trajectory of an action before it starts."""

    span: SourceSpan
    on: Named[MotionKind] = field(metadata={"doc": "the action kinds that move the robot"})
    starts_at: Identifier = field(metadata={"doc": "the state variable that measures the joints"})
    starts_within: TextField = field(
        metadata={"doc": "greatest distance from the measured joints to a motion's start, as in `50 mrad`"}
    )
    ends_within: TextField = field(
        metadata={"doc": "greatest distance from the target to a motion's end, as in `1 mm`"}
    )
    joints: JointLimits = field(metadata={"doc": "limits of the joints"})
    tool: ToolLimits = field(metadata={"doc": "limits of the tool point"})
    clearance: TextField = field(metadata={"doc": "the distance of links from every barrier, as in `20 mm`"})
    base: BaseLimits | None = field(default=None, metadata={"doc": "limits of a base that drives"})
    barriers: tuple[Barrier, ...] = field(default=(), metadata={"doc": "keep-out and keep-in volumes"})


@dataclass(frozen=True)
class Access:
    """Actuators, sensors, channels and computing devices that a module may be permitted to use."""

    span: SourceSpan
    key_span: SourceSpan | None
    actuators: tuple[Identifier, ...] = field(default=(), metadata={"doc": "actuators"})
    sensors: tuple[Identifier, ...] = field(default=(), metadata={"doc": "sensors"})
    channels: tuple[Identifier, ...] = field(default=(), metadata={"doc": "communication channels"})
    compute: tuple[Identifier, ...] = field(default=(), metadata={"doc": "computing devices"})


@dataclass(frozen=True)
class OperatorOverride:
    """An operator override: it blocks everything that matches, even if all other rules permit it."""

    span: SourceSpan
    id: Slug = field(metadata={"doc": "a short name, as in `id: press-under-repair`"})
    reason: TextField = field(metadata={"doc": "the reason that denials show"})
    module: Identifier | None = field(default=None, metadata={"doc": "the module it blocks"})
    skill: Identifier | None = field(default=None, metadata={"doc": "the skill of that module it blocks"})
    action: Identifier | None = field(default=None, metadata={"doc": "the action kind it blocks"})


@dataclass(frozen=True)
class Quota:
    """A limit on the number of actions within any time window."""

    span: SourceSpan
    id: Slug = field(metadata={"doc": "a short name, as in `id: grip-rate`"})
    on: tuple[Identifier, ...] = field(metadata={"doc": "the action kinds it counts, as in `on: [grip]`"})
    at_most: Annotated[IntegerField, ValueBounds(1, 1_000_000)] = field(
        metadata={"doc": "the greatest number of actions, as in `at_most: 60`"}
    )
    within: TextField = field(metadata={"doc": "the time window, as in `within: 60 s`"})
    rationale: TextField = field(metadata={"doc": "the reason for the quota"})


@dataclass(frozen=True)
class ModuleLimits:
    """Limits on timeouts, retries, re-plans and planning time."""

    span: SourceSpan
    skill_timeout: TextField = field(
        metadata={"doc": "the longest timeout of a skill, as in `skill_timeout: 120 s`"}
    )
    retries: Annotated[IntegerField, ValueBounds(0, 100)] = field(
        metadata={"doc": "the largest retry budget of a step"}
    )
    replans: Annotated[IntegerField, ValueBounds(0, 1000)] = field(
        metadata={"doc": "the greatest number of re-plans of a task"}
    )
    planning: TextField | None = field(
        default=None,
        metadata={"doc": "the time limit for planning, as in `planning: 5 s`; 30 s if absent"},
    )


@dataclass(frozen=True)
class AuditPolicy:
    """Durability of the audit record."""

    span: SourceSpan
    durability: ChoiceField[Literal["every-record", "before-motion", "batched"]] = field(
        metadata={
            "doc": "when records reach the disk: each at once (if absent), each before anything moves, or "
            "many at a time, so that a power failure may lose the records of past motions; as in "
            "`durability: before-motion`"
        }
    )


@dataclass(frozen=True)
class IsolationPolicy:
    """Isolation of module code: its process, and the layers around it."""

    span: SourceSpan
    require: tuple[ChoiceField[Literal["bubblewrap", "landlock", "rlimits", "seccomp"]], ...] | None = field(
        default=None,
        metadata={"doc": "the required isolation layers; all but bubblewrap if absent"},
    )
    missing: ChoiceField[Literal["refuse", "warn"]] | None = field(
        default=None,
        metadata={"doc": "on a host that lacks a required layer: `refuse` modules (if absent), or `warn`"},
    )
    trusted: tuple[Identifier, ...] = field(
        default=(), metadata={"doc": "modules whose code runs in the runtime's own process, unconfined"}
    )
    answer_within: TextField | None = field(
        default=None,
        metadata={"doc": "the time limit for skill code before each action, as in `answer_within: 5 s`"},
    )


@dataclass(frozen=True)
class McpPolicy:
    """Permissions of clients of `aeros mcp`, such as language models."""

    span: SourceSpan
    execute: ChoiceField[Literal["approval", "allowed", "denied"]] | None = field(
        default=None,
        metadata={
            "doc": "execution of verified plans: after the operator's `aeros approve` (if absent), on the "
            "client's request, or never; as in `execute: denied`"
        },
    )
    most_steps: Annotated[IntegerField, ValueBounds(1, 100)] | None = field(
        default=None, metadata={"doc": "the greatest number of steps in a plan; 20 if absent"}
    )
    skills: tuple[TextField, ...] | None = field(
        default=None,
        metadata={"doc": "the skills that a plan may use, as in `[make_dumplings.boil]`; all if absent"},
    )


@dataclass(frozen=True)
class Policy:
    """The operator's policy (Π): access, risk ceiling, limits, overrides, quotas."""

    span: SourceSpan
    access: Access = field(metadata={"doc": "the access that every module may be permitted"})
    risk_ceiling: RiskWord = field(metadata={"doc": "the highest risk a skill may have"})
    limits: ModuleLimits = field(metadata={"doc": "bounds on timeouts, retries and re-plans"})
    grants: Named[Access] = field(default=MappingField(), metadata={"doc": "further access, by module"})
    blocks: tuple[OperatorOverride, ...] = field(default=(), metadata={"doc": "operator overrides"})
    quotas: tuple[Quota, ...] = field(default=(), metadata={"doc": "rate limits"})
    audit: AuditPolicy | None = field(default=None, metadata={"doc": "the durability of the audit log"})
    isolation: IsolationPolicy | None = field(
        default=None, metadata={"doc": "the isolation of skill code; isolated if absent"}
    )
    mcp: McpPolicy | None = field(default=None, metadata={"doc": "the rights of MCP clients (`aeros mcp`)"})
    undeclared_outcome: ChoiceField[Literal["stop", "replan"]] | None = field(
        default=None,
        metadata={
            "doc": "reaction to an undeclared outcome of a skill: `stop` ends the task (if absent), "
            "`replan` plans again"
        },
    )


@dataclass(frozen=True)
class Site:
    """A whole site file."""

    span: SourceSpan
    schema: Literal["aeros/site/1"] = field(metadata={"doc": "`schema: aeros/site/1`"})
    id: Identifier = field(metadata={"doc": "the site's name, as in `id: panda_cell`"})
    description: TextField = field(metadata={"doc": "the site's purpose, for people"})
    state: Named[StateVariable] = field(metadata={"doc": "the measured state variables"})
    actions: Named[ActionKind] = field(metadata={"doc": "the action kinds"})
    invariants: tuple[Invariant, ...] = field(metadata={"doc": "the invariants Φ"})
    policy: Policy = field(metadata={"doc": "the policy Π"})
    enums: Named[tuple[Identifier, ...]] = field(
        default=MappingField(), metadata={"doc": "closed enumerations"}
    )
    constants: Named[Constant] = field(default=MappingField(), metadata={"doc": "named constants"})
    volumes: Named[Volume] = field(default=MappingField(), metadata={"doc": "named boxes in W"})
    joint: tuple[JointInvariant, ...] = field(
        default=(), metadata={"doc": "invariants about two actions at the same time"}
    )
    resources: Named[Annotated[IntegerField, ValueBounds(1, 1_000_000)]] = field(
        default=MappingField(),
        metadata={"doc": "resources that skills hold while they run, with their numbers"},
    )
    motion: MotionPolicy | None = field(
        default=None, metadata={"doc": "limits for whole motions; if absent, motions are not checked"}
    )
