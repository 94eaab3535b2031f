"""Elaboration of a declared site to the resolved model: names, units and types, with every fault reported."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from fractions import Fraction
from typing import TypeVar

from aeros.spec.declared import site as declared
from aeros.spec.diagnostics.codes import Diagnostics, did_you_mean
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.elaborate.expressions import (
    elaborate_condition,
    elaborate_expression,
    elaborate_number,
    elaborate_quantity,
    elaborate_unit,
)
from aeros.spec.elaborate.motion import elaborate_motion
from aeros.spec.elaborate.past_time import HistoryCollector
from aeros.spec.elaborate.scopes import action_scope, constant_scope, joint_scope
from aeros.spec.elaborate.vocabulary import check_name_is_free, elaborate_state, elaborate_variable
from aeros.spec.expr import terms as t
from aeros.spec.expr.scope import AxisAlignedBox, Scope
from aeros.spec.expr.types import EnumType, FamilyType, RealType
from aeros.spec.expr.units import LENGTH, TIME
from aeros.spec.model.policy import (
    Access,
    Durability,
    Execute,
    IsolationPolicy,
    McpPolicy,
    ModuleLimits,
    OperatorOverride,
    Quota,
)
from aeros.spec.model.rules import ActionKind, Conjunct, JointRule, Risk, Rule
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared
from aeros.spec.text.fields import ExpressionField, MappingField, TextField

_T = TypeVar("_T")
_LONGEST_TIMEOUT = 3600  # s; a longer time-out would halt nothing in time
_HasId = declared.Invariant | declared.JointInvariant | declared.OperatorOverride | declared.Quota


def elaborate_site(site: declared.Site, digest: str, diagnostics: Diagnostics) -> Site | None:
    """Elaborate a declared site.

    Args:
        site: the declared site.
        digest: SHA-256 of the site file, in hexadecimal.
        diagnostics: receives the faults.

    Returns:
        The model of the site, or None after reporting every fault.
    """
    before = len(diagnostics)
    elaborated = _SiteElaborator(site, diagnostics).site(digest)
    return elaborated if len(diagnostics) == before else None


class _SiteElaborator:
    def __init__(self, site: declared.Site, diagnostics: Diagnostics) -> None:
        self._declared = site
        self._diagnostics = diagnostics
        self._used_names: dict[str, str] = {}
        self.enums: dict[str, EnumType] = {}
        self.constants: dict[str, t.Term] = {}
        self.volumes: dict[str, AxisAlignedBox] = {}
        self.state: dict[str, Declared] = {}
        self.kinds: dict[str, ActionKind] = {}
        self._histories = HistoryCollector()

    def site(self, digest: str) -> Site:
        site, before = self._declared, len(self._diagnostics)
        for name, members in site.enums:
            self._enum(name, members)
        for name, constant in site.constants:
            self._constant(name, constant)
        for name, volume in site.volumes:
            self._volume(name, volume)
        for name, variable in site.state:
            one = elaborate_state(name.value, variable, self.enums, self._diagnostics)
            if (
                check_name_is_free(name, self._used_names, "state variable", self._diagnostics)
                and one is not None
            ):
                self._used_names[name.value] = "a state variable"
                self.state[name.value] = one
        for name, kind in site.actions:
            self._kind(name, kind)
        # Rules are elaborated only if all declarations are right: a faulty name is not an undeclared one.
        whole = len(self._diagnostics) == before
        self._check_protective()
        self._check_unique(site.invariants, site.joint, site.policy.blocks, site.policy.quotas)
        rules = tuple(rule for one in site.invariants if whole and (rule := self._rule(one)) is not None)
        joint = tuple(found for one in site.joint if whole and (found := self._joint(one)) is not None)
        access_of = self._access if whole else elaborate_access
        policy = site.policy
        return Site(
            id=site.id.value,
            digest=digest,
            enums=self.enums,
            constants=self.constants,
            volumes=self.volumes,
            state=self.state,
            kinds=self.kinds,
            rules=rules,
            access=access_of(policy.access),
            grants={name.value: access_of(access) for name, access in policy.grants},
            risk_ceiling=Risk[policy.risk_ceiling.value.upper()],
            limits=self._limits(policy.limits),
            blocks=tuple(self._block(block) for block in policy.blocks),
            quotas=tuple(quota for one in policy.quotas if (quota := self._quota(one)) is not None),
            resources={name.value: count.value for name, count in site.resources},
            span=site.span,
            grant_spans={name.value: name.span for name, _ in policy.grants},
            joint_rules=joint,
            histories=self._histories.collected,
            policy_spans=_policy_spans(site),
            motion=elaborate_motion(site.motion, self, self._diagnostics) if whole and site.motion else None,
            durability=Durability(policy.audit.durability.value if policy.audit else "every-record"),
            isolation=self._isolation(policy.isolation),
            mcp=_mcp(policy.mcp),
            stops_on_undeclared_outcome=policy.undeclared_outcome is None
            or policy.undeclared_outcome.value == "stop",
        )

    def _enum(self, name: TextField, members: tuple[TextField, ...]) -> None:
        if not check_name_is_free(name, self._used_names, "enum", self._diagnostics):
            return
        self._used_names[name.value] = "an enum"
        for member in members:
            if check_name_is_free(member, self._used_names, "member", self._diagnostics):
                self._used_names[member.value] = f"a member of `{name.value}`"
        if not members:
            self._diagnostics.error("AE112", f"the enum `{name.value}` has no member", name.span)
        self.enums[name.value] = EnumType(name.value, tuple(member.value for member in members))

    def _constant(self, name: TextField, constant: declared.Constant) -> None:
        if not check_name_is_free(name, self._used_names, "constant", self._diagnostics):
            return
        self._used_names[name.value] = "a constant"
        if (constant.value is None) == (constant.values is None):
            self._diagnostics.error(
                "AE102", "a constant has either `value` or `index`, `unit` and `values`", constant.span
            )
        elif constant.value is not None:
            self._scalar_constant(name, constant.value)
        else:
            self._table(name, constant)

    def _scalar_constant(self, name: TextField, value: ExpressionField) -> None:
        number = elaborate_number(value, constant_scope(self), self._diagnostics)
        if number is not None:
            self.constants[name.value] = number

    def _table(self, name: TextField, constant: declared.Constant) -> None:
        unit = elaborate_unit(constant.unit, self._diagnostics)
        index = None if constant.index is None else self.enums.get(constant.index.value)
        if index is None:
            span = constant.span if constant.index is None else constant.index.span
            self._diagnostics.error("AE122", "`values` need an `index` that is a declared enum", span)
            return
        values = constant.values or ()
        if len(values) != len(index.members):
            self._diagnostics.error(
                "AE112",
                f"{index.name} has {len(index.members)} members, but {len(values)} values stand here",
                constant.span,
            )
        elif unit is not None:
            numbers = tuple(number.value * unit.factor for number in values)
            self.constants[name.value] = t.ConstantTable(
                name.value, FamilyType(index, RealType(unit.dimension)), numbers
            )

    def _volume(self, name: TextField, volume: declared.Volume) -> None:
        if not check_name_is_free(name, self._used_names, "volume", self._diagnostics):
            return
        self._used_names[name.value] = "a volume"
        corners = [self._corner(corner, volume) for corner in (volume.lower, volume.upper)]
        lower, upper = corners
        if lower is None or upper is None:
            return
        if any(low >= high for low, high in zip(lower, upper, strict=True)):
            self._diagnostics.error(
                "AE208",
                f"the volume `{name.value}` is empty",
                volume.span,
                help=("each coordinate of `lower` must be below that of `upper`",),
            )
            return
        self.volumes[name.value] = AxisAlignedBox(lower, upper)

    def _corner(
        self, corner: tuple[TextField, ...], volume: declared.Volume
    ) -> tuple[Fraction, Fraction, Fraction] | None:
        if len(corner) != 3:
            self._diagnostics.error(
                "AE112", f"a corner has three coordinates, not {len(corner)}", volume.span
            )
            return None
        x, y, z = (elaborate_quantity(coordinate, LENGTH, self._diagnostics) for coordinate in corner)
        return None if x is None or y is None or z is None else (x, y, z)

    def _kind(self, name: TextField, kind: declared.ActionKind) -> None:
        parameters: dict[str, Declared] = {}
        for parameter, quantity in kind.parameters:
            if not check_name_is_free(parameter, self._used_names, "parameter", self._diagnostics):
                continue
            one = elaborate_variable(
                parameter.value, quantity, t.VariableRole.PARAMETER, self.enums, self._diagnostics
            )
            if one is not None:
                parameters[parameter.value] = one
        self.kinds[name.value] = ActionKind(
            name.value,
            frozenset(actuator.value for actuator in kind.actuators),
            Risk[kind.risk.value.upper()],
            kind.protective is not None and kind.protective.value,
            parameters,
            name.span,
        )

    def _check_protective(self) -> None:
        stops = [kind for kind in self.kinds.values() if kind.protective]
        if len(stops) != 1:
            self._diagnostics.error(
                "AE607",
                f"a site has exactly one protective stop; {len(stops)} action kinds are `protective: true`",
                stops[1].span if stops else self._declared.span,
                help=("declare an action kind `stop` without parameters and with `protective: true`",),
            )
        for stop in stops:
            if stop.risk is not Risk.LOW:
                self._diagnostics.error(
                    "AE607", "the protective stop is of low risk: no ceiling may deny it", stop.span
                )
            if stop.parameters:
                self._diagnostics.error(
                    "AE607", "a protective stop has no parameters to get wrong", stop.span
                )

    def _check_unique(self, *groups: Iterable[_HasId]) -> None:
        seen: dict[str, TextField] = {}
        for one in (one for group in groups for one in group):
            if one.id.value in seen:
                self._diagnostics.error("AE120", f"the rule `{one.id.value}` is declared twice", one.id.span)
            seen[one.id.value] = one.id

    def _rule(self, invariant: declared.Invariant) -> Rule | None:
        if invariant.on == ():
            self._diagnostics.error(
                "AE112",
                f"the rule `{invariant.id.value}` governs no action kind",
                invariant.id.span,
                help=("name one under `on`, or leave `on` out: the rule then governs all but the stop",),
            )
            return None
        kinds = (
            self._resolve_kinds(invariant.on)
            if invariant.on is not None
            else [k for k in self.kinds.values() if not k.protective]
        )
        terms: dict[str, t.Term] = {}
        conjuncts: dict[str, tuple[Conjunct, ...]] = {}
        premises: dict[str, tuple[Conjunct, ...]] = {}
        alternatives: dict[str, tuple[Conjunct, ...]] = {}
        attenuations: dict[str, dict[str, t.Term]] = {}
        for kind in kinds:
            scope = replace(action_scope(self, kind), past=True)
            found = elaborate_condition(invariant.require, scope, self._diagnostics)
            if found is None:
                return None  # the same fault would be found for every kind
            terms[kind.name] = self._histories.replace_past_terms(found.term, invariant.require.span)
            conjuncts[kind.name] = self._replace_past_terms(found.conjuncts)
            premises[kind.name] = self._replace_past_terms(found.premises)
            alternatives[kind.name] = self._replace_past_terms(found.alternatives)
            reduced = self._attenuation(invariant.attenuate, kind, scope)
            if reduced:
                attenuations[kind.name] = reduced
        return Rule(
            invariant.id.value,
            invariant.require.value,
            invariant.rationale.value,
            invariant.source.value,
            terms,
            attenuations,
            invariant.span,
            invariant.require.span,
            conjuncts,
            premises,
            alternatives,
        )

    def _replace_past_terms(self, parts: tuple[Conjunct, ...]) -> tuple[Conjunct, ...]:
        return tuple(
            Conjunct(self._histories.replace_past_terms(part.term, part.span), part.span) for part in parts
        )

    def _joint(self, invariant: declared.JointInvariant) -> JointRule | None:
        if len(invariant.on) != 2:
            self._diagnostics.error(
                "AE112", "a joint rule has two roles, as in `on: {a: move, b: drive}`", invariant.id.span
            )
            return None
        before = len(self._diagnostics)
        for role, _ in invariant.on:
            check_name_is_free(role, self._used_names, "role", self._diagnostics)
        kinds = {
            role.value: self._resolve_name(kind, self.kinds, "an action kind") for role, kind in invariant.on
        }
        roles = {role: kind for role, kind in kinds.items() if kind is not None}
        if len(self._diagnostics) > before:
            return None
        scope = replace(joint_scope(self, roles), past=True)
        found = elaborate_condition(invariant.require, scope, self._diagnostics)
        if found is None:
            return None
        first, second = ((role, kind.name) for role, kind in roles.items())
        return JointRule(
            invariant.id.value,
            invariant.require.value,
            invariant.rationale.value,
            invariant.source.value,
            (first, second),
            self._histories.replace_past_terms(found.term, invariant.require.span),
            invariant.span,
            invariant.require.span,
            self._replace_past_terms(found.conjuncts),
        )

    def _attenuation(
        self, entries: MappingField[ExpressionField], kind: ActionKind, scope: Scope
    ) -> dict[str, t.Term]:
        reduced: dict[str, t.Term] = {}
        for name, expression in entries:
            parameter = kind.parameters.get(name.value)
            if parameter is None or not isinstance(parameter.variable.type, RealType):
                self._diagnostics.error(
                    "AE122", f"`{name.value}` is not a real parameter of `{kind.name}`", name.span
                )
                continue
            term = elaborate_expression(expression, scope, self._diagnostics, parameter.variable.type)
            if term is not None:
                reduced[name.value] = self._histories.replace_past_terms(term, expression.span)
        return reduced

    def _resolve_kinds(self, names: tuple[TextField, ...]) -> list[ActionKind]:
        return [
            kind
            for name in names
            if (kind := self._resolve_name(name, self.kinds, "an action kind")) is not None
        ]

    def _resolve_name(self, name: TextField, among: Mapping[str, _T], what: str) -> _T | None:
        if name.value not in among:
            near = did_you_mean(name.value, among)
            help_ = (
                f"did you mean `{near}`?"
                if near
                else "the site declares " + ", ".join(f"`{k}`" for k in among)
            )
            self._diagnostics.error("AE122", f"`{name.value}` is not {what}", name.span, help=(help_,))
        return among.get(name.value)

    def _access(self, access: declared.Access) -> Access:
        actuators = {name for kind in self.kinds.values() for name in kind.actuators}
        sensors = {one.sensor: None for one in self.state.values() if one.sensor is not None}
        for name in access.actuators:
            self._resolve_name(name, dict.fromkeys(sorted(actuators), True), "an actuator of any action kind")
        for name in access.sensors:
            self._resolve_name(name, dict.fromkeys(sensors, True), "a sensor of any state variable")
        return elaborate_access(access)

    def _limits(self, limits: declared.ModuleLimits) -> ModuleLimits:
        timeout = self._duration(limits.skill_timeout, "a time-out")
        found = ModuleLimits(timeout or Fraction(0), limits.retries.value, limits.replans.value)
        planning = None if limits.planning is None else self._duration(limits.planning, "the time for a plan")
        return found if planning is None else replace(found, planning=planning)

    def _duration(self, text: TextField, what: str) -> Fraction | None:
        duration = elaborate_quantity(text, TIME, self._diagnostics)
        if duration is not None and not 0 < duration <= _LONGEST_TIMEOUT:
            self._diagnostics.error("AE129", f"{what} is longer than 0 s and at most 1 h", text.span)
        return duration

    def _isolation(self, isolation: declared.IsolationPolicy | None) -> IsolationPolicy:
        usual = IsolationPolicy()
        if isolation is None:
            return usual
        within: Fraction | None = usual.answer_timeout_s
        if isolation.answer_within is not None:
            within = elaborate_quantity(isolation.answer_within, TIME, self._diagnostics)
            if within is not None and not 0 < within <= _LONGEST_TIMEOUT:
                self._diagnostics.error(
                    "AE129", "a time-out is longer than 0 s and at most 1 h", isolation.answer_within.span
                )
        require = isolation.require
        return IsolationPolicy(
            usual.required_layers if require is None else frozenset(layer.value for layer in require),
            isolation.missing is None or isolation.missing.value == "refuse",
            frozenset(name.value for name in isolation.trusted),
            within or usual.answer_timeout_s,
        )

    def _block(self, block: declared.OperatorOverride) -> OperatorOverride:
        if block.skill is not None and block.module is None:
            self._diagnostics.error("AE102", "a blocked skill needs its `module`", block.skill.span)
        if block.action is not None:
            self._resolve_name(block.action, self.kinds, "an action kind")
        if block.module is None and block.action is None:
            self._diagnostics.error(
                "AE102", "an operator override needs a `module`, a `skill` or an `action`", block.span
            )
        names = (None if name is None else name.value for name in (block.module, block.skill, block.action))
        module, skill, action = names
        return OperatorOverride(block.id.value, block.reason.value, module, skill, action, block.id.span)

    def _quota(self, quota: declared.Quota) -> Quota | None:
        within = elaborate_quantity(quota.within, TIME, self._diagnostics)
        kinds = self._resolve_kinds(quota.on)
        if within is None:
            return None
        if within <= 0:
            self._diagnostics.error(
                "AE608", "a quota's window must be longer than nothing", quota.within.span
            )
        for kind in kinds:
            if kind.protective:
                self._diagnostics.error(
                    "AE602", "a quota may not run out for the protective stop", quota.span
                )
        return Quota(
            quota.id.value, frozenset(kind.name for kind in kinds), quota.at_most.value, within, quota.id.span
        )


def _mcp(mcp: declared.McpPolicy | None) -> McpPolicy:
    usual = McpPolicy()
    if mcp is None:
        return usual
    return McpPolicy(
        usual.execute if mcp.execute is None else Execute(mcp.execute.value),
        usual.max_steps if mcp.most_steps is None else mcp.most_steps.value,
        usual.skills if mcp.skills is None else frozenset(name.value for name in mcp.skills),
    )


def _policy_spans(site: declared.Site) -> dict[str, SourceSpan]:
    policy, limits = site.policy, site.policy.limits
    return {
        "policy/access": policy.access.key_span or policy.access.span,
        "policy/risk_ceiling": policy.risk_ceiling.span,
        "policy/limits/skill_timeout": limits.skill_timeout.span,
        "policy/limits/retries": limits.retries.span,
        "policy/limits/replans": limits.replans.span,
        **({} if limits.planning is None else {"policy/limits/planning": limits.planning.span}),
        **({} if policy.isolation is None else {"policy/isolation": policy.isolation.span}),
        **({} if policy.mcp is None else {"policy/mcp": policy.mcp.span}),
        **(
            {}
            if policy.undeclared_outcome is None
            else {"policy/undeclared_outcome": policy.undeclared_outcome.span}
        ),
        **{f"resources/{name.value}": count.span for name, count in site.resources},
    }


def elaborate_access(access: declared.Access) -> Access:
    """Collect the names of an access list in sets, without checking them.

    Args:
        access: declared lists of actuators, sensors, channels and computing devices.

    Returns:
        The same names as sets.
    """
    groups = (access.actuators, access.sensors, access.channels, access.compute)
    return Access(*(frozenset(name.value for name in group) for group in groups))
