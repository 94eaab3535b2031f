"""Claims about the effects of outcomes on quantities (`aeros.spec.expr.effects`).

An increment leaves its variable in its range, whenever the skill may start. A value that proofs of
compositions and rules derive for a predicate with a definition follows from what the outcome states. An
outcome that changes a quantity declares each predicate whose definition reads it, and some state in its
ranges has these values.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from aeros.spec.consequences.consequences import implications, known_definitions, with_consequences
from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.expr import terms as t
from aeros.spec.expr.effects import Increment
from aeros.spec.expr.types import RealType
from aeros.spec.expr.units import NUMBER
from aeros.spec.flow.arguments import effect_term
from aeros.spec.model.ecm import Ecm, Outcome, Skill
from aeros.spec.model.perception import Definition
from aeros.spec.model.site import Site
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.obligation import ClaimMode, Obligation, VariableSpace
from aeros.spec.obligations.verdicts import StaticClaim


def effect_claims(ecm: Ecm, site: Site) -> Iterator[Obligation | StaticClaim]:
    """List the claims about effects on quantities of all skills of a module.

    Args:
        ecm: the module.
        site: the site.

    Yields:
        The claims; none for outcomes without increments and ranges.
    """
    for skill in ecm.skills.values():
        for outcome in skill.outcomes.values():
            for name, effect in outcome.effects.items():
                if isinstance(effect, Increment):
                    yield _stays_in_range(ecm, site, skill, outcome, name, effect)
            yield from _definitions_agree(ecm, site, skill, outcome)
    for name, skill in with_consequences(ecm, site).callable_skills.items():
        for outcome in skill.outcomes.values():
            yield from _values_follow(ecm, site, name, skill, outcome)


def _values_follow(ecm: Ecm, site: Site, name: str, skill: Skill, outcome: Outcome) -> Iterator[Obligation]:
    definitions = known_definitions(ecm)
    for predicate, stated, conclusion in implications(outcome, definitions, site.observed_variables):
        yield Obligation(
            id=ClaimForm.VALUE_FOLLOWS(name, outcome.id, predicate),
            code="AE513",
            mode=ClaimMode.ALWAYS,
            space=VariableSpace(tuple(site.observed_variables.values()), stated),
            conclusion=conclusion,
            headline=f"`{outcome.id}` of `{name}` does not decide `{predicate}`, as proofs assume",
            primary=SpanLabel(definitions[predicate].span, "does not follow"),
            secondary=(SpanLabel(skill.span, "from what it states"),),
            help=(f"state `{predicate}` among its effects",),
        )


def _stays_in_range(
    ecm: Ecm, site: Site, skill: Skill, outcome: Outcome, name: str, effect: Increment
) -> Obligation:
    declared, word = site.state[name], name.removeprefix(f"{ecm.id}.")
    assert declared.range is not None  # noqa: S101  elaboration admits no increment without a range
    low, high = (t.Literal(bound, RealType(NUMBER)) for bound in declared.range)
    after = effect_term(effect, declared.variable)
    precondition = skill.precondition
    compared, side = ("<=", "above") if effect.amount > 0 else (">=", "below")
    most = declared.range[effect.amount > 0] - effect.amount
    return Obligation(
        id=ClaimForm.INCREMENT_IN_RANGE(skill.id, outcome.id, name),
        code="AE512",
        mode=ClaimMode.ALWAYS,
        space=VariableSpace(
            (*site.observed_variables.values(), *skill.inputs.values()),
            () if precondition is None else (precondition.term,),
        ),
        conclusion=t.And((t.Compare("<=", low, after), t.Compare("<=", after, high))),
        headline=f"`{outcome.id}` of `{skill.id}` may leave `{word}` {side} its range: {effect}",
        primary=SpanLabel(skill.span if precondition is None else precondition.span, "allows the start"),
        help=(f"add `{word} {compared} {most}` to its `precondition`, or widen the range",),
    )


def _definitions_agree(
    ecm: Ecm, site: Site, skill: Skill, outcome: Outcome
) -> Iterator[Obligation | StaticClaim]:
    """Claim that the outcome declares each predicate that its changes of quantities decide, and truly.

    And that no other effect, and no other predicate that it declares, excludes the value that it declares.
    """
    definitions = {name: one for owner in ecm.with_owners for name, one in owner.definitions.items()}
    counted = {name for name, effect in outcome.effects.items() if isinstance(effect, Increment)}
    changed = {one.variable for one in outcome.ranges} | counted
    shown = sorted(name.removeprefix(f"{ecm.id}.") for name in counted)
    within = [one.term(site.state[one.variable].variable) for one in outcome.ranges]
    settled = {
        name: effect_term(effect, site.state[name].variable)
        for name, effect in outcome.effects.items()
        if not isinstance(effect, Increment)
    }
    stated = {name: one.term for name, one in definitions.items() if name in outcome.effects}
    decided = _names_defined_by(definitions, changed)
    for name in (*decided, *(one for one in stated if one not in decided)):
        claim_id = ClaimForm.RANGE_AGREES(skill.id, outcome.id, name)
        term, span, word = definitions[name].term, definitions[name].span, name.removeprefix(f"{ecm.id}.")
        if name not in outcome.effects:
            yield StaticClaim(claim_id, _undeclared(word, span, skill, outcome, shown))
            continue
        read = t.variables_of(term).keys()
        related = [one for one, each in stated.items() if one != name and read & t.variables_of(each).keys()]
        if name not in decided and not related and read.isdisjoint(settled):
            continue  # nothing that the outcome states bears on it
        is_true = outcome.effects[name]
        holds = [
            t.substitute(stated[one] if outcome.effects[one] else t.Not(stated[one]), settled)
            for one in (name, *related)
        ]
        yield Obligation(
            id=claim_id,
            code="AE513",
            mode=ClaimMode.SOMETIMES,
            space=VariableSpace(tuple(site.observed_variables.values()), ()),
            conclusion=t.conjunction(*within, *holds),
            headline=f"`{outcome.id}` of `{skill.id}` cannot leave `{word}` {str(is_true).lower()}: "
            "its other effects and the definition exclude that",
            primary=SpanLabel(span, "never so after it"),
            secondary=(SpanLabel(skill.span, "declares it"),),
            help=("correct the range, the other effects, or the effect on the predicate",),
        )


def _names_defined_by(definitions: Mapping[str, Definition], changed: Iterable[str]) -> list[str]:
    """List the predicates whose definition reads something that changes, at any depth."""
    found, grows = set(changed), True
    while grows:
        more = {name for name, one in definitions.items() if found & t.variables_of(one.term).keys()}
        grows = not more <= found
        found |= more
    return [name for name in definitions if name in found]


def _undeclared(
    name: str, span: SourceSpan, skill: Skill, outcome: Outcome, counted: Sequence[str]
) -> Diagnostic:
    cures = [f"declare `{name}` among its effects, too"]
    if counted:
        cures.append(
            f"or compare `{counted[0]}` itself where `{name}` is used, and define no predicate by it"
        )
    return Diagnostic(
        "AE513",
        f"`{outcome.id}` of `{skill.id}` changes what `{name}` is defined by, and does not say `{name}`",
        SpanLabel(skill.span),
        (SpanLabel(span, "defined here"),),
        help=tuple(cures),
    )
