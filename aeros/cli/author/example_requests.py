"""Example requests that the gate allows, made from the witnesses of proofs."""

from __future__ import annotations

import json
import math
import random
from collections.abc import Iterator
from fractions import Fraction
from typing import Any, cast

from aeros.runtime.gate.decision import DecisionKind
from aeros.runtime.gate.port import Gate
from aeros.runtime.gate.wire import decide_line, request_json
from aeros.skill import Action
from aeros.spec.expr import terms as t
from aeros.spec.expr.doubles import adjacent_doubles
from aeros.spec.expr.semantics import is_true
from aeros.spec.expr.types import BoolType, EnumType, FamilyType, IntegerType, RealType, VectorType
from aeros.spec.model.ecm import Ecm, Skill
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.obligation import Obligation
from aeros.spec.verification.reports import Report
from aeros.spec.verification.witness import Witness

_NOW = 10.0
_ATTEMPTS = 200
_SHARES = tuple(Fraction(1, 2**halvings) for halvings in range(12))
"""Shares of the way to the middle of a range, the largest first."""


def example_requests(gate: Gate, site: Site, ecm: Ecm, skill: Skill, report: Report) -> Iterator[str]:
    """Make an allowed request for each action kind of a skill's envelope.

    Values that the proof does not depend on are set to the middle of their range, and others are moved
    towards it: a solver's values often lie on bounds.  A witness is rational and a request holds doubles, so
    neighbouring doubles are tried.

    Args:
        gate: Decides the candidates.
        site: The site of the gate.
        ecm: The module.
        skill: A skill of the module.
        report: Full verification report with witnesses.

    Yields:
        Requests as lines of JSON.
    """
    witnesses = {
        finding.obligation.id: (finding.obligation, finding.witness)
        for module in report.modules
        for finding in module.findings
        if finding.witness is not None
    }
    for kind in skill.envelope:
        proved = witnesses.get(ClaimForm.ENVELOPE_NOT_DEAD(skill.id, kind))
        values = {} if proved is None else _moved_inside(*proved)
        for attempt in range(_ATTEMPTS):
            chance = random.Random(attempt)  # noqa: S311 - picks neighbours, guards nothing
            line = json.dumps(_request(site, skill, kind, values, chance))
            if decide_line(gate, ecm.id, skill.id, line.encode()).kind is DecisionKind.ALLOW:
                yield line
                break


def _moved_inside(claim: Obligation, witness: Witness) -> dict[str, Any]:
    """Move each real number of a witness towards the middle of its range, as far as the claim still holds."""
    values: dict[str, Any] = dict(witness.values)
    claimed = (*claim.space.assumptions, claim.conclusion)
    terms = [term for term in claimed if t.variables_of(term).keys() <= values.keys()]
    for one in witness.variables:
        about_it = [term for term in terms if one.name in t.variables_of(term)]  # the others hold as before
        for part in range(len(values[one.name]) if isinstance(values[one.name], tuple) else 1):
            for share in _SHARES if _is_real(one) else ():
                moved = {**values, one.name: _moved(values[one.name], part, one, share)}
                if all(is_true(term, moved) for term in about_it):
                    values = moved
                    break
    return values


def _is_real(declared: Declared) -> bool:
    type_ = declared.variable.type
    type_ = type_.element if isinstance(type_, FamilyType) else type_
    is_real = isinstance(type_, RealType | VectorType) and not isinstance(type_, IntegerType)
    return is_real and declared.range is not None


def _moved(value: Any, part: int, declared: Declared, share: Fraction) -> Any:
    low, high = cast("tuple[Fraction, Fraction]", declared.range)
    parts = list(value) if isinstance(value, tuple) else [value]
    parts[part] += ((low + high) / 2 - parts[part]) * share
    return tuple(parts) if isinstance(value, tuple) else parts[0]


def _request(site: Site, skill: Skill, kind: str, values: Any, chance: random.Random) -> dict[str, Any]:
    parameters = site.kinds[kind].parameters
    return request_json(
        Action(kind, {name: _shown(one, values, chance) for name, one in parameters.items()}),
        {name: _shown(one, values, chance) for name, one in site.observed_variables.items()},
        _NOW,
        inputs={name: _shown(one, values, chance) for name, one in skill.inputs.items()},
        usage={quota.id: 0 for quota in site.quotas},
    )


def _shown(declared: Declared, values: Any, chance: random.Random) -> Any:
    value = values.get(declared.name, declared.default_value)
    return _double(_middle(declared) if value is None else value, chance)


def _middle(declared: Declared) -> Any:
    low, high = declared.range or (Fraction(0), Fraction(0))
    middle = (low + high) / 2
    match declared.variable.type:
        case IntegerType():
            return Fraction(math.floor(middle))
        case FamilyType(index=index, element=IntegerType()):
            return (Fraction(math.floor(middle)),) * len(index.members)
        case BoolType():
            return False
        case EnumType(members=members):
            return members[0]
        case VectorType():
            return (middle,) * 3
        case FamilyType(index=index, element=RealType()):
            return (middle,) * len(index.members)
        case FamilyType(index=index):
            return (False,) * len(index.members)
        case _:
            return middle


def _double(value: Any, chance: random.Random) -> Any:
    """Return a double for an exact value; if none is exact, one of the two nearest at random."""
    if isinstance(value, tuple):
        return [_double(part, chance) for part in value]
    if not isinstance(value, Fraction):
        return value
    return chance.choice(adjacent_doubles(value))
