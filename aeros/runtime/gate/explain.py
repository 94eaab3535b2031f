"""Explanations of decisions: obligations proved at install time, conditions evaluated now, and their values.

The explainer stands next to the gate, not in it: the gate decides, and the explainer evaluates each condition
again by the exact semantics, with which the gate agrees by definition. Pure.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from aeros.runtime.gate.causes import collect_arguments
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import Caller, Decision, DecisionKind
from aeros.runtime.gate.gate import CompiledGate, GateMode
from aeros.runtime.gate.request_check import request_fault, unpack_readings
from aeros.runtime.gate.value_check import Scalars, check_time, value_checkers
from aeros.runtime.ports import Readings
from aeros.skill import Action
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower, scalar_variables
from aeros.spec.expr.semantics import is_true
from aeros.spec.expr.types import FamilyType, VectorType
from aeros.spec.model.variables import Declared
from aeros.spec.obligations.claim_id import ClaimForm, ClaimId
from aeros.spec.verification.witness import format_value

LAYER_CODES: Mapping[str, tuple[str, ...]] = {
    "form": ("AE701", "AE702", "AE703", "AE704", "AE705", "AE706", "AE707"),
    "overrides": ("AE710",),
    "lifecycle": ("AE720",),
    "access, risk and quotas": ("AE740", "AE741", "AE742"),
    "envelope and permission": ("AE730", "AE731"),
    "invariants": ("AE750", "AE790"),
}
"""The gate's layers, and the codes of their reasons."""


@dataclass(frozen=True)
class EvaluatedCondition:
    """One condition on the action.

    Attributes:
        name: the invariant, or `envelope` or `permission`.
        text: its source text.
        obligation: id of the certificate's obligation that proves it for every action in the envelope, if
            any.
        holds: None if the proof replaced the evaluation, or if a variable that it reads is in `missing`.
        values: the values it reads, in the site's units, if it was evaluated.
        missing: the variables it reads that have no well-formed value.
    """

    name: str
    text: str
    obligation: str | None
    holds: bool | None
    values: Mapping[str, str]
    missing: tuple[str, ...] = ()


@dataclass(frozen=True)
class Explanation:
    """A decision with everything it rests on.

    Attributes:
        decision: the decision.
        layers: for each layer's name True if it passed; None if that could not be determined.
        conditions: of the requested action.
        attenuated_parameters: the conditions of the attenuated action, which the gate decided again.
    """

    decision: Decision
    layers: Mapping[str, bool | None]
    conditions: tuple[EvaluatedCondition, ...] = ()
    attenuated_parameters: tuple[EvaluatedCondition, ...] = ()


class Explainer:
    """Explainer of the decisions of one configuration's gate."""

    def __init__(self, configuration: Configuration, mode: GateMode) -> None:
        self.gate = CompiledGate(configuration, mode)
        self._configuration = configuration
        self._relies_on_proof = mode is GateMode.COMPILED
        self._state = value_checkers(configuration.site.observed_variables)

    def explain(
        self, caller: Caller, readings: Readings, action: Action, now: float, usage: Mapping[str, int]
    ) -> Explanation:
        """Decide a request, and explain the decision.

        Args:
            caller: the active module's skill that asks, with its inputs (SI).
            readings: value (SI) and time (s) of each measured state variable, by vocabulary name.
            action: the requested action, parameters in SI.
            now: time of the decision on the clock of the readings, s.
            usage: for each quota on this kind of action, how many were executed in its window until now.

        Returns:
            The decision with its layers and conditions.

        Raises:
            GateDisagreementError: in mode `checked`, the compiled gate and Z3 decide differently.
        """
        decision = self.gate.decide(caller, readings, action, now, usage)
        if request_fault(caller, readings, action, usage) or check_time(now):
            return explain_malformed_request(decision)
        allowed = decision.kind is DecisionKind.ALLOW
        clauses = tuple(self._clauses(caller, readings, action, now, allowed))
        reduced: tuple[EvaluatedCondition, ...] = ()
        if decision.kind is DecisionKind.ATTENUATE and decision.action is not None:
            reduced = tuple(self._clauses(caller, readings, decision.action, now, allowed=True))
        return Explanation(decision, _layer_results(decision, clauses), clauses, reduced)

    def _clauses(
        self, caller: Caller, readings: Readings, action: Action, now: float, allowed: bool
    ) -> Iterator[EvaluatedCondition]:
        site, kind = self._configuration.site, self._configuration.site.kinds.get(action.kind)
        ecm = self._configuration.modules.get(caller.module)
        skill = ecm.skills.get(caller.skill) if ecm else None
        if kind is None:
            return
        inputs = skill.inputs if skill else {}
        declared = {
            variable.name: variable for variable in (*site.observed_variables.values(), *inputs.values())
        }
        declared |= kind.parameters
        values = self._values(caller, readings, action, now, inputs, kind.parameters)
        conditions: list[tuple[str, str, ClaimId | None, t.Term]] = []
        if skill is not None and kind.name in skill.envelope:
            condition = skill.envelope[kind.name]
            conditions.append(("envelope", condition.text, None, condition.term))
        if ecm is not None and kind.name in ecm.permitted_actions:
            condition = ecm.permitted_actions[kind.name]
            claim_id = ClaimForm.ENVELOPE_PERMITTED(caller.skill, kind.name)
            conditions.append(("permission", condition.text, claim_id, condition.term))
        for rule in site.rules_for_kind(kind.name):
            claim_id = ClaimForm.ENVELOPE_OBEYS(caller.skill, kind.name, rule.id)
            conditions.append((rule.id, rule.text, claim_id, rule.terms[kind.name]))
        proved = self._configuration.proved_obligations(ecm.id) if ecm else frozenset()
        for name, text, claim, term in conditions:
            obligation = str(claim) if claim in proved else None
            if obligation and allowed and self._relies_on_proof:
                yield EvaluatedCondition(name, text, obligation, None, {})
            else:
                yield _evaluate_condition(name, text, obligation, term, declared, values)

    def _values(
        self,
        caller: Caller,
        readings: Readings,
        action: Action,
        now: float,
        inputs: Mapping[str, Declared],
        parameters: Mapping[str, Declared],
    ) -> Scalars:
        """Collect every well-formed value of the request, as exact rationals; the gate reports the others."""
        values: Scalars = {}
        given = {f"inputs.{name}": value for name, value in caller.inputs.items()}
        collect_arguments(value_checkers(parameters), action.parameters, values)
        collect_arguments(value_checkers(inputs), given, values)
        list(unpack_readings(self._state, readings, now, frozenset(self._state), values))
        return {name: Fraction(value) if type(value) is float else value for name, value in values.items()}


def explain_malformed_request(decision: Decision) -> Explanation:
    """Explain the denial of a request whose structure is malformed.

    Args:
        decision: the denial.

    Returns:
        An explanation that names only the layer of the form.
    """
    return Explanation(decision, {**dict.fromkeys(LAYER_CODES), "form": False})


def _evaluate_condition(
    name: str,
    text: str,
    obligation: str | None,
    term: t.Term,
    declared: Mapping[str, Declared],
    values: Mapping[str, Any],
) -> EvaluatedCondition:
    shown: dict[str, str] = {}
    missing: list[str] = []
    for read in t.variables_of(term):
        value = _assemble_value(declared[read], values)
        if value is None:
            missing.append(read)
        else:
            shown[read] = format_value(value, declared[read])
    truth = None if missing else is_true(lower(term), values)
    return EvaluatedCondition(name, text, obligation, truth, shown, tuple(missing))


def _assemble_value(declared: Declared, values: Mapping[str, Any]) -> Any:
    """Assemble a variable's value from its scalars; None if one of them is missing."""
    parts = [values.get(scalar.name) for scalar in scalar_variables(declared.variable)]
    if None in parts:
        return None
    return tuple(parts) if isinstance(declared.variable.type, VectorType | FamilyType) else parts[0]


def _layer_results(decision: Decision, clauses: tuple[EvaluatedCondition, ...]) -> dict[str, bool | None]:
    objecting = {reason.code for reason in decision.reasons}
    unknown = {
        "envelope and permission" if clause.name in ("envelope", "permission") else "invariants"
        for clause in clauses
        if clause.missing
    }
    return {
        name: False if objecting & set(codes) else None if name in unknown else True
        for name, codes in LAYER_CODES.items()
    }
