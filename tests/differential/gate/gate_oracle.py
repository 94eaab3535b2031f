"""Decisions of the gate by definition: exact semantics of every condition, without relying on proofs.

Written apart from the gate, and slow: a decision is the set of its reasons, as (code, rule).
"""

from __future__ import annotations

from fractions import Fraction
from math import isfinite
from typing import Any

from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.ports import Reading
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import Environment, is_true
from aeros.spec.expr.types import BoolType, EnumType, FamilyType, IntegerType, Type, VectorType
from aeros.spec.model.variables import Declared
from tests.unit.runtime.bench import Request


def admits(configuration: Configuration, asked: Request) -> bool:
    """Return true if the request is well-formed and nothing objects to it; never raises."""
    try:
        values = _well_formed(configuration, asked)
    except (_MalformedError, KeyError, TypeError, AttributeError):
        return False
    kind, skill = asked.action.kind, asked.caller.skill
    quotas = [quota for quota in configuration.site.quotas if kind in quota.kinds]
    known = {quota.id for quota in configuration.site.quotas}
    if not all(name in known and type(used) is int and used >= 0 for name, used in asked.usage.items()):
        return False
    if not all(quota.id in asked.usage and asked.usage[quota.id] < quota.max_count for quota in quotas):
        return False
    return not objections(configuration, skill, kind, values, asked.caller.module)


def objections(
    configuration: Configuration, skill: str, kind: str, values: Environment, module: str = "handling"
) -> set[tuple[str, str]]:
    """List which of envelope, permission and Φ object, where all their variables have exact values."""
    ecm = configuration.modules[module]
    clauses = [("AE730", kind, ecm.skills[skill].envelope[kind].term)]
    clauses += [("AE731", kind, ecm.permitted_actions[kind].term)]
    clauses += [("AE750", rule.id, rule.terms[kind]) for rule in configuration.site.rules_for_kind(kind)]
    return {(code, rule) for code, rule, term in clauses if not is_true(term, values)}


def exact(value: Any) -> Any:
    """A value as a rational; compounds by their parts."""
    if isinstance(value, (tuple, list)):
        return tuple(exact(part) for part in value)
    return Fraction(value) if type(value) in (float, int) else value


class _MalformedError(Exception):
    pass


def _well_formed(configuration: Configuration, asked: Request) -> dict[str, Any]:
    site, ecm = configuration.site, configuration.modules[asked.caller.module]
    skill, kind = ecm.skills[asked.caller.skill], site.kinds[asked.action.kind]
    for mapping in (asked.caller.inputs, asked.action.parameters, asked.readings, asked.usage):
        _require(type(mapping) is dict and {type(key) for key in mapping} <= {str})
    values: dict[str, Any] = {}
    _require(set(asked.action.parameters) == set(kind.parameters))
    _require(set(asked.caller.inputs) <= set(skill.inputs))
    for name, one in kind.parameters.items():
        values[name] = _checked(one, asked.action.parameters[name])
    for name, one in skill.inputs.items():
        given = asked.caller.inputs.get(name, one.default_value)
        values[f"inputs.{name}"] = exact(given) if name not in asked.caller.inputs else _checked(one, given)
    now = _time(asked.now)
    needed = _needed(configuration, asked)
    _require(needed <= set(asked.readings) <= set(site.observed_variables))
    for name, reading in asked.readings.items():
        _require(type(reading) is Reading and len(reading) == 2)
        age = now - _time(reading.time)
        limit = site.observed_variables[name].max_age
        _require(age >= 0 and (name not in needed or limit is None or age <= limit))
        values[name] = _checked(site.observed_variables[name], reading.value)
    return values


def _needed(configuration: Configuration, asked: Request) -> set[str]:
    ecm, kind = configuration.modules[asked.caller.module], asked.action.kind
    rules = configuration.site.rules_for_kind(kind)
    terms = [ecm.skills[asked.caller.skill].envelope[kind].term, ecm.permitted_actions[kind].term]
    terms += [rule.terms[kind] for rule in rules]
    terms += [term for rule in rules for term in rule.attenuations.get(kind, {}).values()]
    read = {name: one for term in terms for name, one in t.variables_of(term).items()}
    return {name for name, one in read.items() if one.role is t.VariableRole.STATE}


def _require(condition: bool) -> None:
    if not condition:
        raise _MalformedError


def _time(value: Any) -> Fraction:
    _require(type(value) is int or (type(value) is float and isfinite(value)))
    return Fraction(value)


def _checked(declared: Declared, value: Any) -> Any:
    type_: Type = declared.variable.type
    if isinstance(type_, (VectorType, FamilyType)):
        count = 3 if isinstance(type_, VectorType) else len(type_.index.members)
        _require(type(value) in (tuple, list) and len(value) == count)
        element = type_.element if isinstance(type_, FamilyType) else None
        return tuple(_scalar(declared, element, part) for part in value)
    return _scalar(declared, type_, value)


def _scalar(declared: Declared, type_: Any, value: Any) -> Any:
    if isinstance(type_, BoolType):
        _require(type(value) is bool)
        return value
    if isinstance(type_, EnumType):
        _require(type(value) is str and value in type_.members)
        return value
    _require(type(value) is int or (type(value) is float and isfinite(value)))
    assert declared.range is not None
    _require(declared.range[0] <= Fraction(value) <= declared.range[1])
    _require(not isinstance(type_, IntegerType) or Fraction(value).denominator == 1)
    return Fraction(value)
