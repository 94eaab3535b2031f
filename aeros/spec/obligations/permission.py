"""Claims that a module stays inside what it is permitted: envelope ⊆ P ∩ Π, for every skill.

Access, risk and overrides are finite sets and settle at once; what actions an envelope holds is a
formula over all states, parameters and inputs.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from aeros.spec.diagnostics.codes import Diagnostic, Label, Severity
from aeros.spec.diagnostics.source import Span
from aeros.spec.expr import terms as t
from aeros.spec.model.model import Ecm, Risk, Site, Skill
from aeros.spec.model.step_graph import If, parts_of
from aeros.spec.obligations.claim_id import ClaimForm, ClaimId
from aeros.spec.obligations.obligation import Claim, Obligation, members_of
from aeros.spec.obligations.policy import space_of
from aeros.spec.obligations.safety import envelope_space
from aeros.spec.obligations.verdicts import Settled, Verdict


def permission_obligations(ecm: Ecm, site: Site) -> Iterator[Obligation | Settled]:
    """Every claim of group permission about `ecm` under `site`."""
    yield from _access_granted(ecm, site)
    for kind, clause in ecm.permission.items():
        yield Obligation(
            id=ClaimForm.PERMISSION_NOT_EMPTY(kind),
            code="AE409",
            claim=Claim.SOMETIMES,
            space=space_of(site, site.kinds[kind]),
            conclusion=clause.term,
            headline=f"this permission allows no `{kind}` at all",
            primary=Label(clause.span, "never true"),
            failing=Verdict.VACUOUS,
            members=members_of(clause.conjuncts, "clashes"),
        )
    for skill in ecm.skills.values():
        yield from _envelope_permitted(ecm, site, skill)
        yield from _risk_in_bounds(site, skill)
        yield _actuators_permitted(ecm, skill)
        yield _actuators_held(site, skill)
        yield _sensors_permitted(ecm, site, skill)
    for task in ecm.tasks.values():
        read = [(task.goal, ecm.span), *((rule.unless, rule.span) for rule in task.rules)]
        yield _reads_permitted(ClaimForm.TASK_SENSORS_PERMITTED(task.id), ecm, site, read)
    for composition in ecm.compositions.values():
        guards = [part for part in parts_of(composition.body) if isinstance(part, If)]
        read = [(guard.condition, guard.span) for guard in guards]
        read.append((composition.precondition, composition.precondition_span or composition.span))
        claim_id = ClaimForm.COMPOSITION_SENSORS_PERMITTED(composition.id)
        yield _reads_permitted(claim_id, ecm, site, read)
    yield from _not_blocked(ecm, site)


def _settled(claim_id: ClaimId, holds: bool, diagnostic: Diagnostic) -> Settled:
    return Settled(claim_id, None if holds else diagnostic)


def _access_granted(ecm: Ecm, site: Site) -> Iterator[Settled]:
    """`P` asks for no actuator, sensor, channel or computing device that Π does not grant the module."""
    granted = site.access_of(ecm.id)
    for group in ("actuators", "sensors", "channels", "compute"):
        excess = sorted(getattr(ecm.access, group) - getattr(granted, group))
        yield _settled(
            ClaimForm.ACCESS_GRANTED(group),
            not excess,
            Diagnostic(
                "AE404",
                f"the site does not grant `{ecm.id}` the {group} {_listed(excess)}",
                Label(ecm.access_span),
                help=(f"do without, or ask the operator to grant it under `policy.grants.{ecm.id}`",),
            ),
        )


def _envelope_permitted(ecm: Ecm, site: Site, skill: Skill) -> Iterator[Obligation | Settled]:
    """Every action kind of the envelope is permitted, and every action of it lies inside the permission."""
    for kind, clause in skill.envelope.items():
        permitted = ecm.permission.get(kind)
        moved = sorted(site.kinds[kind].actuators - skill.actuators)
        yield _settled(
            ClaimForm.ENVELOPE_ACTUATORS_DECLARED(skill.id, kind),
            not moved,
            Diagnostic(
                "AE402",
                f"`{kind}` moves {_listed(moved)}, which `{skill.id}` does not declare",
                Label(clause.span),
                help=("add it to the skill's `actuators`, or take the action out of its envelope",),
            ),
        )
        if permitted is None:
            yield Settled(
                ClaimForm.ENVELOPE_PERMITTED(skill.id, kind),
                Diagnostic(
                    "AE401",
                    f"`{skill.id}` may ask for `{kind}`, but `{ecm.id}` has no permission for it",
                    Label(clause.span),
                    help=(f"permit it under `permissions.actions.{kind}`, or take it out of the envelope",),
                ),
            )
            continue
        yield Obligation(
            id=ClaimForm.ENVELOPE_PERMITTED(skill.id, kind),
            code="AE403",
            claim=Claim.ALWAYS,
            space=envelope_space(site, skill, kind, clause),
            conclusion=permitted.term,
            headline=f"`{skill.id}` may ask for a `{kind}` beyond the permission of `{ecm.id}`",
            primary=Label(clause.span, "allows it"),
            secondary=(Label(permitted.span, "does not permit it"),),
            help=("tighten the envelope, or widen the permission if the module is to be trusted with it",),
            members=members_of(permitted.conjuncts, "does not permit it"),
            clause=clause,
        )


def _actuators_permitted(ecm: Ecm, skill: Skill) -> Settled:
    excess = sorted(skill.actuators - ecm.access.actuators)
    return _settled(
        ClaimForm.SKILL_ACTUATORS_PERMITTED(skill.id),
        not excess,
        Diagnostic(
            "AE402",
            f"`{skill.id}` moves {_listed(excess)}, which `{ecm.id}` has no permission for",
            Label(skill.span),
            help=("add it to `permissions.actuators`, or do without",),
        ),
    )


def _actuators_held(site: Site, skill: Skill) -> Settled:
    """What a skill moves and the site counts as a resource, it holds: no other skill moves it meanwhile."""
    loose = sorted((skill.actuators & site.resources.keys()) - skill.resources)
    return _settled(
        ClaimForm.SKILL_ACTUATORS_HELD(skill.id),
        not loose,
        Diagnostic(
            "AE410",
            f"`{skill.id}` moves {_listed(loose)} without holding it while it runs",
            Label(skill.span),
            help=("add it to the skill's `resources`",),
        ),
    )


def _risk_in_bounds(site: Site, skill: Skill) -> Iterator[Settled]:
    """A skill's risk is at most the ceiling and at least that of every action it may ask for."""
    ceiling = site.risk_ceiling
    yield _settled(
        ClaimForm.SKILL_RISK_UNDER_CEILING(skill.id),
        skill.risk <= ceiling,
        Diagnostic(
            "AE406",
            f"`{skill.id}` is of {_word(skill.risk)} risk; this site allows {_word(ceiling)} at most",
            Label(skill.risk_span),
        ),
    )
    riskier = sorted(kind for kind in skill.envelope if site.kinds[kind].risk > skill.risk)
    yield _settled(
        ClaimForm.SKILL_RISK_STATED(skill.id),
        not riskier,
        Diagnostic(
            "AE407",
            f"`{skill.id}` declares {_word(skill.risk)} risk, but {_listed(riskier)} carries more",
            Label(skill.risk_span),
            help=("declare the risk of the riskiest action it may ask for",),
        ),
    )


def _sensors_permitted(ecm: Ecm, site: Site, skill: Skill) -> Settled:
    conditions = [one for one in (skill.precondition, skill.hold) if one is not None]
    clauses = [*skill.envelope.values(), *conditions]
    read: list[tuple[t.Term, Span]] = [(clause.term, clause.span) for clause in clauses]
    for outcome in skill.outcomes.values():
        read += [(site.state[name].variable, skill.span) for name in outcome.effects]
    return _reads_permitted(ClaimForm.SKILL_SENSORS_PERMITTED(skill.id), ecm, site, read)


def _reads_permitted(claim_id: ClaimId, ecm: Ecm, site: Site, read: Iterable[tuple[t.Term, Span]]) -> Settled:
    """Every state variable that is read comes from a sensor the module may use."""
    for term, span in read:
        for name, variable in t.variables_of(term).items():
            sensor = site.state[name].sensor if variable.role is t.Role.STATE else None
            if sensor is not None and sensor not in ecm.access.sensors:
                diagnostic = Diagnostic(
                    "AE405",
                    f"`{name}` is measured by `{sensor}`, which `{ecm.id}` has no permission to read",
                    Label(span),
                    help=(f"add `{sensor}` to `permissions.sensors`",),
                )
                return Settled(claim_id, diagnostic)
    return Settled(claim_id, None)


def _not_blocked(ecm: Ecm, site: Site) -> Iterator[Settled]:
    """Warn of operator overrides that will deny what the module asks for; they refute nothing."""
    for block in site.blocks:
        hit = [
            f"{skill.id}/{kind}"
            for skill in ecm.skills.values()
            for kind in skill.envelope
            if block.matches(ecm.id, skill.id, kind)
        ]
        yield _settled(
            ClaimForm.NOT_BLOCKED(block.id),
            not hit,
            Diagnostic(
                "AE408",
                f"the operator override `{block.id}` blocks {_listed(hit)}: {block.reason}",
                Label(ecm.span),
                severity=Severity.WARNING,
            ),
        )


def _word(risk: Risk) -> str:
    return risk.name.lower()


def _listed(names: Iterable[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)
