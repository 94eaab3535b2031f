"""Claims about two actions at the same time: joint rules of the site, and steps that obey them.

A joint rule is about an action in each of two roles.  Each action is allowed by itself: Φ holds for each in
the state in which both are executed; the monitor ensures that.  An envelope, however, was decided when its
action began, perhaps in another state: `a.x` of a state variable `x` is its value when the action `a` began
(docs/decisions/0003-precondition-is-not-assumed.md says why the value now may not be assumed).
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace

from aeros.spec.diagnostics.codes import SpanLabel
from aeros.spec.expr import terms as t
from aeros.spec.flow.arguments import Arguments
from aeros.spec.model.composition import Step
from aeros.spec.model.ecm import Skill
from aeros.spec.model.rules import JointRule
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
from aeros.spec.obligations.verdicts import Verdict


@dataclass(frozen=True)
class ConcurrentStep:
    """A step whose skill may ask for actions while another does.

    Attributes:
        name: name of the step, unique in its composition.
        step: the step or handler.
        skill: the skill that it runs.
        arguments: the skill's inputs.
    """

    name: str
    step: Step
    skill: Skill
    arguments: Arguments


def joint_policy_obligations(site: Site) -> Iterator[Obligation]:
    """Claim that every joint rule allows some pair of allowed actions, and denies some pair.

    Args:
        site: site that declares the joint rules.

    Yields:
        Two obligations for each joint rule.
    """
    for rule in site.joint_rules:
        allowed = tuple(_site_rules_for_role(site, role, kind) for role, kind in rule.roles)
        space = VariableSpace(joint_variables(site, rule), allowed)
        label = SpanLabel(rule.require_span)
        yield Obligation(
            ClaimForm.JOINT_RULE_SATISFIABLE(rule.id),
            "AE601",
            ClaimMode.SOMETIMES,
            space,
            rule.term,
            f"`{rule.id}` allows no two actions at the same time",
            label,
            labelled_conjuncts=(
                *label_conjuncts(rule.conjuncts, "clashes"),
                *_required_conjuncts(site, rule),
            ),
        )
        yield Obligation(
            ClaimForm.JOINT_RULE_EFFECTIVE(rule.id),
            "AE603",
            ClaimMode.SOMETIMES,
            space,
            t.Not(rule.term),
            f"`{rule.id}` can never deny anything: no two allowed actions break it",
            label,
            failure_verdict=Verdict.VACUOUS,
            labelled_conjuncts=(LabelledConjunct(t.Not(rule.term), label), *_required_conjuncts(site, rule)),
        )


def joint_obligations(
    composition: str, par: int, site: Site, one: ConcurrentStep, other: ConcurrentStep
) -> Iterator[Obligation]:
    """Claim that any two actions of two concurrent steps obey every joint rule, in either order of roles.

    Args:
        composition: id of the composition that runs both steps.
        par: number of the `par` in it that runs them at the same time, counted from 1.
        site: site that declares the joint rules.
        one: a step in one branch.
        other: a step in another branch; a handler of both branches may run at the same time as itself.

    Yields:
        An obligation for each joint rule and order of roles in which both envelopes have the action kinds.
    """
    orders = ((one, other),) if one.name == other.name else ((one, other), (other, one))
    for rule in site.joint_rules:
        (first, left), (second, right) = rule.roles
        for a, b in orders:
            if left not in a.skill.envelope or right not in b.skill.envelope:
                continue
            assumed = (
                _envelope(site, first, left, a),
                _envelope(site, second, right, b),
                *(_site_rules_for_role(site, role, kind) for role, kind in rule.roles),
            )
            declared = (*joint_variables(site, rule), *a.arguments.variables, *b.arguments.variables)
            note = f"`{first}` is the `{left}` of `{a.step.id}`, `{second}` the `{right}` of `{b.step.id}`"
            envelope_names = {name for term in assumed[:2] for name in t.variables_of(term)}
            if any(f"{role}.{name}" in envelope_names for role in (first, second) for name in site.state):
                note += "; of measured values, as they were when the action began"
            yield Obligation(
                ClaimForm.PAR_JOINT_RULE(composition, par, a.name, b.name, rule.id),
                "AE861",
                ClaimMode.ALWAYS,
                VariableSpace(tuple({d.name: d for d in declared}.values()), assumed),
                rule.term,
                f"`{a.step.id}` and `{b.step.id}` together may break the joint invariant `{rule.id}`",
                SpanLabel(a.step.span, f"may ask for `{left}`"),
                (
                    SpanLabel(b.step.span, f"at the same time, for `{right}`"),
                    SpanLabel(a.skill.envelope[left].span, "allows it"),
                    SpanLabel(b.skill.envelope[right].span, "allows it"),
                    SpanLabel(rule.require_span, f"`{rule.id}` forbids both together"),
                ),
                ("tighten an envelope, or run one after the other in a `seq`",),
                notes=(note,),
                labelled_conjuncts=label_conjuncts(rule.conjuncts, f"`{rule.id}` forbids both together"),
            )


def joint_variables(
    site: Site, rule: JointRule, names: Collection[str] | None = None
) -> tuple[Declared, ...]:
    """List the variables of a joint rule: the state now, and for each role its parameters and earlier state.

    Args:
        site: site that declares the rule.
        rule: the joint rule.
        names: names of the variables to list; None for all.

    Returns:
        The variables; those of a role are prefixed with its name, its state being that when its action began.
    """
    own = [
        _for_role(role, one)
        for role, kind in rule.roles
        for one in (*site.kinds[kind].parameters.values(), *site.state.values())
        if names is None or f"{role}.{one.name}" in names
    ]
    return (*(one for one in site.observed_variables.values() if names is None or one.name in names), *own)


def _for_role(role: str, variable: Declared) -> Declared:
    return replace(variable, variable=replace(variable.variable, name=f"{role}.{variable.name}"))


def _site_rules_for_role(site: Site, role: str, kind: str) -> t.Term:
    """Return Φ for the action in `role`, in the state now."""
    rules = t.conjunction(*(rule.terms[kind] for rule in site.rules_for_kind(kind)))
    return t.substitute(rules, _rename_for_role(role, site.kinds[kind].parameters))


def _required_conjuncts(site: Site, rule: JointRule) -> Iterator[LabelledConjunct]:
    """Yield the conjuncts of Φ for each action by itself, in the state now."""
    for role, kind in rule.roles:
        names = _rename_for_role(role, site.kinds[kind].parameters)
        for member in rule_conjuncts(site.rules_for_kind(kind), kind):
            label = SpanLabel(member.label.span, f"{member.label.text} of `{role}`")
            yield LabelledConjunct(t.substitute(member.term, names), label)


def _envelope(site: Site, role: str, kind: str, running: ConcurrentStep) -> t.Term:
    """Return the envelope of the skill's action in `role`, in the state when the action was asked for."""
    names = {**site.kinds[kind].parameters, **site.state}
    terms = {**_rename_for_role(role, names), **running.arguments.terms}
    return t.substitute(running.skill.envelope[kind].term, terms)


def _rename_for_role(role: str, declared: Mapping[str, Declared]) -> dict[str, t.Term]:
    return {name: _for_role(role, one).variable for name, one in declared.items()}
