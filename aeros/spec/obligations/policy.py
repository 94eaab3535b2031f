"""Claims about a site alone: Π and Φ agree, no rule is idle, and the protective stop is always allowed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from fractions import Fraction
from typing import Final

from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel
from aeros.spec.diagnostics.grammar import an
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import RealType, VectorType
from aeros.spec.expr.units import LENGTH, NUMBER, TIME, Dimension
from aeros.spec.model.rules import ActionKind, Rule
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.obligation import (
    ClaimMode,
    LabelledConjunct,
    Obligation,
    VariableSpace,
    label_conjuncts,
    rule_conjuncts,
)
from aeros.spec.obligations.quotas import quota_obligations
from aeros.spec.obligations.verdicts import StaticClaim, Verdict

_FACTOR_SLACK: Final = Fraction(1, 1_000_000)
"""Greatest difference of the factor of a shortened vector from the exact one, as proofs allow it."""


def policy_obligations(site: Site) -> Iterator[Obligation | StaticClaim]:
    """Make every claim of group policy about a site, for every action kind and quota.

    Args:
        site: the site.

    Yields:
        Claims settled at once, and obligations for the solver.
    """
    for kind in site.kinds.values():
        rules = site.rules_for_kind(kind.name)
        if kind.protective:
            yield from _stop_obligations(site, kind, rules)
            continue
        yield _satisfiable(site, kind, rules)
        yield from _contact_speed_kept(site, kind, rules)
        for rule in rules:
            yield _not_vacuous(site, kind, rule)
            yield _rule_not_redundant(site, kind, rule, rules)
            if kind.name in rule.attenuations:
                yield from _attenuation_obligations(site, kind, rule, rules)
    yield from quota_obligations(site)


def action_space(site: Site, kind: ActionKind, *assumptions: t.Term) -> VariableSpace:
    """Make the space of all states and all parameters of an action kind.

    Args:
        site: the site.
        kind: the action kind.
        assumptions: conditions assumed to hold.

    Returns:
        The space.
    """
    return VariableSpace((*site.observed_variables.values(), *kind.parameters.values()), assumptions)


def _stop_obligations(
    site: Site, kind: ActionKind, rules: tuple[Rule, ...]
) -> Iterator[Obligation | StaticClaim]:
    """Claim that the protective stop is allowed in every state: no rule denies it, no override blocks it."""
    for rule in rules:
        yield Obligation(
            id=ClaimForm.STOP_ALLOWED(kind.name, rule.id),
            code="AE602",
            mode=ClaimMode.ALWAYS,
            space=action_space(site, kind),
            conclusion=rule.terms[kind.name],
            headline=f"`{rule.id}` denies the protective stop in some state",
            primary=SpanLabel(rule.require_span, "does not hold in every state"),
            help=(f"take `{kind.name}` out of the rule's `on`",),
            labelled_conjuncts=label_conjuncts(
                rule.conjuncts.get(kind.name, ()), "does not hold in every state"
            ),
        )
    for block in site.blocks:
        blocked = block.action == kind.name
        yield StaticClaim(
            ClaimForm.STOP_NOT_BLOCKED(kind.name, block.id),
            Diagnostic(
                "AE602",
                f"the operator override `{block.id}` blocks the protective stop",
                SpanLabel(kind.span),
                help=("block the other action kinds, or the module",),
            )
            if blocked
            else None,
        )


def _satisfiable(site: Site, kind: ActionKind, rules: tuple[Rule, ...]) -> Obligation:
    """Claim that some action of the kind is allowed in some state."""
    return Obligation(
        id=ClaimForm.RULES_SATISFIABLE(kind.name),
        code="AE601",
        mode=ClaimMode.SOMETIMES,
        space=action_space(site, kind),
        conclusion=t.conjunction(*(rule.terms[kind.name] for rule in rules)),
        headline=f"the invariants contradict each other: no `{kind.name}` is ever allowed",
        primary=SpanLabel(kind.span, "never allowed"),
        secondary=tuple(SpanLabel(rule.require_span, rule.id) for rule in rules),
        labelled_conjuncts=rule_conjuncts(rules, kind.name),
    )


def _contact_speed_kept(site: Site, kind: ActionKind, rules: tuple[Rule, ...]) -> Iterator[Obligation]:
    """Claim that the rules on a kind that moves keep the contact speed wherever a person may be touched.

    Unsatisfiable iff with a person within the distance neither the measured speed of the links or of a base
    that drives, nor the speed that the action asks for, can exceed its limit.
    """
    motion = site.motion
    if motion is None or motion.contact is None:
        return
    asked = motion.kinds.get(kind.name)
    if asked is None and kind.name != motion.back_off:
        return
    contact = motion.contact
    distance = site.observed_variables[contact.distance].variable
    limits = [(contact.variable, contact.speed)]
    if contact.base is not None and (asked is None or asked.base_target is not None):
        limits.append((contact.base.variable, contact.base.speed))
    speeds: list[tuple[str, t.Term, Fraction]] = [
        (name, site.observed_variables[name].variable, limit) for name, limit in limits
    ]
    if asked is not None and asked.peak_speed is not None:
        # It bounds the tool, or the base of a kind that moves the base alone.
        moves_arm = asked.tool_target is not None or asked.joint_target is not None
        limit = limits[0 if moves_arm else -1][1]
        speeds.append((asked.peak_speed, kind.parameters[asked.peak_speed].variable, limit))
    far = t.Compare("<=", t.Literal(contact.within, RealType(LENGTH)), distance)
    unit = RealType(LENGTH * TIME**-1)
    slow = [t.Compare("<=", speed, t.Literal(limit, unit)) for _, speed, limit in speeds]
    measured = " and ".join(f"`{name} <= ...`" for name, _ in limits)
    names = " or ".join(f"`{name}` above {float(1000 * limit):.4g} mm/s" for name, _, limit in speeds)
    yield Obligation(
        id=ClaimForm.CONTACT_SPEED_KEPT(kind.name),
        code="AE612",
        mode=ClaimMode.ALWAYS,
        space=action_space(site, kind, *(rule.terms[kind.name] for rule in rules)),
        conclusion=t.Or((far, t.conjunction(*slow))),
        headline=f"where a contact may happen, the rules on `{kind.name}` allow {names}",
        primary=SpanLabel(kind.span, "no rule keeps the contact speed"),
        help=(f"require {measured} where `{contact.distance}` is below {float(contact.within):g} m",),
    )


def _not_vacuous(site: Site, kind: ActionKind, rule: Rule) -> Obligation:
    """Claim that the rule denies something: some state and action inside the declared ranges breaks it."""
    return Obligation(
        id=ClaimForm.RULE_EFFECTIVE(kind.name, rule.id),
        code="AE603",
        mode=ClaimMode.SOMETIMES,
        space=action_space(site, kind),
        conclusion=t.Not(rule.terms[kind.name]),
        headline=f"`{rule.id}` can never deny {an(kind.name)}: it holds for every state and action in range",
        primary=SpanLabel(rule.require_span, "always true"),
        help=(
            "check its numbers and units, or widen the declared ranges to the values that can be measured",
        ),
        failure_verdict=Verdict.VACUOUS,
        primary_alone=True,
        labelled_conjuncts=_rule_violated(rule, kind, "always true", "never true"),
    )


def _rule_not_redundant(site: Site, kind: ActionKind, rule: Rule, rules: tuple[Rule, ...]) -> Obligation:
    """Claim that the rule denies something that no other rule denies."""
    others = tuple(other for other in rules if other is not rule)
    return Obligation(
        id=ClaimForm.RULE_NOT_SHADOWED(kind.name, rule.id),
        code="AE604",
        mode=ClaimMode.SOMETIMES,
        space=action_space(site, kind, *(other.terms[kind.name] for other in others)),
        conclusion=t.Not(rule.terms[kind.name]),
        headline=f"`{rule.id}` denies only {an(kind.name)} that the other invariants already deny",
        primary=SpanLabel(rule.require_span, "implied by the others"),
        secondary=tuple(SpanLabel(other.require_span, other.id) for other in others),
        help=("remove it, or take the action kind out of its `on`",),
        failure_verdict=Verdict.VACUOUS,
        primary_alone=True,
        labelled_conjuncts=(
            *_rule_violated(rule, kind, "implied by the others", "excluded by the others"),
            *rule_conjuncts(others, kind.name),
        ),
    )


def _rule_violated(rule: Rule, kind: ActionKind, kept: str, excluded: str) -> tuple[LabelledConjunct, ...]:
    """Return the conditions that together say that the rule is broken.

    If one of them never holds, the rule is idle.
    """
    return (
        *label_conjuncts(rule.premises.get(kind.name, ()), excluded),
        *(
            LabelledConjunct(t.Not(one.term), SpanLabel(one.span, kept))
            for one in rule.alternatives.get(kind.name, ())
        ),
    )


def _attenuation_obligations(
    site: Site, kind: ActionKind, rule: Rule, rules: tuple[Rule, ...]
) -> Iterator[Obligation]:
    """Claim that an attenuation gives an allowed action that is no larger.

    The claim is about the actions that this rule alone denies.
    """
    reduced, factors = _reduced_parameters(kind, rule.attenuations[kind.name])
    others = [other.terms[kind.name] for other in rules if other is not rule]
    known = [term for _, term in factors]
    space = action_space(site, kind, t.Not(rule.terms[kind.name]), *others, *known)
    space = replace(space, variables=(*space.variables, *(factor for factor, _ in factors)))
    yield Obligation(
        id=ClaimForm.ATTENUATION_ALLOWED(kind.name, rule.id),
        code="AE605",
        mode=ClaimMode.ALWAYS,
        space=space,
        conclusion=t.conjunction(*(t.substitute(one.terms[kind.name], reduced) for one in rules)),
        headline=f"the attenuation of `{rule.id}` can give {an(kind.name)} that is still denied",
        primary=SpanLabel(rule.span, "attenuates to an action that is still denied"),
    )
    yield Obligation(
        id=ClaimForm.ATTENUATION_SHRINKS(kind.name, rule.id),
        code="AE606",
        mode=ClaimMode.ALWAYS,
        space=space,
        conclusion=_reduction_is_smaller(kind, reduced),
        headline=f"the attenuation of `{rule.id}` can enlarge or reverse a parameter of `{kind.name}`",
        primary=SpanLabel(rule.span, "enlarges a parameter, reverses its sign, or leaves its range"),
        help=(
            "let the ranges of its vectors include 0"
            if all(isinstance(kind.parameters[name].variable.type, VectorType) for name in reduced)
            else "as in `speed: min(speed, 250 mm/s)`",
        ),
    )


def _reduced_parameters(
    kind: ActionKind, terms: Mapping[str, t.Term]
) -> tuple[dict[str, t.Term], list[tuple[Declared, t.Term]]]:
    """Return the reduced value of each parameter, and the factor of each vector with what is known of it."""
    reduced, factors = dict(terms), list[tuple[Declared, t.Term]]()
    for name, length in terms.items():
        asked = kind.parameters[name].variable
        if isinstance(asked.type, VectorType):
            factor = t.Variable(f"{name}@factor", RealType(NUMBER), t.VariableRole.PARAMETER)
            declared = Declared(factor, kind.parameters[name].span, range=(Fraction(0), Fraction(1)))
            reduced[name] = t.Multiply(factor, asked)
            factors.append((declared, _shortens(factor, asked, length)))
    return reduced, factors


def _shortens(factor: t.Variable, vector: t.Variable, length: t.Term) -> t.Term:
    """Say that a factor gives a vector this length if it is longer, and is 1 if it is not.

    The factor may be less by a millionth: so it has rational values, and is rounded down as by the gate.
    """
    x, y, z = (t.Multiply(part, part) for part in (t.Component(vector, axis) for axis in range(3)))
    square, wanted = t.Add(x, t.Add(y, z)), t.Multiply(length, length)
    zero = t.Literal(Fraction(0), RealType(_dimension(vector)))
    is_longer = t.And((t.Compare("<=", zero, length), t.Not(t.Compare("<=", square, wanted))))
    above = t.Add(factor, t.Literal(_FACTOR_SLACK, RealType(NUMBER)))
    scaled = t.And(
        (
            t.Compare("<=", t.Multiply(t.Multiply(factor, factor), square), wanted),
            t.Compare("<=", wanted, t.Multiply(t.Multiply(above, above), square)),
        )
    )
    kept = t.Compare("==", factor, t.Literal(Fraction(1), RealType(NUMBER)))
    return t.And((t.Implies(is_longer, scaled), t.Or((is_longer, kept))))


def _dimension(variable: t.Variable) -> Dimension:
    assert isinstance(variable.type, RealType | VectorType)  # noqa: S101  elaboration admits no other type
    return variable.type.dimension


def _reduction_is_smaller(kind: ActionKind, reduced: Mapping[str, t.Term]) -> t.Term:
    """Require each reduced parameter to stay in its range, and between zero and the requested value."""
    parts: list[t.Term] = []
    for name, term in reduced.items():
        parameter = kind.parameters[name]
        low, high = parameter.range or (Fraction(0), Fraction(0))
        type_ = parameter.variable.type
        if isinstance(type_, VectorType):  # its factor is between 0 and 1
            bounds = [t.Literal(bound, RealType(type_.dimension)) for bound in (low, high)]
            for axis in range(3):
                parts.append(t.Compare("<=", bounds[0], t.Component(term, axis)))
                parts.append(t.Compare("<=", t.Component(term, axis), bounds[1]))
        if isinstance(type_, RealType):
            zero, asked = t.Literal(Fraction(0), type_), parameter.variable
            forwards = t.And((t.Compare("<=", zero, term), t.Compare("<=", term, asked)))
            backwards = t.And((t.Compare("<=", asked, term), t.Compare("<=", term, zero)))
            parts.append(t.Or((forwards, backwards)))
            parts.append(t.Compare("<=", t.Literal(low, type_), term))
            parts.append(t.Compare("<=", term, t.Literal(high, type_)))
    return t.conjunction(*parts)
