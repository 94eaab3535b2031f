"""Two versions of a site: what Φ and Π newly allow and newly deny, for each action kind.

For each action kind the set compared is the conjunction of its invariants, and nothing where an override or
the risk ceiling denies the kind to everybody; for each joint rule, the pairs it allows. Access, overrides
of single modules, limits, quotas and the age of measurements are compared one by one. Not decided here:
what an attenuation makes of an action that is denied as asked; a change of one is told as such.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction

from aeros.spec.diagnostics.source import Span
from aeros.spec.difference.module_changes import ACCESS
from aeros.spec.difference.policy_change import (
    Change,
    Relation,
    bounds_relation,
    finite,
    listed_change,
    sets_relation,
)
from aeros.spec.difference.set_comparison import Condition, Side, compare_sets
from aeros.spec.expr import terms as t
from aeros.spec.expr.units import show_number
from aeros.spec.model.model import Access, ActionKind, Block, Declared, Execute, JointRule, Quota, Site
from aeros.spec.obligations.joint import joint_variables


def site_changes(old: Site, new: Site, rlimit: int) -> Iterator[Change]:
    """Every subject of either site, and how it changed."""
    for name in dict.fromkeys([*old.kinds, *new.kinds]):
        before, after = _allowed(old, name), _allowed(new, name)
        yield compare_sets(f"actions/{name}", f"a `{name}`", before, after, rlimit)
        if name in old.kinds and name in new.kinds:
            yield from _kind_changes(old, new, old.kinds[name], new.kinds[name])
    yield from _joint_changes(old, new, rlimit)
    yield from _vocabulary_changes(old.state, new.state)
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
    yield _undeclared_change(old, new)
    yield _motion_change(old, new)


def _undeclared_change(old: Site, new: Site) -> Change:
    """Planning anew after an outcome that nothing declares lets a task go on."""
    before, after = old.stops_at_undeclared, new.stops_at_undeclared
    words = ["stop" if stops else "replan" for stops in (before, after)]
    headline = f"after an outcome that no manifest declares it was `{words[0]}`, and is `{words[1]}`"
    places = [site.policy_spans.get("policy/undeclared_outcome") for site in (old, new)]
    relation = bounds_relation(before and not after, after and not before)
    return finite("policy/undeclared_outcome", relation, headline, *places)


def _motion_change(old: Site, new: Site) -> Change:
    """Whatever changed of what motions are decided by may allow some and deny others; nothing is compared."""
    changed = old.motion != new.motion
    relation = bounds_relation(changed and old.motion is not None, changed and new.motion is not None)
    headline = "what whole motions are decided by, the section `motion` and what it names, changed"
    return finite("motion", relation, headline, old.span, new.span)


def _allowed(site: Site, name: str) -> Side:
    kind = site.kinds.get(name)
    if kind is None:
        return Side((), (Condition(t.FALSE, None),), site.span)
    conditions = [Condition(rule.terms[name], rule.require_span) for rule in site.rules_on(name)]
    everywhere = (
        block.module is None and block.skill is None and block.action == name for block in site.blocks
    )
    if any(everywhere) or kind.risk > site.risk_ceiling:
        conditions.append(Condition(t.FALSE, kind.span))
    return Side((*site.observed.values(), *kind.parameters.values()), tuple(conditions), kind.span)


def _kind_changes(old: Site, new: Site, before: ActionKind, after: ActionKind) -> Iterator[Change]:
    subject, places = f"actions/{after.name}", (before.span, after.span)
    risk = bounds_relation(after.risk < before.risk, after.risk > before.risk)
    words = [kind.risk.name.lower() for kind in (before, after)]
    yield finite(
        f"{subject}/risk", risk, f"the risk of `{after.name}` was {words[0]} and is {words[1]}", *places
    )
    moved = sets_relation(after.actuators, before.actuators)  # fewer to be permitted allows more
    headline = listed_change(f"actuators that `{after.name}` moves", before.actuators, after.actuators)
    yield finite(f"{subject}/actuators", moved, headline, *places)
    reduced = [
        {
            rule.id: rule.attenuations[after.name]
            for rule in site.rules_on(after.name)
            if after.name in rule.attenuations
        }
        for site in (old, new)
    ]
    if reduced[0] != reduced[1] or before.protective != after.protective:
        headline = f"what the gate makes of a `{after.name}` that it does not allow as asked differs"
        yield finite(f"{subject}/attenuation", Relation.OTHERWISE, headline, *places)


def _joint_changes(old: Site, new: Site, rlimit: int) -> Iterator[Change]:
    """Rules about two actions at the same time: which pairs each of them allows."""
    before, after = ({rule.id: rule for rule in site.joint} for site in (old, new))
    for name in dict.fromkeys([*before, *after]):
        one, other = _pairs(old, before.get(name)), _pairs(new, after.get(name))
        one = replace(one, declared=one.declared or other.declared)
        other = replace(other, declared=other.declared or one.declared)
        yield compare_sets(f"joint/{name}", f"a pair of actions under `{name}`", one, other, rlimit)


def _pairs(site: Site, rule: JointRule | None) -> Side:
    """Every pair that the rule allows; without one, all."""
    if rule is None:
        return Side((), (), site.span)
    return Side(joint_variables(site, rule), (Condition(rule.term, rule.require_span),), rule.require_span)


def _vocabulary_changes(old: Mapping[str, Declared], new: Mapping[str, Declared]) -> Iterator[Change]:
    for name in dict.fromkeys([*old, *new]):
        before, after, subject = old.get(name), new.get(name), f"state/{name}"
        if before is None or after is None:
            headline = f"`{name}` is {'measured now' if before is None else 'no longer measured'}"
            spans = (None if one is None else one.span for one in (before, after))
            yield finite(subject, Relation.OTHERWISE, headline, *spans)
            continue
        ages = [one.max_age or Fraction(0) for one in (before, after)]
        headline = f"`{name}` may be {show_number(ages[1])} s old, and was {show_number(ages[0])} s"
        age = bounds_relation(ages[1] > ages[0], ages[1] < ages[0])
        yield finite(f"{subject}/max_age", age, headline, before.span, after.span)
        if before.sensor != after.sensor:
            headline = f"`{name}` was measured by `{before.sensor}` and is by `{after.sensor}`"
            yield finite(f"{subject}/sensor", Relation.OTHERWISE, headline, before.span, after.span)


def _access_changes(
    subject: str, who: str, old: Access, new: Access, places: tuple[Span | None, Span | None]
) -> Iterator[Change]:
    for group in ACCESS:
        before, after = getattr(old, group), getattr(new, group)
        headline = listed_change(f"{group} granted to {who}", before, after)
        yield finite(f"{subject}/{group}", sets_relation(before, after), headline, *places)


def _number_changes(old: Site, new: Site) -> Iterator[Change]:
    """The risk ceiling, limits and capacities: of all of these more allows more."""
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
        shown = [show_number(Fraction(value)) for value in (before, after)]
        headline = f"`{subject.replace('/', '.')}` was {shown[0]} and is {shown[1]}"
        yield finite(subject, relation, headline, *(one.policy_spans.get(subject) for one in (old, new)))


def _block_changes(old: Sequence[Block], new: Sequence[Block]) -> Iterator[Change]:
    """Overrides by what they match: one more denies more."""
    before, after = ({(one.module, one.skill, one.action): one for one in blocks} for blocks in (old, new))
    for matched in dict.fromkeys([*before, *after]):
        block = before.get(matched) or after[matched]
        relation = bounds_relation(matched not in after, matched not in before)
        verb = "no longer blocks" if matched not in after else "now blocks"
        named = ", ".join(f"{what} `{name}`" for what, name in zip(_MATCHED, matched, strict=True) if name)
        spans = (None if one is None else one.span for one in (before.get(matched), after.get(matched)))
        yield finite(f"policy/blocks/{block.id}", relation, f"the operator {verb} {named}", *spans)


_MATCHED = ("module", "skill", "action")


def _quota_changes(old: Sequence[Quota], new: Sequence[Quota]) -> Iterator[Change]:
    """Quotas by id: fewer kinds, more actions, a shorter window or no quota at all allow more."""
    before, after = ({quota.id: quota for quota in quotas} for quotas in (old, new))
    for name in dict.fromkeys([*before, *after]):
        one, other = before.get(name), after.get(name)
        if one is None or other is None:
            relation = bounds_relation(other is None, one is None)
            headline = f"the quota `{name}` {'is gone' if other is None else 'is new'}"
        else:
            relation = bounds_relation(
                other.at_most > one.at_most or other.within < one.within or not one.kinds <= other.kinds,
                other.at_most < one.at_most or other.within > one.within or not other.kinds <= one.kinds,
            )
            headline = f"the quota `{name}` was {_shown(one)} and is {_shown(other)}"
        spans = (None if quota is None else quota.span for quota in (one, other))
        yield finite(f"policy/quotas/{name}", relation, headline, *spans)


def _isolation_changes(old: Site, new: Site) -> Iterator[Change]:
    """More trust and fewer required layers allow more of what code does beside asking."""
    before, after = old.isolation, new.isolation
    places = [site.policy_spans.get("policy/isolation") for site in (old, new)]
    headline = listed_change("modules trusted to run in the runtime's process", before.trusted, after.trusted)
    relation = sets_relation(before.trusted, after.trusted)
    yield finite("policy/isolation/trusted", relation, headline, *places)
    headline = listed_change("required layers of isolation", before.require, after.require)
    relation = sets_relation(after.require, before.require)
    yield finite("policy/isolation/require", relation, headline, *places)
    words = ["refuse" if one.refuses else "warn" for one in (before, after)]
    headline = f"where a layer of isolation is missing, the answer was `{words[0]}` and is `{words[1]}`"
    relation = bounds_relation(before.refuses and not after.refuses, after.refuses and not before.refuses)
    yield finite("policy/isolation/missing", relation, headline, *places)
    shown = [show_number(one.answer_within) for one in (before, after)]
    headline = f"skill code may compute for {shown[1]} s before each action, and {shown[0]} s before"
    longer = after.answer_within > before.answer_within
    relation = bounds_relation(longer, after.answer_within < before.answer_within)
    yield finite("policy/isolation/answer_within", relation, headline, *places)


def _mcp_changes(old: Site, new: Site) -> Iterator[Change]:
    """Less of the operator's approval, longer plans and more skills allow clients of `aeros mcp` more."""
    before, after = old.mcp, new.mcp
    places = [site.policy_spans.get("policy/mcp") for site in (old, new)]
    headline = f"plans of MCP clients were `{before.execute.value}` and are `{after.execute.value}`"
    ways = [_FREEDOM.index(one.execute) for one in (before, after)]
    yield finite(
        "policy/mcp/execute", bounds_relation(ways[1] > ways[0], ways[1] < ways[0]), headline, *places
    )
    headline = f"plans of MCP clients had {before.most_steps} steps at most and have {after.most_steps}"
    relation = bounds_relation(after.most_steps > before.most_steps, after.most_steps < before.most_steps)
    yield finite("policy/mcp/most_steps", relation, headline, *places)
    if before.skills is None or after.skills is None:
        relation = bounds_relation(
            before.skills != after.skills and after.skills is None,
            before.skills != after.skills and before.skills is None,
        )
        headline = f"plans of MCP clients may {'' if after.skills is None else 'not '}have every skill"
    else:
        relation = sets_relation(before.skills, after.skills)
        headline = listed_change("skills that plans of MCP clients may have", before.skills, after.skills)
    yield finite("policy/mcp/skills", relation, headline, *places)


_FREEDOM = (Execute.DENIED, Execute.APPROVAL, Execute.ALLOWED)


def _shown(quota: Quota) -> str:
    kinds = ", ".join(sorted(quota.kinds))
    return f"{quota.at_most} of {kinds} within {show_number(quota.within)} s"
