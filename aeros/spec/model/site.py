"""Resolved site: vocabulary, rules and policy. Names, types and units are settled; frozen, and all in SI.

Only `elaborate` builds it; obligations, the gate and planners read it.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING

from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.expr import terms as t
from aeros.spec.expr.scope import AxisAlignedBox
from aeros.spec.expr.types import EnumType
from aeros.spec.model.configured import ModuleConfiguration
from aeros.spec.model.motion import MotionPolicy
from aeros.spec.model.perception import Definition, PerceptionPolicy, SiteCamera
from aeros.spec.model.policy import (
    Access,
    Durability,
    IsolationPolicy,
    McpPolicy,
    ModuleLimits,
    OperatorOverride,
    Quota,
)
from aeros.spec.model.rules import ActionKind, JointRule, Risk, Rule
from aeros.spec.model.sensor_errors import AreaScanners, SensorErrors
from aeros.spec.model.task_parameters import ObjectKind
from aeros.spec.model.variables import Declared, History

if TYPE_CHECKING:
    from aeros.spec.model.ecm import Ecm


@dataclass(frozen=True)
class Site:
    """Site: its vocabulary, its invariants Φ and its policy Π.

    Attributes:
        id: name of the site.
        digest: SHA-256 of its file, in hexadecimal.
        enums, constants, volumes, state, kinds: the vocabulary, by name.  A state variable whose name has a
            `.` is of the module before it.
        definitions: conditions on the state that have a name, by it; a module that uses the name has a
            predicate of its own with that definition.
        rules, joint_rules: the invariants of Φ about one action and about two simultaneous actions.
        histories: conditions on past states that the rules use.
        access: actuators, sensors, channels and computing devices that exist.
        grants: access that each module gets, by module.
        risk_ceiling: greatest risk that is allowed.
        limits: limits on modules and on the agent.
        blocks: operator overrides.
        quotas: limits on numbers of actions.
        resources: capacity of each resource.
        motion: checks of planned motions; None if the site declares none.
        durability: point in time by which audit records must be on the storage medium.
        isolation: isolation of skill code.
        mcp: permissions of clients of `aeros mcp`.
        span, grant_spans: places of the site and of its grants in the file.
        policy_spans: where access, the risk ceiling, limits and capacities are written, by their place in the
            file, as in `policy/limits/retries` and `resources/arm`.
        stops_on_undeclared_outcome: a task ends if a skill runs to its end with an outcome that it does not
            declare; otherwise the agent plans again.
        cameras: cameras whose pictures perceivers may get, by name.
        perception: rights of perceivers, and to what they measure.
        offers: uses that modules may make of a thing, by its name.
        configurations: settings of modules, by module.
        operator_configurations: those of them that the operator gave, and not the site file.
        devices: device file of each computing device, by its name.
        sensors: sensors that only modules read: their purpose by name.
        objects: objects that people may ask for, by name.
        moved_by: actuators without which nothing that a sensor measures changes, by the sensor's name.
        sensor_errors: errors that simulated plants give the sensors.
        area_scanners: scanners that measure how far people are; None if the site says nothing of them.
        robot: name of the robot, or its file relative to the site's; None for that of the reference site.
        standing_postures: positions of the joints of standing arms by their prefix, rad or m, in place of
            those of the robot's file.
        recalled_names: names of a module's variables from memory, which its conditions may not read.
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
    isolation: IsolationPolicy = field(default_factory=IsolationPolicy)
    mcp: McpPolicy = field(default_factory=McpPolicy)
    stops_on_undeclared_outcome: bool = True
    cameras: Mapping[str, SiteCamera] = field(default_factory=dict)
    perception: PerceptionPolicy = field(default_factory=PerceptionPolicy)
    offers: Mapping[str, frozenset[str]] = field(default_factory=dict)
    configurations: Mapping[str, ModuleConfiguration] = field(default_factory=dict)
    operator_configurations: Mapping[str, ModuleConfiguration] = field(default_factory=dict)
    devices: Mapping[str, str] = field(default_factory=dict)
    sensors: Mapping[str, str] = field(default_factory=dict)
    objects: Mapping[str, ObjectKind] = field(default_factory=dict)
    sensor_errors: SensorErrors = field(default_factory=SensorErrors)
    area_scanners: AreaScanners | None = None
    moved_by: Mapping[str, frozenset[str]] = field(default_factory=dict)
    recalled_names: frozenset[str] = frozenset()
    robot: str | None = None
    standing_postures: Mapping[str, tuple[Fraction, ...]] = field(default_factory=dict)
    definitions: Mapping[str, Definition] = field(default_factory=dict)

    @cached_property
    def observed_variables(self) -> Mapping[str, Declared]:
        """Variables of the state that conditions may read: measured ones and histories of them."""
        return {**self.state, **{history.declared.name: history.declared for history in self.histories}}

    @cached_property
    def short_names(self) -> Mapping[str, str]:
        """Full name of each module's variable that is known by its own name alone, by that name.

        Of a definition of the site that several modules use, it is the predicate of the first of them.
        """
        candidates: dict[str, list[str]] = {}
        for name in sorted(self.module_variables):
            candidates.setdefault(name.partition(".")[2], []).append(name)
        return {
            short: names[0]
            for short, names in candidates.items()
            if (len(names) == 1 or short in self.definitions) and short not in self.state
        }

    @cached_property
    def sensor_names(self) -> tuple[str, ...]:
        """Names of the sensors: of its state variables, of its cameras, and those that only modules read."""
        state = [one.sensor for name, one in self.state.items() if one.sensor and "." not in name]
        cameras = [camera.sensor for camera in self.cameras.values()]
        return tuple(dict.fromkeys((*state, *cameras, *self.sensors)))

    @cached_property
    def module_variables(self) -> frozenset[str]:
        """Names of the state variables that modules measure; each counts only in decisions that read it."""
        return frozenset(name for name in self.state if "." in name)

    @cached_property
    def rule_variables(self) -> Mapping[str, Declared]:
        """Variables of the state that the invariants Φ may read: measured ones and histories of them."""
        hidden = self.module_variables - self.perception.in_invariants
        return {name: one for name, one in self.observed_variables.items() if name not in hidden}

    def __hash__(self) -> int:
        # Equal sites have one digest; sites with one digest can differ, as in settings of modules.
        return hash(self.digest)

    def with_modules(self, modules: Iterable[Ecm]) -> Site:
        """Replace the modules whose own state variables are part of the vocabulary.

        The site's own declaration stands for a variable that it shares.

        Args:
            modules: the modules.

        Returns:
            The site with their variables, under the same digest; the same site if it has exactly these.
        """
        shared = self.perception.shared
        state = {name: one for name, one in self.state.items() if "." not in name or name in shared}
        for module in modules:
            state |= {name: one for name, one in module.state.items() if name not in shared}
        enums = {name: one for name, one in self.enums.items() if "." not in name}
        enums |= enums_of_modules(state)
        if state == self.state and enums == self.enums:
            return self
        return replace(self, state=state, enums=enums)

    def with_configurations(self, configurations: Mapping[str, ModuleConfiguration]) -> Site:
        """Add the operator's settings of modules, which come before those of the site file.

        Args:
            configurations: settings by module.

        Returns:
            The site with them, under the same digest: certificates name what a module is bound to.
        """
        given = {name: one for name, one in configurations.items() if one}
        if not given:
            return self
        merged = {
            name: self.configurations.get(name, ModuleConfiguration()).updated(one)
            for name, one in given.items()
        }
        own = {
            name: self.operator_configurations.get(name, ModuleConfiguration()).updated(one)
            for name, one in given.items()
        }
        return replace(
            self,
            configurations={**self.configurations, **merged},
            operator_configurations={**self.operator_configurations, **own},
        )

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


def enums_of_modules(state: Mapping[str, Declared]) -> dict[str, EnumType]:
    """Collect the enums that modules declare, by the variables of these types.

    Args:
        state: variables by name.

    Returns:
        The enums by name, as in `clean_table.region`.
    """
    types = (one.variable.type for one in state.values())
    return {one.name: one for one in types if isinstance(one, EnumType) and "." in one.name}
