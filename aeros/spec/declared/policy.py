"""Schema of the policy section of a site file, unresolved and closed."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

from aeros.spec.declared.field_types import Identifier, Named, RiskWord, Slug
from aeros.spec.declared.perception import PerceptionPolicy
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.text.fields import (
    ChoiceField,
    IntegerField,
    MappingField,
    TextField,
    ValueBounds,
)


@dataclass(frozen=True)
class Access:
    """Actuators, sensors, channels and computing devices that a module may be permitted to use.

    Attributes:
        span: its place in the file.
        key_span: place of the key above it; None if it has none.
    """

    span: SourceSpan
    key_span: SourceSpan | None
    actuators: tuple[Identifier, ...] = field(default=(), metadata={"doc": "actuators"})
    sensors: tuple[Identifier, ...] = field(default=(), metadata={"doc": "sensors"})
    channels: tuple[Identifier, ...] = field(default=(), metadata={"doc": "communication channels"})
    compute: tuple[Identifier, ...] = field(default=(), metadata={"doc": "computing devices"})


@dataclass(frozen=True)
class OperatorOverride:
    """An operator override: it blocks everything that matches, even if all other rules permit it.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    id: Slug = field(metadata={"doc": "a short name, as in `id: press-under-repair`"})
    reason: TextField = field(metadata={"doc": "the reason that denials show"})
    module: Identifier | None = field(default=None, metadata={"doc": "the module it blocks"})
    skill: Identifier | None = field(default=None, metadata={"doc": "the skill of that module it blocks"})
    action: Identifier | None = field(default=None, metadata={"doc": "the action kind it blocks"})


@dataclass(frozen=True)
class Quota:
    """A limit on the number of actions within any time window.

    Attributes:
        span: its place in the file.
    """

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
    """Limits on timeouts, retries, re-plans and planning time.

    Attributes:
        span: its place in the file.
    """

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
    """Durability of the audit record.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    durability: ChoiceField[Literal["every-record", "before-motion", "batched"]] = field(
        metadata={
            "doc": "when records reach the disk: each at once (if absent), each before anything moves, or "
            "many at a time, so that a power failure may lose the records of past motions; as in "
            "`durability: before-motion`"
        }
    )


LayerField = ChoiceField[Literal["bubblewrap", "cgroups", "landlock", "rlimits", "seccomp"]]
"""Name of an isolation layer."""


@dataclass(frozen=True)
class IsolationPolicy:
    """Isolation of module code: its process, and the layers around it.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    require: tuple[LayerField, ...] | None = field(
        default=None,
        metadata={"doc": "the required isolation layers; all but bubblewrap and cgroups if absent"},
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
    memory: TextField | None = field(
        default=None,
        metadata={"doc": "the most memory of the process of a skill; 256 MiB if absent"},
    )
    processor: TextField | None = field(
        default=None,
        metadata={
            "doc": "the largest share of one core for the process of a skill, as in `processor: 50 %`; "
            "100 % if absent"
        },
    )


@dataclass(frozen=True)
class McpPolicy:
    """Permissions of clients of `aeros mcp`, such as language models.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    execute: ChoiceField[Literal["approval", "elicitation", "allowed", "denied"]] | None = field(
        default=None,
        metadata={
            "doc": "execution of verified plans: after the operator's `aeros approve` (if absent), also "
            "after a yes of the client's user, which the client could forge, on the client's request, or "
            "never; as in `execute: denied`"
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
    """The operator's policy (Π): access, risk ceiling, limits, overrides, quotas.

    Attributes:
        span: its place in the file.
    """

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
    perception: PerceptionPolicy | None = field(
        default=None, metadata={"doc": "rights of perceivers, and to what they measure"}
    )
