"""Leaving out what is proved changes no decision: the residue decides as all conditions do.

For the shipped modules at requests in and out of their envelopes, and for generated sites and modules
at every order of their values.  A certificate that claims a proof there is not is noticed in both.
"""

from __future__ import annotations

import json
import random
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from fractions import Fraction
from functools import cache
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.cli.author.example_requests import example_requests
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import Caller, DecisionKind
from aeros.runtime.gate.gate import CompiledGate
from aeros.runtime.ports import Reading
from aeros.runtime.proving import prove_configuration
from aeros.skill import Action
from aeros.spec.diagnostics.codes import SpanLabel
from aeros.spec.expr import terms as t
from aeros.spec.expr.doubles import adjacent_doubles
from aeros.spec.expr.semantics import is_true
from aeros.spec.expr.types import EnumType, FamilyType, VectorType
from aeros.spec.model.variables import Declared
from aeros.spec.obligations.claim_id import ClaimForm, ClaimId
from aeros.spec.obligations.obligation import ClaimMode, Obligation
from aeros.spec.obligations.permission import permission_obligations
from aeros.spec.obligations.safety import envelope_space, safety_obligations
from aeros.spec.text.discovery import reference_site_path
from aeros.spec.verification.certificate import Certificate
from aeros.spec.verification.discharge import discharge_obligations
from aeros.spec.verification.verify import verify
from tests.hypothesis_profiles import PROFILE, PROFILES, examples
from tests.property.test_verdicts import (
    ANY,
    COLOURS,
    INPUTS,
    ON_ACTIONS,
    ON_STATES,
    PARAMETERS,
    REAL,
    REDUCED,
    STATE,
    _findings,
    _module,
    _site,
)
from tests.repo.tree import ROOT
from tests.unit.runtime.bench import MODULE, NOW, SITE, Request, measured
from tests.unit.runtime.bench import PARAMETERS as PARAMETERS_OF_BENCH
from tests.unit.runtime.bench import STATE as STATE_OF_BENCH


def everything_of(configuration: Configuration) -> CompiledGate:
    """The gate without a certificate to rely on."""
    return CompiledGate(replace(configuration, certificates={}))


def claiming(configuration: Configuration, module: str, *obligations: ClaimId) -> Configuration:
    """The configuration with certificates that claim these obligations PROVED."""
    old = configuration.certificates[module]
    claimed = replace(old, obligations={**old.obligations, **dict.fromkeys(obligations, "PROVED")})
    return replace(configuration, certificates={**configuration.certificates, module: claimed})


def differing(gate: CompiledGate, everything: CompiledGate, requests: Iterable[Request]) -> list[Request]:
    """The requests that are decided otherwise when everything is evaluated."""
    return [one for one in requests if one.decided_by(gate) != one.decided_by(everything)]


# The shipped modules.

PER_CONDITION = round(15 * PROFILES[PROFILE])
"""Of each condition on the kind."""

MOST_ROUNDINGS = 200
ON_EACH_PUSH = "fetch_object/"


@cache
def shipped() -> tuple[Configuration, tuple[Request, ...]]:
    """The modules of this repository, and requests of their skills: allowed ones with values drawn again.

    Of one module on each push: to find requests of a skill that are allowed takes a second.
    """
    paths = sorted((ROOT / "ecms").glob("*/" if PROFILE == "nightly" else ON_EACH_PUSH))
    configuration, _ = prove_configuration(paths, reference_site_path(), certified=False)
    report = verify(paths, reference_site_path())
    gate, site = CompiledGate(configuration), configuration.site
    found: list[Request] = []
    for module in configuration.modules.values():
        for skill in module.skills.values():
            own = replace(report, modules=tuple(one for one in report.modules if one.ecm == module))
            for line in example_requests(gate, site, module, skill, own):
                base = _request(json.loads(line), module.id, skill.id)
                declared = {**site.observed_variables, **site.kinds[base.action.kind].parameters}
                conditions = _conditions(configuration, module.id, skill.id, base.action.kind)
                chance = random.Random(f"{module.id} {skill.id} {base.action.kind}")  # noqa: S311 - repeats
                bounds = _bounds(conditions)
                found += (
                    _drawn_again(base, declared, condition, bounds, chance)
                    for condition in conditions
                    for _ in range(PER_CONDITION)
                )
    return configuration, tuple(found)


def _request(line: dict[str, Any], module: str, skill: str) -> Request:
    readings = {name: Reading(one["value"], one["time"]) for name, one in line["state"].items()}
    action = Action(line["action"]["kind"], line["action"]["parameters"])
    return Request(Caller(module, skill, line["inputs"]), readings, action, line["time"], line["usage"])


def _conditions(configuration: Configuration, module: str, skill: str, kind: str) -> list[t.Term]:
    ecm = configuration.modules[module]
    rules = [rule.terms[kind] for rule in configuration.site.rules_for_kind(kind)]
    return [*rules, ecm.skills[skill].envelope[kind].term, ecm.permitted_actions[kind].term]


def _bounds(conditions: list[t.Term]) -> list[float]:
    """The numbers in the conditions, as doubles on either side, with their opposites."""
    terms = list(conditions)
    numbers: set[Fraction] = set()
    while terms:
        term = terms.pop()
        terms += t.children(term)
        if isinstance(term, t.Literal) and isinstance(term.value, Fraction):
            numbers |= {term.value, -term.value}
        if isinstance(term, t.ConstantTable):
            numbers |= {one for one in term.values if isinstance(one, Fraction)}
    return sorted(double for number in numbers for double in adjacent_doubles(number))


def _drawn_again(
    base: Request,
    declared: dict[str, Declared],
    condition: t.Term,
    bounds: list[float],
    chance: random.Random,
) -> Request:
    """The request with values drawn again, of the variables that the condition reads."""
    parameters, readings = dict(base.action.parameters), dict(base.readings)
    for name in t.variables_of(condition):
        if name in parameters:
            parameters[name] = _drawn(declared[name], parameters[name], bounds, chance)
        elif name in readings:
            value = _drawn(declared[name], readings[name].value, bounds, chance)
            readings[name] = readings[name]._replace(value=value)
    return replace(base, action=Action(base.action.kind, parameters), readings=readings)


def _drawn(one: Declared, old: Any, bounds: list[float], chance: random.Random) -> Any:
    """Another value in the declared range; of a compound, one of its parts or all of them."""
    match one.variable.type:
        case VectorType() | FamilyType():
            everywhere = chance.random() < 0.3
            index = chance.randrange(len(old))
            return [
                _part(one, part, bounds, chance) if everywhere or number == index else part
                for number, part in enumerate(old)
            ]
        case EnumType(members=members):
            return chance.choice(members)
        case _:
            return _part(one, old, bounds, chance)


def _part(one: Declared, old: Any, bounds: list[float], chance: random.Random) -> Any:
    if isinstance(old, bool):
        return not old
    assert one.range is not None
    low, high = adjacent_doubles(one.range[0])[1], adjacent_doubles(one.range[1])[0]
    near = [low, *(bound for bound in bounds if low <= bound <= high), high]
    between = chance.uniform(chance.choice(near), chance.choice(near))
    return chance.choice([low, high, old, chance.choice(near), between])


def test_for_the_shipped_modules_the_residue_decides_as_everything_does() -> None:
    configuration, requests = shipped()
    gate = CompiledGate(configuration)
    assert not differing(gate, everything_of(configuration), requests)
    verdicts = Counter(one.decided_by(gate).kind for one in requests)
    assert min(verdicts[DecisionKind.ALLOW], verdicts[DecisionKind.DENY]) > len(requests) / 10


def test_a_false_proof_of_any_guarded_rule_is_noticed_in_the_shipped_modules() -> None:
    configuration, requests = shipped()
    everything = everything_of(configuration)
    alone: dict[tuple[str, ClaimId], Request] = {}
    for one in requests:
        reasons = one.decided_by(everything).reasons
        if len(reasons) == 1:
            alone.setdefault((one.caller.module, _claim(one, reasons[0].rule)), one)
    implied = set[ClaimId]()
    for module, certificate in configuration.certificates.items():
        guarded = [name for name, verdict in certificate.obligations.items() if verdict == "GUARDED"]
        # One gate for all false claims: each of the requests has one objection, so one claim matters to it.
        twin = CompiledGate(claiming(configuration, module, *guarded))
        for name in guarded:
            met = alone.get((module, name)) or _met_alone(configuration, everything, module, name)
            if met is None:
                implied.add(name)
            else:
                assert differing(twin, everything, [met]), name
    # Whatever creeps obeys arm-separation wherever it obeys arm-standing.
    assert {name.name_of("invariant") for name in implied} <= {"arm-separation"}


def _claim(one: Request, rule: str) -> ClaimId:
    return ClaimForm.ENVELOPE_OBEYS(one.caller.skill, one.action.kind, rule)


def _met_alone(
    configuration: Configuration, everything: CompiledGate, module: str, claim: ClaimId
) -> Request | None:
    """A request to which nothing but the rule of the claim objects; none where the others imply it."""
    skill, kind, rule = claim.names
    base = next(
        one
        for one in shipped()[1]
        if (one.caller.module, one.caller.skill, one.action.kind) == (module, skill, kind)
    )
    values = _alone(configuration, module, skill, kind, rule)
    if values is None:
        return None
    chance = random.Random(str(claim))  # noqa: S311 - repeats
    for _ in range(MOST_ROUNDINGS):
        request = _with_values(base, values, chance)
        if [reason.rule for reason in request.decided_by(everything).reasons] == [rule]:
            return request
    raise AssertionError(f"`{claim}` is never met alone")


def _alone(
    configuration: Configuration, module: str, skill: str, kind: str, rule: str
) -> Mapping[str, Any] | None:
    """Values, found by the solver, at which nothing but the rule objects; none where there are none."""
    site, ecm = configuration.site, configuration.modules[module]
    clause = ecm.skills[skill].envelope[kind]
    rest = [one.terms[kind] for one in site.rules_for_kind(kind) if one.id != rule]
    broken = next(one.terms[kind] for one in site.rules_for_kind(kind) if one.id == rule)
    (finding,) = discharge_obligations(
        [
            Obligation(
                id=ClaimForm.ENVELOPE_OBEYS(skill, kind, rule),
                code="AE502",
                mode=ClaimMode.SOMETIMES,
                space=envelope_space(site, ecm.skills[skill], kind, clause),
                conclusion=t.conjunction(t.Not(broken), ecm.permitted_actions[kind].term, *rest),
                headline="",
                primary=SpanLabel(clause.span, ""),
            )
        ]
    )
    assert finding.verdict.name in {"PROVED", "REFUTED"}
    return None if finding.witness is None else finding.witness.values


def _with_values(base: Request, values: Mapping[str, Any], chance: random.Random) -> Request:
    """The request with these values instead of its own, rounded to doubles on either side."""
    action, readings = dict(base.action.parameters), dict(base.readings)
    inputs = dict(base.caller.inputs)
    for name, value in values.items():
        for own in (action, inputs):
            if name in own:
                own[name] = _rounded(value, chance)
        if name in readings:
            readings[name] = readings[name]._replace(value=_rounded(value, chance))
    return replace(
        base,
        caller=replace(base.caller, inputs=inputs),
        action=Action(base.action.kind, action),
        readings=readings,
    )


def _rounded(value: Any, chance: random.Random) -> Any:
    if isinstance(value, tuple):
        return [_rounded(part, chance) for part in value]
    return chance.choice(adjacent_doubles(value)) if isinstance(value, Fraction) else value


# Generated sites and modules.

_VALUES = (-1.0, -0.75, -0.5, -0.0, 0.0, 0.5, 0.75, 1.0)
"""All orders of two reals, their opposites, -1, 0 and 1; see tests/property/test_verdicts.py."""


def _generated(
    rules: list[t.Term], reduced: t.Term, envelope: t.Term, permission: t.Term
) -> tuple[Configuration, dict[ClaimId, bool]]:
    """A configuration with a certificate of what is proved of it, and which claims are true."""
    site, module = _site(rules, reduced), _module(envelope, permission, ["r0", "r1"], t.TRUE, t.TRUE)
    claims = iter([*permission_obligations(module, site), *safety_obligations(module, site)])
    verdicts = {one.obligation.id: one.verdict.name for one in _findings(claims).values()}
    certificate = Certificate(
        "", module.id, "", module.manifest_digest, "", {}, site.digest, "", "", verdicts
    )
    configuration = Configuration(site, {module.id: module}, {module.id: certificate}, "")
    wanted = {ClaimForm.ENVELOPE_OBEYS("skill", "move", f"r{number}") for number in range(len(rules))}
    wanted.add(ClaimForm.ENVELOPE_PERMITTED("skill", "move"))
    return configuration, {name: verdicts[name] == "PROVED" for name in wanted}


def _everywhere(chance: random.Random, count: int) -> Iterator[tuple[Request, dict[str, Any]]]:
    """Requests, and their values as the semantics takes them."""
    for _ in range(count):
        x, y = chance.choice(_VALUES), chance.choice(_VALUES)
        flag, gently, opened = (chance.random() < 0.5 for _ in range(3))
        pair, colour = (opened, chance.random() < 0.5), chance.choice(COLOURS.members)
        asked = Request(
            Caller("module", "skill", {"gently": gently}),
            measured({"flag": flag, "x": x, "open": pair}),
            Action("move", {"y": y, "colour": colour}),
            NOW,
            {},
        )
        values = {"flag": flag, "x": Fraction(x), "open": pair, "inputs.gently": gently}
        yield asked, {**values, "y": Fraction(y), "colour": colour}


SEEN: Counter[str] = Counter()


def test_for_generated_modules_the_residue_decides_as_everything_does() -> None:
    assert {*STATE} | {*PARAMETERS} | {*INPUTS} == {"flag", "x", "open", "y", "colour", "gently"}
    SEEN.clear()
    _residue_decides_as_everything_does()
    # Proofs were relied on inside envelopes, and requests outside of them were decided too; false
    # proofs that could be noticed were there, and each of them was noticed.
    assert min(SEEN["relied on"], SEEN["outside"], SEEN["allowed"], SEEN["false and noticed"]) >= 20, SEEN


@examples(75)
@given(
    st.lists(ON_ACTIONS, min_size=1, max_size=2),
    REDUCED,
    ANY,
    st.one_of(st.just(t.TRUE), ON_STATES),
    st.randoms(),
)
def _residue_decides_as_everything_does(
    rules: list[t.Term], reduced: t.Term, envelope: t.Term, permission: t.Term, chance: random.Random
) -> None:
    configuration, claims = _generated(rules, reduced, envelope, permission)
    requests = list(_everywhere(chance, 40))
    gate, everything = CompiledGate(configuration), everything_of(configuration)
    assert not differing(gate, everything, (asked for asked, _ in requests))
    terms = {
        ClaimForm.ENVELOPE_OBEYS("skill", "move", f"r{number}"): rule for number, rule in enumerate(rules)
    }
    terms[ClaimForm.ENVELOPE_PERMITTED("skill", "move")] = permission
    SEEN["relied on"] += sum(claims.values())
    for asked, values in requests:
        is_inside = is_true(envelope, values)
        expected = is_inside and all(is_true(term, values) for term in terms.values())
        assert (asked.decided_by(gate).kind is DecisionKind.ALLOW) is expected
        SEEN["allowed" if expected else "inside" if is_inside else "outside"] += 1
    for name in (name for name, is_claimed in claims.items() if not is_claimed and terms[name] != t.FALSE):
        rest = [term for other, term in terms.items() if other != name] + [envelope]
        informative = [
            asked
            for asked, values in requests
            if not is_true(terms[name], values) and all(is_true(term, values) for term in rest)
        ]
        twin = CompiledGate(claiming(configuration, "module", name))
        # Where nothing else objects, the twin allows what everything denies.
        assert differing(twin, everything, informative) == informative
        SEEN["false and noticed"] += bool(informative)


@pytest.mark.parametrize("rule", ["r0", "r1"])
def test_a_request_with_two_objections_needs_both_to_be_left_out(rule: str) -> None:
    """The residue is a conjunction: one false proof beside a true objection changes no decision."""
    flag, x = STATE["flag"].variable, STATE["x"].variable
    zero = t.Literal(Fraction(0), REAL)
    positive = t.Compare("<", zero, x)
    configuration, _ = _generated([flag, positive], zero, t.TRUE, t.TRUE)
    claim = ClaimForm.ENVELOPE_OBEYS("skill", "move", rule)
    twin = CompiledGate(claiming(configuration, "module", claim))
    (asked, _), *_ = _everywhere(random.Random(0), 1)  # noqa: S311 - repeats
    asked = replace(asked, readings=measured({"flag": False, "x": -0.5, "open": (True, True)}))
    assert not differing(twin, everything_of(configuration), [asked])


def test_a_rule_whose_claim_would_bear_the_name_of_another_one_is_not_left_out() -> None:
    clashing = SITE.parent / "clashing_names"
    configuration, _ = prove_configuration([clashing], clashing / "site.yaml", certified=False)
    near = Request(
        Caller(MODULE.name, "goal", {}),
        measured({**STATE_OF_BENCH, "human_distance": 0.75}),
        Action("move", {**PARAMETERS_OF_BENCH["move"], "speed": 0.4375}),
    )
    assert near.decided_by(CompiledGate(configuration)) == near.decided_by(everything_of(configuration))
    assert near.decided_by(CompiledGate(configuration)).kind is DecisionKind.ATTENUATE
