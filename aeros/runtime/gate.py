"""The gate: `decide` says whether one action may be executed now.  Pure, total, default deny.

Layers, all of them evaluated, every violated rule reported: input form; operator overrides;
lifecycle (the module is active, the skill is its own); envelope of the skill and permission of
the module; access, risk and quotas; Φ.  ALLOW means that none of them objects.

What is dropped and why that is sound: the compiled gate does not evaluate, on its way to ALLOW, the
permission and those invariants that the certificate says are PROVED of every action inside the
envelope.  The proof assumed the envelope and the declared ranges and nothing else, and both are
always checked here.  Whenever anything objects, everything is evaluated, so that reasons are complete.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import Enum
from fractions import Fraction
from typing import Any, cast

from aeros.runtime.conditions import CompiledCondition, Condition, SolverCondition, Truth
from aeros.runtime.configuration import Configuration
from aeros.runtime.decision import Caller, Decision, Reason, Verdict
from aeros.runtime.form import Form, Scalars, check_age, check_now, forms_of
from aeros.runtime.ports import Reading, Readings
from aeros.skill import Action
from aeros.spec.doubles import double_within
from aeros.spec.errors import InternalError
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower
from aeros.spec.expr.semantics import evaluate
from aeros.spec.model import ActionKind, Declared, Ecm, Rule, Site, Skill


class GateMode(Enum):
    """How conditions are decided; the decisions are the same."""

    COMPILED = "compiled"
    Z3 = "z3"
    SHADOW = "shadow"  # both, and a disagreement halts


class GateDisagreementError(InternalError):
    """The compiled gate and Z3 decided differently; nothing may move until somebody has looked."""


class Gate:
    """Decides actions under one configuration."""

    def __init__(self, configuration: Configuration, mode: GateMode = GateMode.COMPILED) -> None:
        compiled = mode is not GateMode.Z3
        self._decider = _Decider(configuration, compiled)
        self._shadow = _Decider(configuration, compiled=False) if mode is GateMode.SHADOW else None

    def decide(
        self, caller: Caller, readings: Readings, action: Action, now: float, usage: Mapping[str, int]
    ) -> Decision:
        """Whether `action`, asked for by `caller`, may be executed at `now`.

        readings: what is measured, by vocabulary name.
        now: seconds on the clock of the readings.
        usage: for each quota on this kind of action, how many were executed in its window until now.
        Raises `GateDisagreementError` in shadow mode, and nothing else, whatever it is given.
        """
        decision = self._decider.decide(caller, readings, action, now, usage)
        if self._shadow is not None:
            second = self._shadow.decide(caller, readings, action, now, usage)
            if (second.verdict, second.action) != (decision.verdict, decision.action):
                raise GateDisagreementError(f"compiled gate: {decision}; z3: {second}")
        return decision


@dataclass(frozen=True)
class _Entry:
    """Everything that decides one skill's actions of one kind."""

    kind: ActionKind
    parameters: Mapping[str, Form]
    required: frozenset[str]
    envelope: Condition
    permission: Condition | None
    rules: tuple[tuple[Rule, Condition], ...]
    residue: tuple[Condition, ...]


class _Decider:
    def __init__(self, configuration: Configuration, compiled: bool) -> None:
        self._configuration = configuration
        self._site: Site = configuration.site
        self._condition = CompiledCondition if compiled else SolverCondition
        self._state = forms_of(self._site.state)
        self._parameters = {name: forms_of(kind.parameters) for name, kind in self._site.kinds.items()}
        self._inputs = {
            (module, skill.id): forms_of(skill.inputs)
            for module, ecm in configuration.modules.items()
            for skill in ecm.skills.values()
        }
        self._rules = {name: self._rules_on(kind) for name, kind in self._site.kinds.items()}
        self._entries = {
            (module, skill.id, kind): self._entry(ecm, skill, self._site.kinds[kind])
            for module, ecm in configuration.modules.items()
            for skill in ecm.skills.values()
            for kind in skill.envelope
        }

    # Compiling.

    def _rules_on(self, kind: ActionKind) -> tuple[tuple[Rule, Condition], ...]:
        declared = self._declared(kind, {})
        return tuple(
            (rule, self._condition(rule.terms[kind.name], declared))
            for rule in self._site.rules_on(kind.name)
        )

    def _entry(self, ecm: Ecm, skill: Skill, kind: ActionKind) -> _Entry:
        declared = self._declared(kind, skill.inputs)
        envelope = skill.envelope[kind.name].term
        permitted = ecm.permission.get(kind.name)
        rules = self._rules[kind.name]
        guarded = self._configuration.certificates[ecm.id].guarded(skill.id, kind.name)
        terms = [envelope, *(rule.terms[kind.name] for rule, _ in rules)]
        if permitted is not None:
            terms.append(permitted.term)
        return _Entry(
            kind,
            self._parameters[kind.name],
            _state_read(terms),
            self._condition(envelope, declared),
            None if permitted is None else self._condition(permitted.term, declared),
            rules,
            tuple(condition for rule, condition in rules if rule.id in guarded),
        )

    def _declared(self, kind: ActionKind, inputs: Mapping[str, Declared]) -> tuple[Declared, ...]:
        return (*self._site.state.values(), *inputs.values(), *kind.parameters.values())

    # Deciding.

    def decide(self, caller: Any, readings: Any, action: Any, now: Any, usage: Any) -> Decision:
        fault = _request_fault(caller, readings, action, usage) or check_now(now)
        if fault is not None:
            return Decision(Verdict.DENY, None, (fault,))
        parameters = dict(action.parameters)
        reasons, values = self._object(caller, readings, action.kind, parameters, now, usage)
        if not reasons:
            return Decision(Verdict.ALLOW, Action(action.kind, _normal(parameters)), ())
        reduced = self._attenuate(action.kind, parameters, reasons, values)
        if reduced is not None:
            remaining, _ = self._object(caller, readings, action.kind, reduced, now, usage)
            if not remaining:
                return Decision(Verdict.ATTENUATE, Action(action.kind, _normal(reduced)), tuple(reasons))
        return Decision(Verdict.DENY, None, tuple(reasons))

    def _object(
        self,
        caller: Caller,
        readings: Readings,
        kind: str,
        parameters: Mapping[str, Any],
        now: float,
        usage: Mapping[str, int],
    ) -> tuple[list[Reason], Scalars]:
        """Every objection, in the order of the layers, and the well-formed values found on the way."""
        values: Scalars = {}
        entry = self._entries.get((caller.module, caller.skill, kind))
        required = entry.required if entry is not None else _required(self._rules.get(kind, ()), kind)
        reasons = list(self._form_faults(caller, readings, kind, parameters, now, required, values))
        reasons += self._finite_layers(caller, kind, usage)
        if not reasons and entry is not None and _allows(entry, values):
            return [], values
        reasons += self._conditions(entry, kind, values)
        return reasons, values

    def _form_faults(
        self,
        caller: Caller,
        readings: Readings,
        kind: str,
        parameters: Mapping[str, Any],
        now: float,
        required: frozenset[str],
        values: Scalars,
    ) -> Iterator[Reason]:
        yield from _take_all(self._parameters.get(kind, {}), parameters, f"of `{kind}`", values)
        inputs = self._inputs.get((caller.module, caller.skill), {})
        given = {f"inputs.{name}": value for name, value in caller.inputs.items()}
        yield from _take_all(inputs, given, f"of `{caller.skill}`", values)
        for name, reading in readings.items():
            form = self._state.get(name)
            if form is None:
                yield Reason("AE702", str(name), f"`{name}` is not a state variable of this site")
                continue
            fault = _reading_fault(form, reading, now, name in required, values)
            if fault is not None:
                yield fault
        for name in sorted(required - readings.keys()):
            yield Reason("AE703", name, f"`{name}` is not measured")

    def _finite_layers(self, caller: Caller, kind: str, usage: Mapping[str, int]) -> Iterator[Reason]:
        """Overrides, lifecycle, access, risk and quotas: finite sets and counts."""
        site = self._site
        declared = site.kinds.get(kind)
        if declared is None:
            yield Reason("AE702", kind, f"`{kind}` is not an action kind of this site")
        for block in site.blocks:
            if block.matches(caller.module, caller.skill, kind):
                yield Reason("AE710", block.id, f"the operator blocks it: {block.reason}")
        ecm = self._configuration.modules.get(caller.module)
        skill = None if ecm is None else ecm.skills.get(caller.skill)
        if ecm is None:
            yield Reason("AE720", caller.module, f"`{caller.module}` is not an active module")
        elif skill is None:
            yield Reason("AE720", caller.skill, f"`{caller.module}` has no skill `{caller.skill}`")
        if declared is not None and ecm is not None and skill is not None:
            yield from _access_faults(site, ecm, skill, declared)
        for quota in site.quotas:
            if kind in quota.kinds:
                yield from _quota_faults(quota.id, quota.at_most, usage)

    def _conditions(self, entry: _Entry | None, kind: str, values: Scalars) -> Iterator[Reason]:
        """Envelope, permission and Φ, each where all its variables have well-formed values."""
        if entry is None and kind in self._site.kinds:
            yield Reason("AE730", kind, f"`{kind}` is not in the envelope of the skill")
        if entry is not None:
            yield from _failing("AE730", kind, "outside the envelope of the skill", entry.envelope, values)
        if entry is not None and entry.permission is None:
            yield Reason("AE731", kind, f"the module has no permission for `{kind}`")
        elif entry is not None and entry.permission is not None:
            yield from _failing(
                "AE731", kind, "outside the permission of the module", entry.permission, values
            )
        for rule, condition in self._rules.get(kind, ()):
            yield from _failing(
                "AE750", rule.id, f"breaks `{rule.text}`: {rule.rationale}", condition, values
            )

    # Attenuating.

    def _attenuate(
        self, kind: str, parameters: Mapping[str, Any], reasons: list[Reason], values: Scalars
    ) -> dict[str, Any] | None:
        """The parameters reduced as every violated rule declares; None where something else objects too."""
        violated = {reason.rule for reason in reasons}
        rules = [rule for rule, _ in self._rules.get(kind, ()) if rule.id in violated]
        if any(reason.code != "AE750" for reason in reasons) or len(rules) != len(violated):
            return None
        if any(kind not in rule.attenuations for rule in rules):
            return None
        reduced = dict(parameters)
        exact = {name: Fraction(v) if type(v) is float else v for name, v in values.items()}
        for rule in rules:
            for name, term in rule.attenuations[kind].items():
                declared = self._site.kinds[kind].parameters[name]
                value = cast("Fraction", evaluate(lower(term), exact))
                # Rounded towards zero, so that the double is no larger than what was declared.
                bounds = (-abs(value), abs(value))
                reduced[name] = double_within(value, bounds)
                exact[declared.name] = Fraction(reduced[name])
        return reduced


def _allows(entry: _Entry, values: Scalars) -> bool:
    """The compiled way to ALLOW: the envelope, and what the proof left to the gate."""
    if not isinstance(entry.envelope, CompiledCondition) or entry.permission is None:
        return False
    return entry.envelope.holds(values) and all(
        condition.decide(values) is Truth.HOLDS for condition in entry.residue
    )


def _failing(code: str, rule: str, text: str, condition: Condition, values: Scalars) -> Iterator[Reason]:
    if not condition.names <= values.keys():
        return  # a variable of it is missing or malformed, which has been reported as such
    truth = condition.decide(values)
    if truth is Truth.FAILS:
        yield Reason(code, rule, text)
    elif truth is Truth.UNDECIDED:
        yield Reason("AE790", rule, f"the solver could not decide `{rule}`")


def _request_fault(caller: Any, readings: Any, action: Any, usage: Any) -> Reason | None:
    """Why the request is not even a request."""
    if type(caller) is not Caller or type(caller.module) is not str or type(caller.skill) is not str:
        return Reason("AE701", "caller", "the caller is not a module's skill")
    if type(action) is not Action or type(action.kind) is not str:
        return Reason("AE701", "action", "the action is not an action of some kind")
    for name, mapping in (
        ("inputs", caller.inputs),
        ("parameters", action.parameters),
        ("state", readings),
        ("usage", usage),
    ):
        if type(mapping) is not dict or not all(type(key) is str for key in mapping):
            return Reason("AE701", name, f"the {name} are not a mapping by name")
    return None


def _take_all(
    forms: Mapping[str, Form], given: Mapping[str, Any], whose: str, values: Scalars
) -> Iterator[Reason]:
    """Take every parameter or input; what is missing, unknown or malformed is an objection."""
    for name in given:
        if name not in forms:
            yield Reason("AE702", name, f"`{name}` is not declared {whose}")
    for form in forms.values():
        name = form.declared.name
        if name in given:
            fault = form.take(given[name], values)
        elif form.declared.default is not None:
            fault = form.take(_as_given(form.declared.default), values)
        else:
            fault = Reason("AE703", name, f"`{name}` {whose} is missing")
        if fault is not None:
            yield fault


def _as_given(default: Any) -> Any:
    """A declared default as a skill would give it: exact rationals become doubles."""
    if isinstance(default, Fraction):
        return float(default)
    return tuple(float(part) for part in default) if isinstance(default, tuple) else default


def _reading_fault(form: Form, reading: Any, now: float, required: bool, values: Scalars) -> Reason | None:
    name = form.declared.name
    if type(reading) is not Reading:
        return Reason("AE701", name, f"`{name}` is not a value with a time")
    own: Scalars = {}
    fault = check_age(form, reading, now, required) or form.take(reading.value, own)
    if fault is None:
        values.update(own)
    return fault


def _access_faults(site: Site, ecm: Ecm, skill: Skill, kind: ActionKind) -> Iterator[Reason]:
    usable = skill.actuators & ecm.access.actuators & site.access_of(ecm.id).actuators
    for actuator in sorted(kind.actuators - usable):
        yield Reason("AE740", actuator, f"`{skill.id}` may not move `{actuator}`")
    if kind.risk > skill.risk:
        yield Reason("AE741", skill.id, f"`{kind.name}` carries more risk than `{skill.id}` declares")
    if skill.risk > site.risk_ceiling:
        yield Reason("AE741", skill.id, f"`{skill.id}` carries more risk than the site allows")


def _quota_faults(quota: str, at_most: int, usage: Mapping[str, int]) -> Iterator[Reason]:
    used = usage.get(quota)
    if type(used) is not int or used < 0:
        yield Reason("AE703", quota, f"how much of the quota `{quota}` is used up is not known")
    elif used >= at_most:
        yield Reason("AE742", quota, f"the quota `{quota}` is used up: {used} of {at_most}")


def _state_read(terms: list[t.Term]) -> frozenset[str]:
    """The state variables that any of the terms reads: those a decision needs fresh."""
    return frozenset(
        name
        for term in terms
        for name, variable in t.variables_of(term).items()
        if variable.role is t.Role.STATE
    )


def _required(rules: tuple[tuple[Rule, Condition], ...], kind: str) -> frozenset[str]:
    return _state_read([rule.terms[kind] for rule, _ in rules])


def _normal(parameters: Mapping[str, Any]) -> dict[str, Any]:
    """The parameters as the plant gets them: whole numbers as doubles, lists as tuples."""
    return {name: _normal_value(value) for name, value in parameters.items()}


def _normal_value(value: Any) -> Any:
    if type(value) is int:
        return float(value)
    return tuple(_normal_value(part) for part in value) if type(value) in (list, tuple) else value
