"""Resolved model of sites and modules: names, types and units are settled. Frozen, and all in SI.

Only `elaborate` builds it; obligations, the gate and planners read it.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum, IntEnum
from fractions import Fraction
from functools import cached_property
from math import inf
from typing import Any

from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.expr import terms as t
from aeros.spec.expr.doubles import adjacent_doubles
from aeros.spec.expr.lower import scalar_variables
from aeros.spec.expr.scope import AxisAlignedBox
from aeros.spec.expr.types import EnumType, RealType
from aeros.spec.expr.units import DIMENSIONLESS, Unit
from aeros.spec.model.composition import Composition

Ranges = Mapping[str, tuple[Fraction, Fraction]]


class Risk(IntEnum):
    """Ordered levels of risk. A skill's risk is at least that of every action kind it asks for."""

    LOW = 1
    MEDIUM = 2
    HIGH = 3


@dataclass(frozen=True)
class Declared:
    """Declared variable: its term, its unit for people, and its bounds.

    Attributes:
        range: closed range (SI) of the value, of each component of a vector or of each member of a family;
            present for reals and vectors.
        max_age: seconds after which a measured value is unknown; None for parameters and inputs.
        sensor: sensor that measures it; None for parameters and inputs.
        default_value: default of an input, in SI; None if a step must give it.
        range_span: where the bounds are written.
        known_facts: conditions that hold of it in every state, in addition to its range.
    """

    variable: t.Variable
    span: SourceSpan
    unit: Unit = DIMENSIONLESS
    range: tuple[Fraction, Fraction] | None = None
    max_age: Fraction | None = None
    sensor: str | None = None
    default_value: Any = None
    range_span: SourceSpan | None = None
    known_facts: tuple[t.Term, ...] = ()

    @property
    def name(self) -> str:
        """Name in expressions; `inputs.NAME` for an input."""
        return self.variable.name

    @cached_property
    def double_range(self) -> tuple[float, float]:
        """Least and greatest double in `range`; infinite if there is none."""
        if self.range is None:
            return -inf, inf
        return adjacent_doubles(self.range[0])[1], adjacent_doubles(self.range[1])[0]


def ranges_of(declared: Iterable[Declared]) -> dict[str, tuple[Fraction, Fraction]]:
    """Collect the ranges of variables.

    Args:
        declared: declared variables.

    Returns:
        The closed range (SI) of each real scalar variable, by its name.
    """
    return {
        scalar.name: entry.range
        for entry in declared
        for scalar in scalar_variables(entry.variable)
        if isinstance(scalar.type, RealType) and entry.range is not None
    }


def relevant_facts(
    terms: Sequence[t.Term], known: Mapping[str, Declared]
) -> tuple[tuple[Declared, ...], tuple[t.Term, ...]]:
    """Collect the variables that terms depend on, and all known facts about them.

    Args:
        terms: boolean terms.
        known: declared variables by name.

    Returns:
        The variables, in the order of `known`, and the terms followed by the facts. Variables of facts count
        too.
    """
    relevant: set[str] = set()
    pending, whole = list(terms), list(terms)
    while pending:
        for name in t.variables_of(pending.pop()):
            if name in known and name not in relevant:
                relevant.add(name)
                pending += known[name].known_facts
                whole += known[name].known_facts
    return tuple(entry for name, entry in known.items() if name in relevant), tuple(whole)


@dataclass(frozen=True)
class ActionKind:
    """Kind of action: the actuators it moves, the least risk it carries, and its parameters."""

    name: str
    actuators: frozenset[str]
    risk: Risk
    protective: bool
    parameters: Mapping[str, Declared]
    span: SourceSpan


@dataclass(frozen=True)
class Conjunct:
    """One of the conditions that a larger one is the conjunction of, and where it is written."""

    term: t.Term
    span: SourceSpan


@dataclass(frozen=True)
class Rule:
    """Invariant of Φ, as a term for each action kind it governs.

    Attributes:
        attenuations: by action kind, the term that each reducible parameter is set to when only this rule
            denies.
        conjuncts: by action kind, the conditions that its term is the conjunction of.
        premises: by action kind; the rule denies a state and action that make all premises true and all
            alternatives false.
        alternatives: by action kind, see `premises`.
    """

    id: str
    text: str
    rationale: str
    source: str
    terms: Mapping[str, t.Term]
    attenuations: Mapping[str, Mapping[str, t.Term]]
    span: SourceSpan
    require_span: SourceSpan
    conjuncts: Mapping[str, tuple[Conjunct, ...]] = field(default_factory=dict)
    premises: Mapping[str, tuple[Conjunct, ...]] = field(default_factory=dict)
    alternatives: Mapping[str, tuple[Conjunct, ...]] = field(default_factory=dict)

    def constrains_action(self, kind: str) -> bool:
        """Say if the rule constrains the action itself, not only the state in which it is asked for.

        Args:
            kind: action kind that the rule governs.

        Returns:
            True if the rule reads a parameter of the action, or no variable at all.
        """
        roles = {variable.role for variable in t.variables_of(self.terms[kind]).values()}
        return t.VariableRole.PARAMETER in roles or not roles


@dataclass(frozen=True)
class JointRule:
    """Invariant about two simultaneous actions. A parameter `p` of the role `a` is the variable `a.p`.

    Attributes:
        roles: the two roles, in order, and the action kind of each.
        conjuncts: the conditions that the term is the conjunction of.
    """

    id: str
    text: str
    rationale: str
    source: str
    roles: tuple[tuple[str, str], tuple[str, str]]
    term: t.Term
    span: SourceSpan
    require_span: SourceSpan
    conjuncts: tuple[Conjunct, ...] = ()


@dataclass(frozen=True)
class History:
    """Past-time condition of the rules, as a variable that the runtime keeps up to date.

    Attributes:
        declared: the variable; its name is the condition's text, and its known facts always hold.
        term: past-time term; its operands are over state variables and earlier histories.
    """

    declared: Declared
    term: t.PastTerm


@dataclass(frozen=True)
class Access:
    """Actuators, sensors, channels and computing devices."""

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


@dataclass(frozen=True)
class OperatorOverride:
    """Operator override, which blocks actions. A field that is None matches everything."""

    id: str
    reason: str
    module: str | None
    skill: str | None
    action: str | None
    span: SourceSpan | None = None

    @property
    def identity(self) -> tuple[str | None, ...]:
        """All its content, wherever it is written."""
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
    """At most `max_count` actions of `kinds` within any `window_s` seconds."""

    id: str
    kinds: frozenset[str]
    max_count: int
    window_s: Fraction
    span: SourceSpan


@dataclass(frozen=True)
class ModuleLimits:
    """Limits on timeouts (s), retries of a step, re-plans of a task, and planning time (s)."""

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
    """

    required_layers: frozenset[str] = frozenset(("landlock", "seccomp", "rlimits"))
    refuses_missing: bool = True
    trusted_modules: frozenset[str] = frozenset()
    answer_timeout_s: Fraction = Fraction(5)


class Execute(Enum):
    """Rule for executing a verified plan when a client of `aeros mcp` asks for it."""

    APPROVAL = "approval"  # once the operator has approved it
    ALLOWED = "allowed"
    DENIED = "denied"


@dataclass(frozen=True)
class McpPolicy:
    """Permissions of clients of `aeros mcp`.

    Attributes:
        max_steps: greatest number of steps of one plan.
        skills: skills (MODULE.SKILL) that a plan may have; None for all active ones.
    """

    execute: Execute = Execute.APPROVAL
    max_steps: int = 20
    skills: frozenset[str] | None = None


@dataclass(frozen=True)
class MotionKind:
    """Meaning of an action kind's parameters for its motion.

    Attributes:
        tool_target: parameter with the tool's target, a vector in W.
        base_target: parameters with x and y of the base's target in W.
        peak_speed: parameter that bounds the speed of the motion.
        joint_target: parameter with the target of each joint, in order.
    """

    tool_target: str | None
    base_target: tuple[str, str] | None
    peak_speed: str | None
    joint_target: tuple[str, ...] | None = None


@dataclass(frozen=True)
class Barrier:
    """Volume that `links` (None: all) keep out of or, if `keep_inside`, inside of, in every motion.

    Attributes:
        is_in_base_frame: the corners of `box` are in the robot's base frame, not in W.
    """

    id: str
    volume: str
    box: AxisAlignedBox
    keep_inside: bool
    is_in_base_frame: bool
    links: frozenset[str] | None
    rationale: str


@dataclass(frozen=True)
class ToolLimits:
    """Limits of the tool point: (speed, acceleration, jerk) of translation and of rotation, in SI."""

    translation: tuple[Fraction, Fraction, Fraction]
    rotation: tuple[Fraction, Fraction, Fraction]


@dataclass(frozen=True)
class MotionPolicy:
    """Limits by which the whole trajectory of an action is decided, in SI.

    Attributes:
        start_variable: state variable, a family, that measures the joints.
        start_tolerance: greatest distance of a motion's start from the measured joints.
        end_tolerance: greatest distance of a motion's end from the requested target.
        lowest: lowest position of each joint.
        highest: highest position of each joint.
        joint_limits: speeds, accelerations and jerks, one of each per joint.
        clearance: least distance of links from barriers: room for deviations from the path, as tracking
            error.
        base_limits: speed and acceleration of a mobile base.
    """

    kinds: Mapping[str, MotionKind]
    start_variable: str
    start_tolerance: Fraction
    end_tolerance: Fraction
    lowest: tuple[Fraction, ...]
    highest: tuple[Fraction, ...]
    joint_limits: tuple[tuple[Fraction, ...], tuple[Fraction, ...], tuple[Fraction, ...]]
    tool_limits: ToolLimits
    clearance: Fraction
    barriers: tuple[Barrier, ...]
    base_limits: tuple[Fraction, Fraction] | None = None


@dataclass(frozen=True)
class Site:
    """Site: vocabulary, Φ, Π. `digest` is the SHA-256 of its file, in hexadecimal.

    Attributes:
        policy_spans: where access, the risk ceiling, limits and capacities are written, by their place in the
            file, as in `policy/limits/retries` and `resources/arm`.
        stops_on_undeclared_outcome: a task ends if a skill runs to its end with an outcome that it does not
            declare; otherwise the agent plans again.
    """

    id: str
    digest: str
    enums: Mapping[str, EnumType]
    constants: Mapping[str, t.Term]
    volumes: Mapping[str, AxisAlignedBox]
    state: Mapping[str, Declared]
    kinds: Mapping[str, ActionKind]
    rules: tuple[Rule, ...]
    access: Access
    grants: Mapping[str, Access]
    risk_ceiling: Risk
    limits: ModuleLimits
    blocks: tuple[OperatorOverride, ...]
    quotas: tuple[Quota, ...]
    resources: Mapping[str, int]
    span: SourceSpan
    joint_rules: tuple[JointRule, ...] = ()
    grant_spans: Mapping[str, SourceSpan] = field(default_factory=dict)
    histories: tuple[History, ...] = ()
    policy_spans: Mapping[str, SourceSpan] = field(default_factory=dict)
    motion: MotionPolicy | None = None
    durability: Durability = Durability.EVERY_RECORD
    isolation: IsolationPolicy = IsolationPolicy()
    mcp: McpPolicy = McpPolicy()
    stops_on_undeclared_outcome: bool = True

    @cached_property
    def observed_variables(self) -> Mapping[str, Declared]:
        """Variables of the state that rules may read: measured ones and histories of them."""
        return {**self.state, **{history.declared.name: history.declared for history in self.histories}}

    def access_of(self, module: str) -> Access:
        """Return everything that a module may be permitted to touch.

        Args:
            module: name of the module.

        Returns:
            The access of all modules and what the site grants this one.
        """
        return self.access.merge(self.grants.get(module, Access()))

    def with_overrides(self, blocks: Sequence[OperatorOverride]) -> Site:
        """Add operator overrides.

        Args:
            blocks: the overrides.

        Returns:
            The site with them, and with a digest that depends on them; the same site if there are none.
        """
        if not blocks:
            return self
        content = json.dumps([self.digest, *(block.identity for block in blocks)])
        digest = hashlib.sha256(content.encode()).hexdigest()
        return replace(self, blocks=(*self.blocks, *blocks), digest=digest)

    def rules_for_kind(self, kind: str) -> tuple[Rule, ...]:
        """Return the invariants that govern actions of a kind.

        Args:
            kind: action kind.

        Returns:
            The invariants, in the order of the site file.
        """
        return tuple(rule for rule in self.rules if kind in rule.terms)


@dataclass(frozen=True)
class Outcome:
    """One way a skill may end: the measured effects, and if it counts as a failure."""

    id: str
    effects: Mapping[str, Any]
    failure: bool
    probability: Fraction | None
    duration: Fraction | None


@dataclass(frozen=True)
class ActionCondition:
    """Condition on actions of one kind, in an envelope or a permission.

    Attributes:
        conjuncts: the conditions that the term is the conjunction of.
    """

    term: t.Term
    text: str
    span: SourceSpan
    conjuncts: tuple[Conjunct, ...] = ()


@dataclass(frozen=True)
class Skill:
    """Skill with its envelope by action kind.

    Attributes:
        precondition: condition that must be measured before it starts, including the predicates of
            `hold_condition`.
        envelope: condition on the actions that it may ask for, by action kind.
        timeout: seconds after which it is halted.
        runtime_checked: invariants that the envelope does not imply and the gate decides, and where each is
            listed.
        idempotent: by its author's word, running it twice does no more than running it once.
        hold_condition: condition that must be measured as long as it runs.
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

    @property
    def success_outcomes(self) -> tuple[Outcome, ...]:
        """Outcomes that are no failure."""
        return tuple(outcome for outcome in self.outcomes.values() if not outcome.failure)


@dataclass(frozen=True)
class PlanningRule:
    """`unless CONDITION do SKILL`, with its retry budget and the skill run between two tries."""

    satisfied_condition: t.Term
    text: str
    skill: str
    inputs: Mapping[str, Any]
    retry: int
    on_failure: str | None
    span: SourceSpan


@dataclass(frozen=True)
class TaskInvariant:
    """Task invariant: a condition on the state that must hold from the start of a task to its end."""

    id: str
    term: t.Term
    text: str
    span: SourceSpan


@dataclass(frozen=True)
class Task:
    """Task: the words that route to it, its goal, and its planning rules in order.

    Attributes:
        initial: typical value (SI) of each state variable at the start; a simulator without physics starts
            from it.
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


@dataclass(frozen=True)
class Ecm:
    """Embodied Capability Module.

    Attributes:
        manifest_digest: SHA-256 of the manifest, in hexadecimal.
        code_digest: SHA-256 of its code files.
        model_digests: SHA-256 of each file that a model or tool names, by its path in the module.
        required_modules: other modules it depends on, by name, with a PEP 440 specifier.
        required_aeros_version: versions of AEROS it works with, a PEP 440 specifier.
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

    def providers(self, name: str) -> tuple[str, ...]:
        """Return the skills any of which may run where a step names a skill or a capability.

        Args:
            name: name of a skill, or of a capability that skills alone provide.

        Returns:
            Names of the skills; empty if `name` is neither.
        """
        if name in self.skills:
            return (name,)
        providers = self.capabilities.get(name, ())
        return providers if all(provider in self.skills for provider in providers) else ()
