"""Comparison of two versions of a site: what Φ and Π newly allow and newly deny, for each action kind.

For each action kind the compared set is the conjunction of its invariants; it is empty if an override or the
risk ceiling denies the kind to every module. For each joint rule it is the set of allowed pairs. Access,
overrides of single modules, limits, quotas and the age of measurements are compared one by one. The effect of
an attenuation on an action that is denied as requested is not compared; a change of one is reported as
changed, and so is everything that is only compared as it is written (`other_changes`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from fractions import Fraction

from aeros.spec.backends.oracle import Oracle
from aeros.spec.diagnostics.grammar import an
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.difference.module_changes import ACCESS
from aeros.spec.difference.perception_changes import site_perception_changes, vocabulary_changes
from aeros.spec.difference.policy_change import (
    PolicyChange,
    Relation,
    bounds_relation,
    describe_set_change,
    finite_change,
    sets_relation,
)
from aeros.spec.difference.set_comparison import ComparedSet, SetCondition, compare_sets
from aeros.spec.difference.tool_changes import tool_changes
from aeros.spec.expr import terms as t
from aeros.spec.expr.units import format_number
from aeros.spec.model.policy import Access, Execute, OperatorOverride, Quota
from aeros.spec.model.rules import ActionKind, JointRule
from aeros.spec.model.site import Site
from aeros.spec.obligations.joint import joint_variables


def site_changes(old: Site, new: Site, oracle: Oracle) -> Iterator[PolicyChange]:
    """Compare two versions of a site.

    Args:
        old: site before.
        new: site now.
        oracle: answers the questions.

    Yields:
        The change of each subject of either site.
    """
    for name in dict.fromkeys([*old.kinds, *new.kinds]):
        before, after = _allowed(old, name), _allowed(new, name)
        yield compare_sets(f"actions/{name}", f"{an(name)}", before, after, oracle)
        if name in old.kinds and name in new.kinds:
            yield from _kind_changes(old, new, old.kinds[name], new.kinds[name])
    yield from _joint_changes(old, new, oracle)
    yield from vocabulary_changes(old.state, new.state)
    yield from site_perception_changes(old, new)
    places = (old.policy_spans.get("policy/access"), new.policy_spans.get("policy/access"))
    yield from _access_changes("policy/access", "every module", old.access, new.access, places)
    for module in dict.fromkeys([*old.grants, *new.grants]):
        given = [one.grants.get(module, Access()) for one in (old, new)]
        places = (old.grant_spans.get(module), new.grant_spans.get(module))
        yield from _access_changes(f"policy/grants/{module}", f"`{module}`", given[0], given[1], places)
    yield from _number_changes(old, new)
    yield from _block_changes(old.blocks, new.blocks)
    yield from _quota_changes(old.quotas, new.quotas)
    yield from _isolation_changes(old, new)
    yield from _mcp_changes(old, new)
    yield _undeclared_outcome_change(old, new)
    yield _motion_change(old, new)


def _undeclared_outcome_change(old: Site, new: Site) -> PolicyChange:
    """Compare the reactions to undeclared outcomes; `replan` lets a task continue, so it allows more."""
    before, after = old.stops_on_undeclared_outcome, new.stops_on_undeclared_outcome
    words = ["stop" if stops else "replan" for stops in (before, after)]
    headline = f"the reaction to an undeclared outcome was `{words[0]}` and is `{words[1]}`"
    places = [site.policy_spans.get("policy/undeclared_outcome") for site in (old, new)]
    relation = bounds_relation(before and not after, after and not before)
    return finite_change("policy/undeclared_outcome", relation, headline, *places)


def _motion_change(old: Site, new: Site) -> PolicyChange:
    """Report a change of the motion model, which may allow some motions and deny others, uncompared."""
    changed = old.motion != new.motion
    relation = bounds_relation(changed and old.motion is not None, changed and new.motion is not None)
    headline = "the limits for whole motions changed: the section `motion` or a constant that it names"
    return finite_change("motion", relation, headline, old.span, new.span)


def _allowed(site: Site, name: str) -> ComparedSet:
    kind = site.kinds.get(name)
    if kind is None:
        return ComparedSet((), (SetCondition(t.FALSE, None),), site.span)
    conditions = [SetCondition(rule.terms[name], rule.require_span) for rule in site.rules_for_kind(name)]
    everywhere = (
        block.module is None and block.skill is None and block.action == name for block in site.blocks
    )
    if any(everywhere) or kind.risk > site.risk_ceiling:
        conditions.append(SetCondition(t.FALSE, kind.span))
    return ComparedSet(
        (*site.observed_variables.values(), *kind.parameters.values()), tuple(conditions), kind.span
    )


def _kind_changes(old: Site, new: Site, before: ActionKind, after: ActionKind) -> Iterator[PolicyChange]:
    subject, places = f"actions/{after.name}", (before.span, after.span)
    risk = bounds_relation(after.risk < before.risk, after.risk > before.risk)
    words = [kind.risk.name.lower() for kind in (before, after)]
    yield finite_change(
        f"{subject}/risk", risk, f"the risk of `{after.name}` was {words[0]} and is {words[1]}", *places
    )
    moved = sets_relation(after.actuators, before.actuators)  # fewer to be permitted allows more
    headline = describe_set_change(f"actuators that `{after.name}` moves", before.actuators, after.actuators)
    yield finite_change(f"{subject}/actuators", moved, headline, *places)
    yield from tool_changes(f"{subject}/tool", before, after)
    reduced = [
        {
            rule.id: rule.attenuations[after.name]
            for rule in site.rules_for_kind(after.name)
            if after.name in rule.attenuations
        }
        for site in (old, new)
    ]
    if reduced[0] != reduced[1] or before.protective != after.protective:
        headline = f"the attenuations of `{after.name}` differ"
        yield finite_change(f"{subject}/attenuation", Relation.CHANGED_OTHERWISE, headline, *places)


def _joint_changes(old: Site, new: Site, oracle: Oracle) -> Iterator[PolicyChange]:
    """Compare the pairs of actions that each joint rule allows."""
    before, after = ({rule.id: rule for rule in site.joint_rules} for site in (old, new))
    for name in dict.fromkeys([*before, *after]):
        one, other = _pairs(old, before.get(name)), _pairs(new, after.get(name))
        one = replace(one, variables=one.variables or other.variables)
        other = replace(other, variables=other.variables or one.variables)
        yield compare_sets(f"joint/{name}", f"a pair of actions under `{name}`", one, other, oracle)


def _pairs(site: Site, rule: JointRule | None) -> ComparedSet:
    """Return the set of pairs that the rule allows; without a rule, all pairs."""
    if rule is None:
        return ComparedSet((), (), site.span)
    return ComparedSet(
        joint_variables(site, rule), (SetCondition(rule.term, rule.require_span),), rule.require_span
    )


def _access_changes(
    subject: str, who: str, old: Access, new: Access, places: tuple[SourceSpan | None, SourceSpan | None]
) -> Iterator[PolicyChange]:
    for group in ACCESS:
        before, after = getattr(old, group), getattr(new, group)
        headline = describe_set_change(f"{group} granted to {who}", before, after)
        yield finite_change(f"{subject}/{group}", sets_relation(before, after), headline, *places)


def _number_changes(old: Site, new: Site) -> Iterator[PolicyChange]:
    """Compare the risk ceiling, limits and capacities; larger numbers allow more."""
    pairs: dict[str, tuple[Fraction | int, Fraction | int]] = {
        "policy/risk_ceiling": (old.risk_ceiling, new.risk_ceiling),
        "policy/limits/skill_timeout": (old.limits.skill_timeout, new.limits.skill_timeout),
        "policy/limits/retries": (old.limits.retries, new.limits.retries),
        "policy/limits/replans": (old.limits.replans, new.limits.replans),
        "policy/limits/planning": (old.limits.planning, new.limits.planning),
    }
    for name in dict.fromkeys([*old.resources, *new.resources]):
        pairs[f"resources/{name}"] = (old.resources.get(name, 0), new.resources.get(name, 0))
    for subject, (before, after) in pairs.items():
        relation = bounds_relation(after > before, after < before)
        shown = [format_number(Fraction(value)) for value in (before, after)]
        headline = f"`{subject.replace('/', '.')}` was {shown[0]} and is {shown[1]}"
        yield finite_change(
            subject, relation, headline, *(one.policy_spans.get(subject) for one in (old, new))
        )


def _block_changes(
    old: Sequence[OperatorOverride], new: Sequence[OperatorOverride]
) -> Iterator[PolicyChange]:
    """Compare overrides by what they match; a further override denies more."""
    before, after = ({(one.module, one.skill, one.action): one for one in blocks} for blocks in (old, new))
    for matched in dict.fromkeys([*before, *after]):
        block = before.get(matched) or after[matched]
        relation = bounds_relation(matched not in after, matched not in before)
        verb = "no longer blocks" if matched not in after else "now blocks"
        named = ", ".join(
            f"{what} `{name}`" for what, name in zip(_BLOCK_MATCH_FIELDS, matched, strict=True) if name
        )
        spans = (None if one is None else one.span for one in (before.get(matched), after.get(matched)))
        yield finite_change(f"policy/blocks/{block.id}", relation, f"the operator {verb} {named}", *spans)


_BLOCK_MATCH_FIELDS = ("module", "skill", "action")


def _quota_changes(old: Sequence[Quota], new: Sequence[Quota]) -> Iterator[PolicyChange]:
    """Compare quotas by id; fewer kinds, more actions, a shorter window or no quota allow more."""
    before, after = ({quota.id: quota for quota in quotas} for quotas in (old, new))
    for name in dict.fromkeys([*before, *after]):
        one, other = before.get(name), after.get(name)
        if one is None or other is None:
            relation = bounds_relation(other is None, one is None)
            headline = f"the quota `{name}` {'was removed' if other is None else 'is new'}"
        else:
            relation = bounds_relation(
                other.max_count > one.max_count
                or other.window_s < one.window_s
                or not one.kinds <= other.kinds,
                other.max_count < one.max_count
                or other.window_s > one.window_s
                or not other.kinds <= one.kinds,
            )
            headline = f"the quota `{name}` was {_format_quota(one)} and is {_format_quota(other)}"
        spans = (None if quota is None else quota.span for quota in (one, other))
        yield finite_change(f"policy/quotas/{name}", relation, headline, *spans)


def _isolation_changes(old: Site, new: Site) -> Iterator[PolicyChange]:
    """Compare isolation; more trust and fewer required layers allow code more besides requesting actions."""
    before, after = old.isolation, new.isolation
    places = [site.policy_spans.get("policy/isolation") for site in (old, new)]
    headline = describe_set_change(
        "modules trusted to run in the runtime's process", before.trusted_modules, after.trusted_modules
    )
    relation = sets_relation(before.trusted_modules, after.trusted_modules)
    yield finite_change("policy/isolation/trusted", relation, headline, *places)
    headline = describe_set_change(
        "required layers of isolation", before.required_layers, after.required_layers
    )
    relation = sets_relation(after.required_layers, before.required_layers)
    yield finite_change("policy/isolation/require", relation, headline, *places)
    words = ["refuse" if one.refuses_missing else "warn" for one in (before, after)]
    headline = f"the reaction to a missing isolation layer was `{words[0]}` and is `{words[1]}`"
    relation = bounds_relation(
        before.refuses_missing and not after.refuses_missing,
        after.refuses_missing and not before.refuses_missing,
    )
    yield finite_change("policy/isolation/missing", relation, headline, *places)
    shown = [format_number(one.answer_timeout_s) for one in (before, after)]
    headline = f"skill code may compute for {shown[1]} s before each action; the limit was {shown[0]} s"
    longer = after.answer_timeout_s > before.answer_timeout_s
    relation = bounds_relation(longer, after.answer_timeout_s < before.answer_timeout_s)
    yield finite_change("policy/isolation/answer_within", relation, headline, *places)
    shown = [str(one.memory >> 20) for one in (before, after)]
    headline = f"the process of a skill may have {shown[1]} MiB; the limit was {shown[0]} MiB"
    relation = bounds_relation(after.memory > before.memory, after.memory < before.memory)
    yield finite_change("policy/isolation/memory", relation, headline, *places)
    shown = [format_number(one.processor * 100) for one in (before, after)]
    headline = f"the process of a skill may use {shown[1]} % of a core; the limit was {shown[0]} %"
    relation = bounds_relation(after.processor > before.processor, after.processor < before.processor)
    yield finite_change("policy/isolation/processor", relation, headline, *places)


def _mcp_changes(old: Site, new: Site) -> Iterator[PolicyChange]:
    """Compare rights of `aeros mcp` clients; less approval, longer plans and more skills allow more."""
    before, after = old.mcp, new.mcp
    places = [site.policy_spans.get("policy/mcp") for site in (old, new)]
    headline = (
        f"the execution of MCP clients' plans was `{before.execute.value}` and is `{after.execute.value}`"
    )
    ways = [_EXECUTE_ORDER.index(one.execute) for one in (before, after)]
    yield finite_change(
        "policy/mcp/execute", bounds_relation(ways[1] > ways[0], ways[1] < ways[0]), headline, *places
    )
    headline = (
        f"plans of MCP clients may have {after.max_steps} steps at most; the limit was {before.max_steps}"
    )
    relation = bounds_relation(after.max_steps > before.max_steps, after.max_steps < before.max_steps)
    yield finite_change("policy/mcp/most_steps", relation, headline, *places)
    if before.skills is None or after.skills is None:
        relation = bounds_relation(
            before.skills != after.skills and after.skills is None,
            before.skills != after.skills and before.skills is None,
        )
        headline = f"plans of MCP clients may {'' if after.skills is None else 'not '}use every skill"
    else:
        relation = sets_relation(before.skills, after.skills)
        headline = describe_set_change(
            "skills that plans of MCP clients may use", before.skills, after.skills
        )
    yield finite_change("policy/mcp/skills", relation, headline, *places)


_EXECUTE_ORDER = (Execute.DENIED, Execute.APPROVAL, Execute.ELICITATION, Execute.ALLOWED)


def _format_quota(quota: Quota) -> str:
    kinds = ", ".join(sorted(quota.kinds))
    return f"{quota.max_count} of {kinds} within {format_number(quota.window_s)} s"
