"""Policy of a site: access, overrides, quotas, limits, audit, isolation, and clients of `aeros mcp`."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from fractions import Fraction

from aeros.spec.diagnostics.source import SourceSpan


@dataclass(frozen=True)
class Access:
    """Access to parts of the robot.

    Attributes:
        actuators: names of actuators.
        sensors: names of sensors.
        channels: names of communication channels.
        compute: names of computing devices.
    """

    actuators: frozenset[str] = frozenset()
    sensors: frozenset[str] = frozenset()
    channels: frozenset[str] = frozenset()
    compute: frozenset[str] = frozenset()

    def merge(self, other: Access) -> Access:
        """Join two sets of permissions.

        Args:
            other: further permissions.

        Returns:
            The access that either of them allows.
        """
        return Access(
            self.actuators | other.actuators,
            self.sensors | other.sensors,
            self.channels | other.channels,
            self.compute | other.compute,
        )

    def __str__(self) -> str:
        groups = (self.actuators, self.sensors, self.channels, self.compute)
        names = ("actuators", "sensors", "channels", "compute")
        return "; ".join(
            f"{name} {', '.join(sorted(one))}" for name, one in zip(names, groups, strict=True) if one
        )


@dataclass(frozen=True)
class OperatorOverride:
    """Operator override, which blocks actions.

    Attributes:
        id: name of the override.
        reason: the operator's reason, as denials quote it.
        module, skill, action: module, skill and action kind that it blocks; None blocks all of them.
        span: place in the site file; None if an operator added it at run time.
    """

    id: str
    reason: str
    module: str | None
    skill: str | None
    action: str | None
    span: SourceSpan | None = None

    @property
    def scope(self) -> str:
        """Description of the blocked actions, such as `module tidy, skill wipe`."""
        named = (("module", self.module), ("skill", self.skill), ("action", self.action))
        return ", ".join(f"{what} {value}" for what, value in named if value is not None) or "all actions"

    @property
    def identity(self) -> tuple[str | None, ...]:
        """All fields but the place in a file: equal for overrides that say the same."""
        return self.id, self.reason, self.module, self.skill, self.action

    def matches(self, module: str, skill: str, action: str) -> bool:
        """Say if the override blocks an action.

        Args:
            module: module that asks for it.
            skill: skill that asks for it.
            action: action kind.

        Returns:
            True if every field matches.
        """
        pairs = ((self.module, module), (self.skill, skill), (self.action, action))
        return all(mine is None or mine == theirs for mine, theirs in pairs)


@dataclass(frozen=True)
class Quota:
    """Limit on the number of actions within any time window.

    Attributes:
        id: name of the quota.
        kinds: action kinds that count.
        max_count: greatest number of actions in a window.
        window_s: length of the window, s.
        span: place in the site file.
    """

    id: str
    kinds: frozenset[str]
    max_count: int
    window_s: Fraction
    span: SourceSpan


@dataclass(frozen=True)
class ModuleLimits:
    """Limits of the site on modules and on the agent.

    Attributes:
        skill_timeout: greatest timeout of a skill, s.
        retries: greatest number of retries of a step.
        replans: greatest number of re-plans of a task.
        planning: greatest time to make one plan, s.
    """

    skill_timeout: Fraction
    retries: int
    replans: int
    planning: Fraction = Fraction(30)


class Durability(Enum):
    """Point in time by which audit records must be on the storage medium; the site chooses it."""

    EVERY_RECORD = "every-record"  # before anything else happens
    BEFORE_MOTION = "before-motion"  # before anything moves; a power cut may lose records of other actions
    BATCHED = "batched"  # many at a time; a power cut may lose records of motions that have happened


@dataclass(frozen=True)
class IsolationPolicy:
    """Isolation of module code: every module runs isolated unless it is trusted.

    Attributes:
        required_layers: layers without which isolation is too weak.
        refuses_missing: a host that lacks one runs no isolated module; otherwise it only warns.
        trusted_modules: modules whose code runs in the runtime's own process.
        answer_timeout_s: seconds that skill code may compute before each action.
        memory: bytes that the process of a skill may map, beyond those of its interpreter.
        processor: greatest share of one core that it may use, above 0 and at most 1.
    """

    required_layers: frozenset[str] = frozenset(("landlock", "seccomp", "rlimits"))
    refuses_missing: bool = True
    trusted_modules: frozenset[str] = frozenset()
    answer_timeout_s: Fraction = Fraction(5)
    memory: int = 2**28
    processor: Fraction = Fraction(1)


@dataclass(frozen=True)
class WorkerLimits:
    """Limits on the process of a skill.

    Attributes:
        memory: bytes that it may map, beyond those of its interpreter.
        answer_within: seconds of real time that it may compute before each action.
        processor: greatest share of one core that it may use, above 0 and at most 1.
    """

    memory: int
    answer_within: Fraction
    processor: Fraction = Fraction(1)


class Execute(Enum):
    """Rule for executing a verified plan when a client of `aeros mcp` asks for it."""

    APPROVAL = "approval"  # once the operator has approved it
    ELICITATION = "elicitation"  # also once the client says that its user approved it, which nothing verifies
    ALLOWED = "allowed"
    DENIED = "denied"


@dataclass(frozen=True)
class McpPolicy:
    """Permissions of clients of `aeros mcp`.

    Attributes:
        execute: condition on which a verified plan is executed: approval, elicitation, allowed or denied.
        max_steps: greatest number of steps of one plan.
        skills: skills (MODULE.SKILL) that a plan may have; None for all active ones.
    """

    execute: Execute = Execute.APPROVAL
    max_steps: int = 20
    skills: frozenset[str] | None = None
