"""Two versions of a module under one site: what each skill may ask for and is then allowed.

For each skill and action kind the set compared is envelope and permission and Φ, and nothing where
the gate's finite layers (overrides, access, risk) deny the kind whatever its parameters are.  Quotas,
the age of measurements and attenuation are the site's and so the same on both sides.  Not compared:
tasks and compositions, which only choose among what skills may do, and skill code.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

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
from aeros.spec.model.model import ActionKind, Clause, Ecm, Site, Skill

ACCESS = ("actuators", "sensors", "channels", "compute")


@dataclass(frozen=True)
class _Asking:
    """A skill of one version of a module; either may be missing."""

    ecm: Ecm | None
    skill: Skill | None

    @property
    def kinds(self) -> tuple[str, ...]:
        return tuple(self.skill.envelope) if self.skill else ()


def module_changes(
    module: str, old: Ecm | None, new: Ecm | None, site: Site, rlimit: int
) -> Iterator[Change]:
    """Every subject of either version of `module`, and how it changed; None where there is none."""
    names = dict.fromkeys([*(old.skills if old else ()), *(new.skills if new else ())])
    for name in names:
        before, after = (_Asking(ecm, ecm.skills.get(name) if ecm else None) for ecm in (old, new))
        for kind in dict.fromkeys([*before.kinds, *after.kinds]):
            yield compare_sets(
                f"{module}/{name}/{kind}",
                f"a `{kind}` of `{name}`",
                _allowed(before, site, site.kinds[kind]),
                _allowed(after, site, site.kinds[kind]),
                rlimit,
            )
        if before.skill is not None and after.skill is not None:
            yield from _skill_changes(f"{module}/{name}", before.skill, after.skill, site, rlimit)
    if old is not None and new is not None:
        yield from _module_changes(old, new)


def _allowed(asking: _Asking, site: Site, kind: ActionKind) -> Side:
    """Every state, input and action of `kind` that the skill may ask for and the gate allows as asked."""
    ecm, skill = asking.ecm, asking.skill
    if ecm is None or skill is None:
        return Side((), (Condition(t.FALSE, None),), ecm.span if ecm else None)
    declared = (*site.observed.values(), *kind.parameters.values(), *skill.inputs.values())
    clause, permitted = skill.envelope.get(kind.name), ecm.permission.get(kind.name)
    if clause is None:
        return Side(declared, (Condition(t.FALSE, skill.span),), skill.span)
    conditions = [Condition(clause.term, clause.span)]
    if permitted is None:
        conditions.append(Condition(t.FALSE, ecm.access_span))
    else:
        conditions.append(Condition(permitted.term, permitted.span))
    if _denied_whatever_it_is(ecm, site, skill, kind):
        conditions.append(Condition(t.FALSE, skill.span))
    conditions += [Condition(rule.terms[kind.name], rule.require_span) for rule in site.rules_on(kind.name)]
    return Side(declared, tuple(conditions), clause.span)


def _denied_whatever_it_is(ecm: Ecm, site: Site, skill: Skill, kind: ActionKind) -> bool:
    """Whether overrides, access or risk deny every action of the kind, as the gate's finite layers do."""
    usable = skill.actuators & ecm.access.actuators & site.access_of(ecm.id).actuators
    blocked = any(block.matches(ecm.id, skill.id, kind.name) for block in site.blocks)
    return blocked or not kind.actuators <= usable or not kind.risk <= skill.risk <= site.risk_ceiling


def _skill_changes(subject: str, old: Skill, new: Skill, site: Site, rlimit: int) -> Iterator[Change]:
    yield compare_sets(
        f"{subject}/precondition",
        f"a start of `{new.id}`",
        _where(old, old.precondition, site),
        _where(new, new.precondition, site),
        rlimit,
    )
    if old.hold is not None or new.hold is not None:
        yield compare_sets(
            f"{subject}/hold",
            f"a state in which `{new.id}` goes on",
            _where(old, old.hold, site),
            _where(new, new.hold, site),
            rlimit,
        )
    risk = bounds_relation(new.risk > old.risk, new.risk < old.risk)
    words = (old.risk.name.lower(), new.risk.name.lower())
    yield finite(
        f"{subject}/risk",
        risk,
        f"the risk of `{new.id}` was {words[0]} and is {words[1]}",
        old.risk_span,
        new.risk_span,
    )
    yield finite(
        f"{subject}/timeout",
        bounds_relation(new.timeout > old.timeout, new.timeout < old.timeout),
        f"the time-out of `{new.id}` was {show_number(old.timeout)} s and is {show_number(new.timeout)} s",
        old.span,
        new.span,
    )
    may, may_not = "may be run twice", "may not"
    yield finite(
        f"{subject}/idempotent",
        bounds_relation(new.idempotent > old.idempotent, new.idempotent < old.idempotent),
        f"`{new.id}` {may if new.idempotent else may_not}; before it {may if old.idempotent else may_not}",
        old.span,
        new.span,
    )
    for what in ("actuators", "resources"):
        before, after = getattr(old, what), getattr(new, what)
        headline = listed_change(f"{what} of `{new.id}`", before, after)
        yield finite(f"{subject}/{what}", sets_relation(before, after), headline, old.span, new.span)
    if set(old.gated) != set(new.gated):
        headline = listed_change(f"`{new.id}` leaves invariants to the gate", set(old.gated), set(new.gated))
        spans = [next(iter(skill.gated.values()), skill.span) for skill in (old, new)]
        yield finite(f"{subject}/gated", Relation.OTHERWISE, headline, *spans)


def _where(skill: Skill, clause: Clause | None, site: Site) -> Side:
    """Where a condition of the skill's holds; everywhere if there is none."""
    declared = (*site.observed.values(), *skill.inputs.values())
    conditions = () if clause is None else (Condition(clause.term, clause.span),)
    return Side(declared, conditions, skill.span)


def _module_changes(old: Ecm, new: Ecm) -> Iterator[Change]:
    for group in ACCESS:
        before, after = getattr(old.access, group), getattr(new.access, group)
        headline = listed_change(f"{group} of `{new.id}`", before, after)
        relation = sets_relation(before, after)
        yield finite(f"{new.id}/{group}", relation, headline, old.access_span, new.access_span)
    if old.code_digest != new.code_digest:
        headline = f"the code of `{new.id}` differs: what it may ask for is compared here, not what it does"
        yield finite(f"{new.id}/code", Relation.OTHERWISE, headline)
    if old.model_digests != new.model_digests:
        changed = dict(old.model_digests.items() ^ new.model_digests.items())
        headline = f"models of `{new.id}` differ, which is not compared: {', '.join(sorted(changed))}"
        yield finite(f"{new.id}/models", Relation.OTHERWISE, headline)
