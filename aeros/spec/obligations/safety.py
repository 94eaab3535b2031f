"""Claims about a skill's envelope: every action in it obeys Φ, or the gate decides the rules it may break.

The claims are for each skill and each action kind of its envelope, over all states, parameters and inputs in
range.  They do *not* assume the precondition.  It holds when the skill starts, while the gate must decide
every later action too, so the gate could not rely on a proof that used it
(docs/decisions/0003-precondition-is-not-assumed.md).

An invariant that the envelope implies is *proved*; the gate need not evaluate it again.  An invariant that it
does not imply is *runtime-checked* if it depends on the state and either is about the state alone or is
listed under `gated`.  The gate then decides it every time, and its decision has to depend on the state, not
only mention it.  Anything else is an error, as is a *dead* action kind, of which no action is ever allowed.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace

from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel
from aeros.spec.diagnostics.grammar import an
from aeros.spec.expr import terms as t
from aeros.spec.flow.arguments import effect_term
from aeros.spec.model.ecm import ActionCondition, Ecm, Skill, Task
from aeros.spec.model.rules import Rule
from aeros.spec.model.site import Site
from aeros.spec.model.variables import relevant_facts
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.obligation import (
    ClaimMode,
    Obligation,
    VariableSpace,
    label_conjuncts,
    rule_conjuncts,
)
from aeros.spec.obligations.outcomes.effects import effect_claims
from aeros.spec.obligations.verdicts import StaticClaim, Verdict


def safety_obligations(ecm: Ecm, site: Site) -> Iterator[Obligation | StaticClaim]:
    """Make every claim of group safety about a module.

    Args:
        ecm: the module.
        site: site whose rules apply.

    Yields:
        Claims settled at once, and obligations for the solver.
    """
    for skill in ecm.skills.values():
        if skill.precondition is not None:
            yield _can_start(site, skill, skill.precondition)
        if skill.hold_condition is not None:
            yield from _hold_condition_satisfiable(site, skill, skill.hold_condition)
            yield from _can_succeed(site, skill, skill.hold_condition)
        for kind, clause in skill.envelope.items():
            space = envelope_space(site, skill, kind, clause)
            yield _not_empty(skill, kind, clause, space)
            yield _clause_allowed_somewhere(ecm, site, skill, kind, clause, space)
            for rule in site.rules_for_kind(kind):
                yield _clause_obeys_rule(ecm, skill, kind, clause, rule, space)
        if not skill.leaves_any_to_gate:  # which rules these are, no author could know
            yield from _runtime_checks_matter(site, skill)
    yield from effect_claims(ecm, site)
    for task in ecm.tasks.values():
        yield _goal_can_hold(site, ecm, task)
        yield _goal_can_fail(site, ecm, task)


def envelope_space(site: Site, skill: Skill, kind: str, clause: ActionCondition) -> VariableSpace:
    """Make the space of all states, inputs and parameters that a skill's envelope admits.

    Args:
        site: the site.
        skill: the skill, for its inputs.
        kind: an action kind of its envelope.
        clause: condition of the envelope on actions of that kind; it is assumed.

    Returns:
        The space.
    """
    parameters = site.kinds[kind].parameters.values()
    return VariableSpace(
        (*site.observed_variables.values(), *skill.inputs.values(), *parameters), (clause.term,)
    )


def parameter_cures(ecm: Ecm, clause: ActionCondition) -> tuple[str, ...]:
    """Propose other values for the parameters of a module that a condition reads.

    Args:
        ecm: the module.
        clause: a condition of its envelope.

    Returns:
        A line for each parameter, with its value and the options that set it.
    """
    return tuple(
        f"the condition depends on the parameter `{name}`, now {value}: on a robot, "
        f"`aeros configure {ecm.id} --set {name}=…`; otherwise `--set {ecm.id}.{name}=…`"
        for name, value in ecm.names.parameters.items()
        if re.search(rf"(?<![\w.]){name}\b", clause.text)
    )


def is_runtime_checked(rule: Rule, skill: Skill, kind: str) -> bool:
    """Tell whether the gate may decide a rule that a skill's envelope does not imply.

    Args:
        rule: rule of the site.
        skill: the skill, with the rules that it leaves to the gate.
        kind: an action kind of its envelope that the rule governs.

    Returns:
        True if the rule does not constrain the action itself, or the skill lists it and it reads the state.
    """
    return not rule.constrains_action(kind) or (rule.id in skill.runtime_checked and _reads_state(rule, kind))


def _reads_state(rule: Rule, kind: str) -> bool:
    return any(one.role is t.VariableRole.STATE for one in t.variables_of(rule.terms[kind]).values())


def state_rules_of_skill(site: Site, skill: Skill) -> list[t.Term]:
    """List every rule about states that all actions of a skill must obey.

    Args:
        site: the site.
        skill: the skill.

    Returns:
        The conditions.
    """
    return [
        rule.terms[next(iter(skill.envelope))]
        for rule in site.rules
        if skill.envelope
        and skill.envelope.keys() <= rule.terms.keys()
        and not any(rule.constrains_action(kind) for kind in skill.envelope)
    ]


def _can_start(site: Site, skill: Skill, precondition: ActionCondition) -> Obligation:
    """Claim that some state satisfies the precondition and the rules about states for all its actions."""
    always = state_rules_of_skill(site, skill)
    return Obligation(
        id=ClaimForm.SKILL_CAN_START(skill.id),
        code="AE504",
        mode=ClaimMode.SOMETIMES,
        space=VariableSpace((*site.observed_variables.values(), *skill.inputs.values()), ()),
        conclusion=t.conjunction(precondition.term, *always),
        headline=f"`{skill.id}` could never act: no state that the invariants allow meets its precondition",
        primary=SpanLabel(precondition.span, "never true"),
        labelled_conjuncts=label_conjuncts(precondition.conjuncts, "clashes"),
    )


def _hold_condition_satisfiable(site: Site, skill: Skill, hold: ActionCondition) -> Iterator[Obligation]:
    """Claim that some state in which the skill may start, and act, satisfies its hold-condition.

    The conjuncts about predicates are part of the precondition, and claimed with it.
    """
    precondition = t.TRUE if skill.precondition is None else skill.precondition.term
    known = () if skill.precondition is None else skill.precondition.conjuncts
    if set(hold.conjuncts) <= set(known):
        return
    yield Obligation(
        id=ClaimForm.HOLD_SATISFIABLE(skill.id),
        code="AE510",
        mode=ClaimMode.SOMETIMES,
        space=VariableSpace((*site.observed_variables.values(), *skill.inputs.values()), ()),
        conclusion=t.conjunction(precondition, hold.term, *state_rules_of_skill(site, skill)),
        headline=f"`{skill.id}` would be halted at once: no state in which it may start satisfies its `hold`",
        primary=SpanLabel(hold.span, "never true at the start"),
        labelled_conjuncts=label_conjuncts(dict.fromkeys((*hold.conjuncts, *known)), "clashes"),
    )


def _can_succeed(site: Site, skill: Skill, hold: ActionCondition) -> Iterator[Obligation]:
    """Claim that each success can be measured while the hold-condition holds.

    A skill's effects are set before it ends.
    """
    for outcome in skill.success_outcomes:
        if outcome.probability == 0:
            continue
        set_ = {name: effect_term(v, site.state[name].variable) for name, v in outcome.effects.items()}
        within = [one.term(site.state[one.variable].variable) for one in outcome.ranges]
        touched = set_.keys() | {one.variable for one in outcome.ranges}
        if not touched & t.variables_of(hold.term).keys():
            continue
        yield Obligation(
            id=ClaimForm.HOLD_ALLOWS_SUCCESS(skill.id, outcome.id),
            code="AE510",
            mode=ClaimMode.SOMETIMES,
            space=VariableSpace((*site.observed_variables.values(), *skill.inputs.values()), ()),
            conclusion=t.conjunction(t.substitute(hold.term, set_), *within),
            headline=f"`{skill.id}` is halted before it ends as `{outcome.id}`, which contradicts its `hold`",
            primary=SpanLabel(hold.span, f"never true after `{outcome.id}`"),
            help=("weaken the hold-condition so that it agrees with the effects of the outcome",),
        )


def _not_empty(skill: Skill, kind: str, clause: ActionCondition, space: VariableSpace) -> Obligation:
    word = clause.kind_name or kind
    return Obligation(
        id=ClaimForm.ENVELOPE_NOT_EMPTY(skill.id, kind),
        code="AE503",
        mode=ClaimMode.SOMETIMES,
        space=VariableSpace(space.variables, ()),
        conclusion=clause.term,
        headline=f"the envelope of `{skill.id}` contains no `{word}`, so nothing is proved of it",
        primary=SpanLabel(clause.span, "satisfied by no action in range"),
        help=("remove the action kind, or correct the condition",),
        failure_verdict=Verdict.VACUOUS,
        labelled_conjuncts=label_conjuncts(clause.conjuncts, "clashes"),
    )


def _clause_allowed_somewhere(
    ecm: Ecm, site: Site, skill: Skill, kind: str, clause: ActionCondition, space: VariableSpace
) -> Obligation:
    rules = site.rules_for_kind(kind)
    permission = ecm.permitted_actions.get(kind)
    permitted = t.TRUE if permission is None else permission.term
    allowed = (
        () if permission is None else label_conjuncts(permission.conjuncts, "required by the permission")
    )
    return Obligation(
        id=ClaimForm.ENVELOPE_NOT_DEAD(skill.id, kind),
        code="AE502",
        mode=ClaimMode.SOMETIMES,
        space=space,
        conclusion=t.conjunction(permitted, *(rule.terms[kind] for rule in rules)),
        headline=f"`{skill.id}` is dead: no `{clause.kind_name or kind}` that it may ask for is ever allowed",
        primary=SpanLabel(clause.span, "all of these are denied, in every state"),
        secondary=tuple(
            SpanLabel(rule.require_span, rule.id) for rule in rules if rule.constrains_action(kind)
        ),
        labelled_conjuncts=(
            *label_conjuncts(clause.conjuncts, "clashes"),
            *allowed,
            *rule_conjuncts(rules, kind),
        ),
    )


def _clause_obeys_rule(
    ecm: Ecm, skill: Skill, kind: str, clause: ActionCondition, rule: Rule, space: VariableSpace
) -> Obligation:
    word = clause.kind_name or kind
    help_ = [*parameter_cures(ecm, clause), "tighten the envelope until it implies the invariant"]
    if _reads_state(rule, kind):
        help_.append(f"or let the gate check it before each action: `gated: [{rule.id}]`")
    return Obligation(
        id=ClaimForm.ENVELOPE_OBEYS(skill.id, kind, rule.id),
        code="AE501",
        mode=ClaimMode.ALWAYS,
        space=space,
        conclusion=rule.terms[kind],
        headline=f"`{skill.id}` may ask for {an(word)} that breaks the invariant `{rule.id}`",
        primary=SpanLabel(clause.span, "allows it"),
        secondary=(SpanLabel(rule.require_span, f"`{rule.id}` forbids it"),),
        help=tuple(help_),
        runtime_checked_rule=rule.id if is_runtime_checked(rule, skill, kind) else None,
        labelled_conjuncts=label_conjuncts(rule.conjuncts.get(kind, ()), f"`{rule.id}` forbids it"),
        clause=clause,
    )


def _runtime_checks_matter(site: Site, skill: Skill) -> Iterator[Obligation | StaticClaim]:
    """Claim that each runtime-checked rule denies an action in one state that it allows in another.

    The claim is for each action kind.  Otherwise the same actions break it in every state, and the gate would
    only move the stop to run time.
    """
    for rule in site.rules:
        if rule.id not in skill.runtime_checked:
            continue
        governed = [kind for kind in skill.envelope if kind in rule.terms]
        reading = [kind for kind in governed if _reads_state(rule, kind)]
        for kind in reading:
            yield _state_matters(site, skill, rule, kind)
        if reading:
            continue
        if governed:
            headline, label_text, help_ = (
                _IDLE_RUNTIME_CHECK.format(rule.id),
                "reads no state",
                _IDLE_RUNTIME_CHECK_HELP,
            )
        else:
            headline = f"`{rule.id}` governs no action that `{skill.id}` may ask for"
            label_text, help_ = "governs other action kinds", "remove it from `gated`"
        labels = (SpanLabel(rule.require_span, label_text),)
        yield StaticClaim(
            ClaimForm.GATED_RULE_READS_STATE(skill.id, rule.id),
            Diagnostic("AE506", headline, SpanLabel(skill.runtime_checked[rule.id]), labels, help=(help_,)),
        )


_IDLE_RUNTIME_CHECK = "`{}` cannot be runtime-checked: its result does not depend on the state"
_IDLE_RUNTIME_CHECK_HELP = "remove it from `gated` and tighten the envelope"


def _state_matters(site: Site, skill: Skill, rule: Rule, kind: str) -> Obligation:
    """Claim that the rule allows an action in one state and denies it in another.

    The variable `then.x` is `x` in the other state.
    """
    term = rule.terms[kind]
    read, _ = relevant_facts((term,), site.observed_variables)
    then = {one.name: replace(one.variable, name=f"then.{one.name}") for one in read}
    others = [
        replace(
            one,
            variable=then[one.name],
            known_facts=tuple(t.substitute(fact, then) for fact in one.known_facts),
        )
        for one in read
    ]
    return Obligation(
        id=ClaimForm.GATED_RULE_NEEDS_STATE(skill.id, rule.id, kind),
        code="AE506",
        mode=ClaimMode.SOMETIMES,
        space=VariableSpace((*read, *others, *site.kinds[kind].parameters.values()), ()),
        conclusion=t.conjunction(term, t.Not(t.substitute(term, then))),
        headline=_IDLE_RUNTIME_CHECK.format(rule.id),
        primary=SpanLabel(skill.runtime_checked[rule.id]),
        secondary=(SpanLabel(rule.require_span, f"allows {an(kind)} in every state or in none"),),
        help=(_IDLE_RUNTIME_CHECK_HELP,),
    )


def _goal_can_hold(site: Site, ecm: Ecm, task: Task) -> Obligation:
    whole = task.goal_conjuncts
    place = whole[0].span.merge(whole[-1].span) if whole else ecm.span
    return Obligation(
        id=ClaimForm.GOAL_SATISFIABLE(task.id),
        code="AE507",
        mode=ClaimMode.SOMETIMES,
        space=VariableSpace(tuple(site.observed_variables.values()), ()),
        conclusion=task.goal,
        headline=f"no state satisfies the goal of `{task.id}`",
        primary=SpanLabel(place, "never true" if whole else f"`{task.goal_text}` is never true"),
        labelled_conjuncts=label_conjuncts(task.goal_conjuncts, "clashes"),
    )


def _goal_can_fail(site: Site, ecm: Ecm, task: Task) -> Obligation:
    """Claim that the goal fails in some state, so that it is not reached by doing nothing."""
    whole = task.goal_conjuncts
    return Obligation(
        id=ClaimForm.GOAL_EFFECTIVE(task.id),
        code="AE508",
        mode=ClaimMode.SOMETIMES,
        space=VariableSpace(tuple(site.observed_variables.values()), ()),
        conclusion=t.Not(task.goal),
        headline=f"the goal of `{task.id}` holds in every state, so it would be reached by doing nothing",
        primary=SpanLabel(whole[0].span.merge(whole[-1].span) if whole else ecm.span, "always true"),
        failure_verdict=Verdict.VACUOUS,
    )
