"""Comparison of two versions of a module under one site, by the actions that each skill is allowed.

For each skill and action kind the compared set is envelope ∧ permission ∧ Φ. It is empty if the gate's finite
layers (overrides, access, risk) deny the kind whatever its parameters are. Quotas, the age of measurements
and attenuation belong to the site and so are the same on both sides. A permission is compared by itself, too:
it is what the module asks for.  What is not compared by what it allows is compared as it is written
(`other_changes`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction

from aeros.spec.backends.oracle import Oracle
from aeros.spec.diagnostics.grammar import an
from aeros.spec.difference.perception_changes import perceiver_changes
from aeros.spec.difference.policy_change import (
    PolicyChange,
    Relation,
    bounds_relation,
    describe_set_change,
    finite_change,
    sets_relation,
)
from aeros.spec.difference.set_comparison import ComparedSet, SetCondition, compare_sets
from aeros.spec.expr import terms as t
from aeros.spec.expr.units import format_number
from aeros.spec.model.ecm import ActionCondition, Ecm, Skill
from aeros.spec.model.policy import IsolationPolicy
from aeros.spec.model.rules import ActionKind
from aeros.spec.model.site import Site

ACCESS = ("actuators", "sensors", "channels", "compute")


@dataclass(frozen=True)
class _SkillVersion:
    """A skill of one version of a module; either may be missing."""

    ecm: Ecm | None
    skill: Skill | None

    @property
    def kinds(self) -> tuple[str, ...]:
        return tuple(self.skill.envelope) if self.skill else ()


def module_changes(
    module: str, old: Ecm | None, new: Ecm | None, site: Site, oracle: Oracle
) -> Iterator[PolicyChange]:
    """Compare two versions of a module.

    Args:
        module: id of the module.
        old: old version; None if there is none.
        new: new version; None if there is none.
        site: site under which they are compared.
        oracle: answers the questions.

    Yields:
        The change of each subject of either version.
    """
    sites = [site.with_modules(one.with_owners if one else ()) for one in (old, new)]
    names = dict.fromkeys([*(old.skills if old else ()), *(new.skills if new else ())])
    for name in names:
        before, after = (_SkillVersion(ecm, ecm.skills.get(name) if ecm else None) for ecm in (old, new))
        for kind in dict.fromkeys([*before.kinds, *after.kinds]):
            yield compare_sets(
                f"{module}/{name}/{kind}",
                f"{an(kind)} of `{name}`",
                _allowed(before, sites[0], site.kinds[kind]),
                _allowed(after, sites[1], site.kinds[kind]),
                oracle,
            )
        if before.skill is not None and after.skill is not None:
            yield from _skill_changes(f"{module}/{name}", before.skill, after.skill, sites, oracle)
    if old is not None and new is not None:
        yield from _module_changes(old, new)
        yield from _permission_changes(old, new, sites, oracle)
        yield from _worker_changes(old, new, site.isolation)


def _permission_changes(old: Ecm, new: Ecm, sites: Sequence[Site], oracle: Oracle) -> Iterator[PolicyChange]:
    """Compare the widest sets of actions that the skills of a module may ask for."""
    for name in dict.fromkeys([*old.permitted_actions, *new.permitted_actions]):
        before, after = (
            _permitted(ecm, under, under.kinds[name]) for ecm, under in zip((old, new), sites, strict=True)
        )
        what = f"a permission of `{new.id}` for `{name}`"
        yield compare_sets(f"{new.id}/permissions/{name}", what, before, after, oracle)


def _permitted(ecm: Ecm, site: Site, kind: ActionKind) -> ComparedSet:
    clause = ecm.permitted_actions.get(kind.name)
    declared = (*site.observed_variables.values(), *kind.parameters.values())
    condition = SetCondition(t.FALSE, ecm.access_span)
    if clause is not None:
        condition = SetCondition(clause.term, clause.span)
    return ComparedSet(declared, (condition,), condition.span)


def _worker_changes(old: Ecm, new: Ecm, isolation: IsolationPolicy) -> Iterator[PolicyChange]:
    """Compare the limits on the processes of skills; without any, those of the site hold."""
    memory = [isolation.memory if one.worker is None else one.worker.memory for one in (old, new)]
    within = [
        isolation.answer_timeout_s if one.worker is None else one.worker.answer_within for one in (old, new)
    ]
    headline = (
        f"the process of each skill of `{new.id}` may have {_mebibytes(memory[1])}, "
        f"before {_mebibytes(memory[0])}"
    )
    relation = bounds_relation(memory[1] > memory[0], memory[1] < memory[0])
    places = (old.access_span, new.access_span)
    yield finite_change(f"{new.id}/worker/memory", relation, headline, *places)
    headline = (
        f"skills of `{new.id}` may compute for {format_number(within[1])} s before each action, "
        f"before {format_number(within[0])} s"
    )
    relation = bounds_relation(within[1] > within[0], within[1] < within[0])
    yield finite_change(f"{new.id}/worker/answer_within", relation, headline, *places)
    share = [isolation.processor if one.worker is None else one.worker.processor for one in (old, new)]
    shown = [f"{format_number(one * 100)} %" for one in share]
    headline = f"the process of each skill of `{new.id}` may use {shown[1]} of a core, before {shown[0]}"
    relation = bounds_relation(share[1] > share[0], share[1] < share[0])
    yield finite_change(f"{new.id}/worker/processor", relation, headline, *places)


def _mebibytes(size: int) -> str:
    return f"{format_number(Fraction(size, 2**20))} MiB"


def _allowed(asking: _SkillVersion, site: Site, kind: ActionKind) -> ComparedSet:
    """Return the set of states, inputs and actions of `kind` that the skill may request and is allowed."""
    ecm, skill = asking.ecm, asking.skill
    if ecm is None or skill is None:
        return ComparedSet((), (SetCondition(t.FALSE, None),), ecm.span if ecm else None)
    declared = (*site.observed_variables.values(), *kind.parameters.values(), *skill.inputs.values())
    clause, permitted = skill.envelope.get(kind.name), ecm.permitted_actions.get(kind.name)
    if clause is None:
        return ComparedSet(declared, (SetCondition(t.FALSE, skill.span),), skill.span)
    conditions = [SetCondition(clause.term, clause.span)]
    if permitted is None:
        conditions.append(SetCondition(t.FALSE, ecm.access_span))
    else:
        conditions.append(SetCondition(permitted.term, permitted.span))
    if _is_denied_by_finite_layers(ecm, site, skill, kind):
        conditions.append(SetCondition(t.FALSE, skill.span))
    conditions += [
        SetCondition(rule.terms[kind.name], rule.require_span) for rule in site.rules_for_kind(kind.name)
    ]
    return ComparedSet(declared, tuple(conditions), clause.span)


def _is_denied_by_finite_layers(ecm: Ecm, site: Site, skill: Skill, kind: ActionKind) -> bool:
    """Return True if overrides, access or risk deny every action of the kind, as at the gate."""
    granted = site.access_of(ecm.id)
    usable = skill.actuators & ecm.requested_access.actuators & granted.actuators
    reachable = ecm.requested_access.channels & granted.channels
    blocked = any(block.matches(ecm.id, skill.id, kind.name) for block in site.blocks)
    accessible = kind.actuators <= usable and kind.channels <= reachable
    return blocked or not accessible or not kind.risk <= skill.risk <= site.risk_ceiling


def _skill_changes(
    subject: str, old: Skill, new: Skill, sites: Sequence[Site], oracle: Oracle
) -> Iterator[PolicyChange]:
    yield compare_sets(
        f"{subject}/precondition",
        f"a start of `{new.id}`",
        _condition_location(old, old.precondition, sites[0]),
        _condition_location(new, new.precondition, sites[1]),
        oracle,
    )
    if old.hold_condition is not None or new.hold_condition is not None:
        yield compare_sets(
            f"{subject}/hold",
            f"a state in which `{new.id}` goes on",
            _condition_location(old, old.hold_condition, sites[0]),
            _condition_location(new, new.hold_condition, sites[1]),
            oracle,
        )
    risk = bounds_relation(new.risk > old.risk, new.risk < old.risk)
    words = (old.risk.name.lower(), new.risk.name.lower())
    yield finite_change(
        f"{subject}/risk",
        risk,
        f"the risk of `{new.id}` was {words[0]} and is {words[1]}",
        old.risk_span,
        new.risk_span,
    )
    yield finite_change(
        f"{subject}/timeout",
        bounds_relation(new.timeout > old.timeout, new.timeout < old.timeout),
        f"the timeout of `{new.id}` was {format_number(old.timeout)} s and is {format_number(new.timeout)} s",
        old.span,
        new.span,
    )
    may, may_not = "may be run twice", "may not"
    yield finite_change(
        f"{subject}/idempotent",
        bounds_relation(new.idempotent > old.idempotent, new.idempotent < old.idempotent),
        f"`{new.id}` {may if new.idempotent else may_not}; before it {may if old.idempotent else may_not}",
        old.span,
        new.span,
    )
    for what in ("actuators", "resources"):
        before, after = getattr(old, what), getattr(new, what)
        headline = describe_set_change(f"{what} of `{new.id}`", before, after)
        yield finite_change(f"{subject}/{what}", sets_relation(before, after), headline, old.span, new.span)
    if set(old.runtime_checked) != set(new.runtime_checked):
        headline = describe_set_change(
            f"`{new.id}` leaves rules to the run-time check",
            set(old.runtime_checked),
            set(new.runtime_checked),
        )
        spans = [next(iter(skill.runtime_checked.values()), skill.span) for skill in (old, new)]
        yield finite_change(f"{subject}/gated", Relation.CHANGED_OTHERWISE, headline, *spans)


def _condition_location(skill: Skill, clause: ActionCondition | None, site: Site) -> ComparedSet:
    """Return the set in which a condition of the skill holds; without a condition, everything."""
    declared = (*site.observed_variables.values(), *skill.inputs.values())
    conditions = () if clause is None else (SetCondition(clause.term, clause.span),)
    return ComparedSet(declared, conditions, skill.span)


def _module_changes(old: Ecm, new: Ecm) -> Iterator[PolicyChange]:
    for group in ACCESS:
        before, after = getattr(old.requested_access, group), getattr(new.requested_access, group)
        headline = describe_set_change(f"{group} of `{new.id}`", before, after)
        relation = sets_relation(before, after)
        yield finite_change(f"{new.id}/{group}", relation, headline, old.access_span, new.access_span)
    yield from perceiver_changes(old, new)
    if old.code_digest != new.code_digest:
        headline = f"the code of `{new.id}` differs; only the actions that it may ask for are compared"
        yield finite_change(f"{new.id}/code", Relation.CHANGED_OTHERWISE, headline)
    if old.model_digests != new.model_digests:
        changed = dict(old.model_digests.items() ^ new.model_digests.items())
        headline = (
            f"models of `{new.id}` differ, and their contents are not compared: {', '.join(sorted(changed))}"
        )
        yield finite_change(f"{new.id}/models", Relation.CHANGED_OTHERWISE, headline)
