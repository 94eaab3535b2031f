"""The compiled gate: decides whether one action may be executed now. Pure, total, denies by default.

It evaluates all layers and reports every violated rule: input form; operator overrides; lifecycle (the module
is active, the skill belongs to it); access, risk and quotas; the envelope of the skill and the permission of
the module; Φ. It allows an action only if no layer objects.

Skipped work, and why that is sound: before it allows an action, the compiled gate does not evaluate the
permission and those invariants that the certificate says are PROVED of every action inside the envelope. The
proof assumed nothing but the envelope and the declared ranges, and the gate always checks both. If anything
objects, the gate evaluates everything, so that the reasons are complete.

Most requests are well-formed and of kinds in the envelope; the fast path (`compiled/fast_path.py`) decides
these.

An action that begins while others are under way is decided a second time, together with them.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cached_property, partial
from typing import Any, Final

from aeros.runtime.gate.attenuation import attenuate_parameters
from aeros.runtime.gate.compiled.fast_path import (
    DecisionCriteria,
    DenialFor,
    FastDecide,
    FastPaths,
    ReadEach,
    SnapshotCache,
    compile_fast_path,
    compile_read_each,
    decide_fast,
)
from aeros.runtime.gate.compiled.rules import MonitorRules
from aeros.runtime.gate.conditions import (
    CompiledCondition,
    ConditionValue,
    DecidableCondition,
    GateSolver,
    SolverCondition,
)
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import Caller, Decision, DecisionKind, Reason
from aeros.runtime.gate.finite_layers import finite_objections
from aeros.runtime.gate.joint_rules import ActiveAction, JointRules
from aeros.runtime.gate.port import Gate
from aeros.runtime.gate.request_check import (
    individual_readings,
    request_fault,
    to_plant_parameters,
    unpack_arguments,
    unpack_readings,
)
from aeros.runtime.gate.value_check import Scalars, ValueChecker, check_time, value_checkers
from aeros.runtime.ports import Readings, Snapshot
from aeros.skill import Action
from aeros.spec.backends.compiled import CompiledConditions, compile_conditions
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.expr import terms as t
from aeros.spec.model.ecm import Ecm, Skill
from aeros.spec.model.rules import ActionKind, Rule
from aeros.spec.model.variables import Declared, ranges_of
from aeros.spec.obligations.claim_id import ClaimForm

_MAX_GATES: Final = 4
"""Number of gates of one executor that are kept; the least recently used one is forgotten."""


class GateMode(Enum):
    """Method of evaluating conditions; the decisions are the same."""

    COMPILED = "compiled"
    Z3 = "z3"
    CHECKED = "checked"  # both; a disagreement halts the robot

    @classmethod
    def _missing_(cls, value: object) -> GateMode | None:
        """Read the mode of a run that an earlier release saved, where CHECKED was called `shadow`."""
        return cls.CHECKED if value == "shadow" else None


class GateDisagreementError(InternalError):
    """The compiled gate and Z3 decided differently; nothing may move until a person has investigated.

    Args:
        compiled: decision of the compiled gate.
        z3: decision by Z3.
    """

    def __init__(self, compiled: Decision, z3: Decision) -> None:
        super().__init__(f"compiled gate: {compiled}; z3: {z3}")
        self.compiled = compiled
        self.z3 = z3


@dataclass
class DecisionTally:
    """Numbers of decisions of a gate and of those that replaced it, in mode CHECKED; 0 in other modes.

    Attributes:
        decided: decisions on an action alone.
        confirmed: those of them that Z3 decided too, with the same result.
    """

    decided: int = 0
    confirmed: int = 0


class CompiledGate(Gate):
    """A gate compiled from a site's policy and from the certificates of its modules.

    In mode CHECKED, Z3 decides every request a second time, and every joint decision, from the rules of the
    site and the module's envelope and permission, without the certificates. An action moves only if both
    decide the same. Z3 checks conditions; both deciders share the checks of form, range and age, the finite
    layers and the arithmetic of attenuation. The swept volume of a motion is not Z3's question.

    Attributes:
        mode: the method of evaluating conditions.
        tally: numbers of decisions so far, continued by `with_configuration`.

    Args:
        configuration: the site and its certified modules.
        mode: the method of evaluating conditions.
        predecessor: gate that this one replaces, with the same mode; None if there is none.
    """

    def __init__(
        self,
        configuration: Configuration,
        mode: GateMode = GateMode.COMPILED,
        predecessor: CompiledGate | None = None,
    ) -> None:
        self.mode = mode
        # The latest gates of this line by the digest of what they enforce: a swap back compiles nothing.
        fresh = OrderedDict[str, CompiledGate]()
        self._latest: OrderedDict[str, CompiledGate] = fresh if predecessor is None else predecessor._latest
        self._latest[configuration.digest] = self
        if len(self._latest) > _MAX_GATES:
            self._latest.popitem(last=False)
        self.tally: DecisionTally = DecisionTally() if predecessor is None else predecessor.tally
        self._site = configuration.site
        compiled = mode is not GateMode.Z3
        self._decider = _Decider(configuration, compiled)
        self._checker = _Decider(configuration, compiled=False) if mode is GateMode.CHECKED else None

    @cached_property
    def monitor_rules(self) -> MonitorRules:
        """The rules that monitors evaluate for the actions this gate allowed; compiled in every mode."""
        return MonitorRules(self._site)

    def with_configuration(self, configuration: Configuration) -> CompiledGate:
        """Implement `Gate.with_configuration`: the new gate has the same mode."""
        known = self._latest.get(configuration.digest)
        if known is not None:
            self._latest.move_to_end(configuration.digest)
            return known
        return CompiledGate(configuration, self.mode, self)

    def decide(
        self, caller: Caller, readings: Readings, action: Action, now: float, usage: Mapping[str, int]
    ) -> Decision:
        """Implement `Gate.decide`; total: every malformed request is denied.

        Raises:
            GateDisagreementError: in mode `checked`, the compiled gate and Z3 decide differently.
        """
        decision = self._decider.decide(caller, readings, action, now, usage)
        if self._checker is None:
            return decision
        self.tally.decided += 1
        second = self._checker.decide(caller, readings, action, now, usage)
        self.tally.confirmed += second == decision
        return _agreed(decision, second)

    def decide_jointly(
        self, decision: Decision, readings: Readings, now: float, active_actions: Sequence[ActiveAction]
    ) -> Decision:
        """Implement `Gate.decide_jointly`.

        Raises:
            GateDisagreementError: in mode `checked`, the compiled gate and Z3 decide differently.
        """
        together = self._decider.decide_jointly(decision, readings, now, active_actions)
        if self._checker is None:
            return together
        return _agreed(together, self._checker.decide_jointly(decision, readings, now, active_actions))


def _agreed(decision: Decision, second: Decision) -> Decision:
    """Return the decision of both deciders; a denial if Z3 ran out of its budget.

    Raises:
        GateDisagreementError: they decided differently.
    """
    if second == decision:
        return decision
    if any(reason.code == "AE790" for reason in second.reasons):
        return Decision(DecisionKind.DENY, None, second.reasons)
    raise GateDisagreementError(decision, second)


@dataclass(frozen=True)
class _CompiledKindRules:
    """The rules of Φ on one action kind.

    conditions: of each rule, with the reason to report if it does not hold.
    required_state: the state variables that the rules read, to decide or to attenuate.
    """

    rules: tuple[Rule, ...]
    conditions: tuple[tuple[DecidableCondition, Reason], ...]
    parameters: Mapping[str, ValueChecker]
    required_state: frozenset[str]


@dataclass(frozen=True)
class _CompiledSkillKind:
    """Everything else that decides one skill's actions of one kind.

    envelope_and_permission: both conditions, with the reason to report if they do not hold.
    residual_condition: the envelope, and those parts of permission and Φ that it is not proved to imply.
    required_state: the state variables that any condition reads; a decision needs fresh readings of them.
    """

    envelope_and_permission: tuple[tuple[DecidableCondition, Reason], ...]
    residual_condition: DecidableCondition
    required_state: frozenset[str]


class _CompiledRules:
    """The conditions of one configuration, each compiled when it is first asked for."""

    def __init__(self, configuration: Configuration, compiled: bool) -> None:
        self._configuration = configuration
        self._compiled = compiled
        self._solver = GateSolver()
        site = configuration.site
        self._state = value_checkers(site.observed_variables)
        self._module_variables = site.module_variables
        self._kinds = {name: self._kind_rules(kind) for name, kind in site.kinds.items()}
        self._inputs: dict[tuple[str, str], dict[str, ValueChecker]] = {}
        self._entries: dict[tuple[str, str, str], _CompiledSkillKind] = {}
        self._uncompiled: dict[tuple[str, str, str], tuple[Ecm, Skill, ActionKind]] = {}
        self._one_by_one: dict[frozenset[str], ReadEach] = {}
        self._compiled_rules: dict[str, CompiledConditions] = {}
        self._fast_paths = FastPaths()
        self._joint = JointRules(site, compiled=compiled, solver=self._solver)
        for module, ecm in configuration.modules.items():
            for skill in ecm.skills.values():
                self._inputs[module, skill.id] = value_checkers(skill.inputs)
                for kind in skill.envelope:
                    self._add(ecm, skill, site.kinds[kind])

    def _add(self, ecm: Ecm, skill: Skill, kind: ActionKind) -> None:
        at = ecm.id, skill.id, kind.name
        self._uncompiled[at] = ecm, skill, kind
        if self._compiled:
            self._fast_paths.add(at, partial(self._first_fast_path, at))

    def _entry(self, at: tuple[str, str, str]) -> _CompiledSkillKind | None:
        """Return what decides a skill's actions of one kind; None if there is no such skill or kind."""
        if at not in self._entries and at in self._uncompiled:
            self._compile(*self._uncompiled[at])
        return self._entries.get(at)

    def _first_fast_path(self, at: tuple[str, str, str]) -> FastDecide:
        self._entry(at)  # which adds the compiler of the fast path
        return self._fast_paths.compile(at)

    def _kind_rules(self, kind: ActionKind) -> _CompiledKindRules:
        rules = self._configuration.site.rules_for_kind(kind.name)
        read = [
            term
            for rule in rules
            for term in (rule.terms[kind.name], *rule.attenuations.get(kind.name, {}).values())
        ]
        return _CompiledKindRules(
            rules,
            tuple(
                (self._condition(rule.terms[kind.name], kind, {}), _violation_reason(rule)) for rule in rules
            ),
            value_checkers(kind.parameters),
            _state_variables_read(read),
        )

    def _compile(self, ecm: Ecm, skill: Skill, kind: ActionKind) -> None:
        of_kind, at = self._kinds[kind.name], (ecm.id, skill.id, kind.name)
        envelope = skill.envelope[kind.name].term
        permitted = ecm.permitted_actions[kind.name].term if kind.name in ecm.permitted_actions else t.FALSE
        claims = {
            ClaimForm.ENVELOPE_OBEYS(skill.id, kind.name, rule.id): rule.terms[kind.name]
            for rule in of_kind.rules
        }
        claims[ClaimForm.ENVELOPE_PERMITTED(skill.id, kind.name)] = permitted
        # Without a permission nothing counts as proved, whatever a certificate says.
        relied_on = self._compiled and permitted != t.FALSE
        proved = self._configuration.proved_obligations(ecm.id) if relied_on else frozenset()
        left = [term for obligation, term in claims.items() if obligation not in proved]
        sufficient = t.conjunction(envelope, *left)
        self._entries[at] = entry = _CompiledSkillKind(
            (
                (
                    self._condition(envelope, kind, skill.inputs),
                    Reason("AE730", kind.name, "outside the envelope of the skill"),
                ),
                (
                    self._condition(permitted, kind, skill.inputs),
                    Reason("AE731", kind.name, "outside the permission of the module"),
                ),
            ),
            self._condition(sufficient, kind, skill.inputs),
            of_kind.required_state | _state_variables_read([envelope, permitted]),
        )
        if not self._compiled:
            return

        def fast_path() -> FastDecide:
            always = self._finite_reasons(*at, used_up=False)
            of_quotas = self._finite_reasons(*at, used_up=True)[len(always) :]
            stated = (
                *of_quotas,
                *(reason for _, reason in (*entry.envelope_and_permission, *of_kind.conditions)),
            )
            denying = self._denial_factory(kind.name, always, stated)
            return compile_fast_path(
                DecisionCriteria(
                    not always,
                    envelope,
                    permitted,
                    t.conjunction(*left),
                    self._rule_conditions(kind),
                    denying,
                ),
                inputs=self._inputs[ecm.id, skill.id],
                state=self._state,
                snapshot_cache=self._snapshot_cache,
                read_each=self._reading_unpacker(entry.required_state),
                required=entry.required_state,
                parameters=of_kind.parameters,
                quotas=self._configuration.site.quotas,
                kind=kind.name,
            )

        self._fast_paths.add(at, fast_path)

    @cached_property
    def _snapshot_cache(self) -> SnapshotCache:
        return SnapshotCache(self._state, self._module_variables)

    def _rule_conditions(self, kind: ActionKind) -> CompiledConditions:
        """Compile the rules on a kind for the fast path, once for all skills."""
        if kind.name not in self._compiled_rules:
            declared = (*self._configuration.site.observed_variables.values(), *kind.parameters.values())
            terms = [rule.terms[kind.name] for rule in self._kinds[kind.name].rules]
            self._compiled_rules[kind.name] = compile_conditions(terms, ranges_of(declared))
        return self._compiled_rules[kind.name]

    def _reading_unpacker(self, required: frozenset[str]) -> ReadEach:
        """Compile the reader of a set of required readings once: it is most of the generated code."""
        if required not in self._one_by_one:
            self._one_by_one[required] = compile_read_each(self._state, required, self._module_variables)
        return self._one_by_one[required]

    def _finite_reasons(self, module: str, skill: str, kind: str, *, used_up: bool) -> list[Reason]:
        """List the finite layers' objections to this kind, with all quotas used up or none."""
        usage = {quota.id: quota.max_count if used_up else 0 for quota in self._configuration.site.quotas}
        return list(finite_objections(self._configuration, Caller(module, skill, {}), kind, usage))

    def _denial_factory(self, kind: str, always: Sequence[Reason], stated: Sequence[Reason]) -> DenialFor:
        """Make the function from truth values to a denial for `always` and each `stated` that is false."""

        def denying(holds: tuple[bool, ...]) -> Decision | None:
            failed = (reason for reason, held in zip(stated, holds, strict=True) if not held)
            reasons = (*always, *failed)
            return (
                None if self._attenuating_rules(kind, reasons) else Decision(DecisionKind.DENY, None, reasons)
            )

        return denying

    def _condition(
        self, term: t.Term, kind: ActionKind, inputs: Mapping[str, Declared]
    ) -> DecidableCondition:
        # Of the state, only what the condition reads: with many modules it has thousands of variables.
        state = self._configuration.site.observed_variables
        read = [state[name] for name in _state_variables_read([term])]
        declared = (*read, *inputs.values(), *kind.parameters.values())
        if self._compiled:
            return CompiledCondition(term, declared)
        return SolverCondition(term, declared, self._solver)

    def _attenuating_rules(self, kind: str, reasons: Sequence[Reason]) -> list[Rule]:
        """Return the violated rules if nothing else objects and each of them can attenuate; else none."""
        violated = {reason.rule for reason in reasons if reason.code == "AE750"}
        if len(violated) != len(reasons):
            return []
        rules = [rule for rule in self._kinds[kind].rules if rule.id in violated]
        return rules if all(kind in rule.attenuations for rule in rules) else []


class _Decider(_CompiledRules):
    def decide(self, caller: Any, readings: Any, action: Any, now: Any, usage: Any) -> Decision:
        answer = decide_fast(self._fast_paths, caller, readings, action, now, usage)
        if type(answer) is Decision:
            return answer
        if type(readings) is Snapshot:
            readings = individual_readings(readings)
        if type(answer) is dict:
            reasons = self._violated_conditions(caller, action, answer)
            return self._deny_or_attenuate(caller, readings, action, now, usage, answer, reasons)
        return self._decide_slow_path(caller, readings, action, now, usage)

    def decide_jointly(
        self, decision: Decision, readings: Readings, now: float, active_actions: Sequence[ActiveAction]
    ) -> Decision:
        if decision.action is None:
            return decision
        reasons = tuple(
            self._joint.objections(ActiveAction(decision.action, readings, now, -1), active_actions)
        )
        return Decision(DecisionKind.DENY, None, tuple(dict.fromkeys(reasons))) if reasons else decision

    def _decide_slow_path(self, caller: Any, readings: Any, action: Any, now: Any, usage: Any) -> Decision:
        fault = request_fault(caller, readings, action, usage) or check_time(now)
        if fault is not None:
            return Decision(DecisionKind.DENY, None, (fault,))
        kind, parameters = action.kind, action.parameters
        values: Scalars = {}
        reasons = self._objections(caller, readings, Action(kind, parameters), now, usage, values)
        if not reasons:
            allowed = Action(kind, to_plant_parameters(self._kinds[kind].parameters, parameters))
            return Decision(DecisionKind.ALLOW, allowed, ())
        return self._deny_or_attenuate(
            caller, readings, Action(kind, parameters), now, usage, values, reasons
        )

    def _deny_or_attenuate(
        self,
        caller: Caller,
        readings: Readings,
        action: Action,
        now: float,
        usage: Mapping[str, int],
        values: Scalars,
        reasons: list[Reason],
    ) -> Decision:
        """Return ATTENUATE if these reasons leave a reduced action that is allowed, else DENY."""
        kind, parameters = action
        attenuating = self._attenuating_rules(kind, reasons)
        if attenuating:
            reduced_parameters = attenuate_parameters(attenuating, kind, parameters, values)
            reduced = Action(kind, to_plant_parameters(self._kinds[kind].parameters, reduced_parameters))
            if not self._objections(caller, readings, reduced, now, usage, {}):
                return Decision(DecisionKind.ATTENUATE, reduced, tuple(reasons))
        return Decision(DecisionKind.DENY, None, tuple(reasons))

    def _objections(
        self,
        caller: Caller,
        readings: Readings,
        action: Action,
        now: float,
        usage: Mapping[str, int],
        values: Scalars,
    ) -> list[Reason]:
        """List every objection in the order of the layers; `values` receives the well-formed values."""
        kind = self._kinds.get(action.kind)
        entry = self._entry((caller.module, caller.skill, action.kind))
        required = entry.required_state if entry else kind.required_state if kind else frozenset()
        inputs = self._inputs.get((caller.module, caller.skill), {})
        given = {f"inputs.{name}": value for name, value in caller.inputs.items()}
        reasons = [
            *unpack_arguments(
                kind.parameters if kind else {}, action.parameters, f"of `{action.kind}`", values
            ),
            *unpack_arguments(inputs, given, f"of `{caller.skill}`", values),
            *unpack_readings(
                self._state, readings, now, required, values, module_variables=self._module_variables
            ),
            *finite_objections(self._configuration, caller, action.kind, usage),
        ]
        if not reasons and entry and entry.residual_condition.decide(values) is ConditionValue.HOLDS:
            return reasons
        return reasons + self._violated_conditions(caller, action, values)

    def _violated_conditions(self, caller: Caller, action: Action, values: Scalars) -> list[Reason]:
        """List the objections of envelope, permission and Φ, as far as their values are present."""
        kind = self._kinds.get(action.kind)
        if kind is None:
            return []
        entry = self._entry((caller.module, caller.skill, action.kind))
        if entry is None:
            text = f"`{action.kind}` is not in the envelope of the skill"
            return [Reason("AE730", action.kind, text), *_failed_reasons(kind.conditions, values)]
        return [
            *_failed_reasons(entry.envelope_and_permission, values),
            *_failed_reasons(kind.conditions, values),
        ]


def _violation_reason(rule: Rule) -> Reason:
    return Reason("AE750", rule.id, f"breaks `{rule.text}`: {rule.rationale}")


def _failed_reasons(
    conditions: Iterable[tuple[DecidableCondition, Reason]], values: Scalars
) -> Iterator[Reason]:
    """Yield the reason of each condition that does not hold."""
    for condition, reason in conditions:
        if not condition.names <= values.keys():
            continue  # it reads a missing or malformed variable, which is reported elsewhere
        truth = condition.decide(values)
        if truth is ConditionValue.FAILS:
            yield reason
        elif truth is ConditionValue.UNDECIDED:
            yield Reason("AE790", reason.rule, f"the solver could not decide `{reason.rule}`")


def _state_variables_read(terms: Iterable[t.Term]) -> frozenset[str]:
    """Return the state variables that any of the terms reads."""
    return frozenset(
        name
        for term in terms
        for name, variable in t.variables_of(term).items()
        if variable.role is t.VariableRole.STATE
    )
