"""The resolved model: sites and modules with names, types and units settled.  Frozen, and all in SI.

Built by `elaborate` alone; obligations, the gate and planners read it.
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
    """Ordered levels of risk; a skill's is at least that of every action kind it asks for."""

    LOW = 1
    MEDIUM = 2
    HIGH = 3


@dataclass(frozen=True)
class Declared:
    """A declared variable: its term, its unit for people, and its bounds.

    range: closed, in SI, of the value, of each component of a vector or of each member of a family;
        present for reals and vectors.
    max_age: seconds after which a measured value is unknown; None for parameters and inputs.
    sensor: what measures it; None for parameters and inputs.
    default: of an input, in SI; None where a step must give it.
    range_span: where the bounds are written.
    facts: what holds of it in every state, beside its range.
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
        """As written in expressions; inputs as `inputs.NAME`."""
        return self.variable.name

    @cached_property
    def double_range(self) -> tuple[float, float]:
        """The least and the greatest double in `range`; infinite where there is none."""
        if self.range is None:
            return -inf, inf
        return adjacent_doubles(self.range[0])[1], adjacent_doubles(self.range[1])[0]


def ranges_of(declared: Iterable[Declared]) -> dict[str, tuple[Fraction, Fraction]]:
    """The closed range of each real scalar variable."""
    return {
        scalar.name: one.range
        for one in declared
        for scalar in scalar_variables(one.variable)
        if isinstance(scalar.type, RealType) and one.range is not None
    }


def relevant_facts(
    terms: Sequence[t.Term], known: Mapping[str, Declared]
) -> tuple[tuple[Declared, ...], tuple[t.Term, ...]]:
    """Which of the variables, by name, the terms depend on, and the terms with all facts about those."""
    found: dict[str, Declared] = {}
    pending, whole = list(terms), list(terms)
    while pending:
        for name in t.variables_of(pending.pop()):
            if name in known and name not in found:
                found[name] = known[name]
                pending += known[name].known_facts
                whole += known[name].known_facts
    return tuple(one for name, one in known.items() if name in found), tuple(whole)


@dataclass(frozen=True)
class ActionKind:
    """A kind of action, what it moves, the least risk it carries, and its parameters."""

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
    """An invariant of Φ, as a term for each action kind it governs.

    attenuations: by action kind, the term each reducible parameter is set to when the rule alone
        stands in the way.
    conjuncts: by action kind, what its term is the conjunction of.
    premises, alternatives: by action kind, conditions such that the rule denies what makes all premises true
        and all alternatives false.
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
        """Whether it constrains the action itself, and not only the state in which it is asked for."""
        roles = {variable.role for variable in t.variables_of(self.terms[kind]).values()}
        return t.VariableRole.PARAMETER in roles or not roles


@dataclass(frozen=True)
class JointRule:
    """An invariant about two simultaneous actions; a parameter `p` of the role `a` is the variable `a.p`.

    roles: the two roles, in order, and the action kind of each.
    conjuncts: what the term is the conjunction of.
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
    """A past-time condition of the rules, as a variable of its own that the runtime keeps up to date.

    declared: the variable; its name is the condition's text, its facts hold of it whatever happened.
    term: its operands are over state variables and histories that stand before it.
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
        """What either allows."""
        return Access(
            self.actuators | other.actuators,
            self.sensors | other.sensors,
            self.channels | other.channels,
            self.compute | other.compute,
        )


@dataclass(frozen=True)
class OperatorOverride:
    """An operator override; a field that is None matches everything."""

    id: str
    reason: str
    module: str | None
    skill: str | None
    action: str | None
    span: SourceSpan | None = None

    @property
    def identity(self) -> tuple[str | None, ...]:
        """All that it says, wherever that is written."""
        return self.id, self.reason, self.module, self.skill, self.action

    def matches(self, module: str, skill: str, action: str) -> bool:
        """Whether an action of this kind, asked for by this skill, is blocked."""
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
    """Bounds on time-outs (seconds), retries of a step, re-plans of a task, and planning (seconds)."""

    skill_timeout: Fraction
    retries: int
    replans: int
    planning: Fraction = Fraction(30)


class Durability(Enum):
    """When what is recorded must have reached the medium; the site's choice."""

    EVERY_RECORD = "every-record"  # before anything else happens
    BEFORE_MOTION = "before-motion"  # before anything moves; what moves nothing may be lost with the power
    BATCHED = "batched"  # many at a time; with the power, records of what has moved may be lost


@dataclass(frozen=True)
class IsolationPolicy:
    """Where the code of modules runs: isolated, unless the module is trusted.

    require: layers without which isolation is too weak.
    refuses: whether a host that lacks one runs no isolated module; else it only warns.
    answer_within: seconds that skill code may compute before each action.
    """

    required_layers: frozenset[str] = frozenset(("landlock", "seccomp", "rlimits"))
    refuses_missing: bool = True
    trusted_modules: frozenset[str] = frozenset()
    answer_timeout_s: Fraction = Fraction(5)


class Execute(Enum):
    """Whether a verified plan is executed because a client of `aeros mcp` asks for it."""

    APPROVAL = "approval"  # once the operator has approved it
    ALLOWED = "allowed"
    DENIED = "denied"


@dataclass(frozen=True)
class McpPolicy:
    """What clients of `aeros mcp` may have done.

    most_steps: of one plan.
    skills: as MODULE.SKILL, those that a plan may have; None for all active ones.
    """

    execute: Execute = Execute.APPROVAL
    max_steps: int = 20
    skills: frozenset[str] | None = None


@dataclass(frozen=True)
class MotionKind:
    """Which parameters say where tool (W), joints and base (W, x and y) end, and how fast it all may be."""

    tool_target: str | None
    base_target: tuple[str, str] | None
    peak_speed: str | None
    joint_target: tuple[str, ...] | None = None


@dataclass(frozen=True)
class Barrier:
    """A volume that `links` (None: all) keep out of or, if `keep_inside`, inside of, in every motion.

    in_base: its corners are measured from the robot's base, not in W.
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
    """Of the tool point: speed, acceleration and jerk, in each of translation and rotation, SI."""

    translation: tuple[Fraction, Fraction, Fraction]
    rotation: tuple[Fraction, Fraction, Fraction]


@dataclass(frozen=True)
class MotionPolicy:
    """What the whole trajectory of an action is decided by.  SI.

    starts_at: the state variable, a family, that measures the joints.
    lowest, highest, rates: of each joint; the rates are speed, acceleration and jerk.
    clearance: what links keep from barriers: room for what the paths do not say, as tracking error.
    base: speed and acceleration of a base that drives.
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
    """A site: vocabulary, Φ, Π.  `digest` is the SHA-256 of its file, in hexadecimal.

    policy_spans: where access, the risk ceiling, limits and capacities are written, by their place in
        the file, as in `policy/limits/retries` and `resources/arm`.
    stops_at_undeclared: whether a task ends where a skill has run to its end and come to what it does not
        declare; else the agent plans again.
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
        """Everything that rules read of the state: what is measured, and the histories of it."""
        return {**self.state, **{one.declared.name: one.declared for one in self.histories}}

    def access_of(self, module: str) -> Access:
        """Everything that `module` may be permitted to touch."""
        return self.access.merge(self.grants.get(module, Access()))

    def with_overrides(self, blocks: Sequence[OperatorOverride]) -> Site:
        """The site with further operator overrides, and the digest that says which."""
        if not blocks:
            return self
        said = json.dumps([self.digest, *(one.identity for one in blocks)])
        digest = hashlib.sha256(said.encode()).hexdigest()
        return replace(self, blocks=(*self.blocks, *blocks), digest=digest)

    def rules_for_kind(self, kind: str) -> tuple[Rule, ...]:
        """The invariants that govern actions of `kind`."""
        return tuple(rule for rule in self.rules if kind in rule.terms)


@dataclass(frozen=True)
class Outcome:
    """One way a skill may end: what is measured then, and whether it counts as failure."""

    id: str
    effects: Mapping[str, Any]
    failure: bool
    probability: Fraction | None
    duration: Fraction | None


@dataclass(frozen=True)
class ActionCondition:
    """A condition on actions of one kind: of an envelope or of a permission.

    conjuncts: what the term is the conjunction of.
    """

    term: t.Term
    text: str
    span: SourceSpan
    conjuncts: tuple[Conjunct, ...] = ()


@dataclass(frozen=True)
class Skill:
    """A skill with its envelope by action kind.  `timeout` in seconds.

    precondition: what must be measured for it to start; what `hold_condition` says of predicates is part of
        it.
    hold: what must be measured as long as it runs.
    idempotent: run twice it does no more than run once, by its author's word.
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
        """The outcomes that are no failure."""
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
    """A task invariant: a condition on state that is to hold from the start of a task to its end."""

    id: str
    term: t.Term
    text: str
    span: SourceSpan


@dataclass(frozen=True)
class Task:
    """A task: the words that route to it, its goal and its planning rules in order.

    initial: what is typically measured at the start, by state variable, SI; what a plant without
        physics starts from.
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
    """An Embodied Capability Module.

    manifest_digest, code_digest: SHA-256, in hexadecimal, of the manifest and of its code files.
    model_digests: likewise of each file that a model or tool names, by its path in the module.
    requires: other modules it depends on, by name, with a PEP 440 specifier.
    runtime: the versions of AEROS it works with, a PEP 440 specifier.
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
        """The skills any of which may run where a step names `name`, a skill or a capability of skills alone.

        Empty where it is neither.
        """
        if name in self.skills:
            return (name,)
        providers = self.capabilities.get(name, ())
        return providers if all(one in self.skills for one in providers) else ()
