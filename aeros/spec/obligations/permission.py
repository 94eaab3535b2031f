"""Claims that a module stays inside its permissions: envelope ⊆ P ∩ Π, for every skill.

Access, risk and overrides are finite sets and settle at once.  The actions of an envelope are a formula over
all states, parameters and inputs.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Final

from aeros.spec.diagnostics.codes import Diagnostic, Severity, SpanLabel
from aeros.spec.diagnostics.grammar import an
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.expr import terms as t
from aeros.spec.model.configured import module_names
from aeros.spec.model.ecm import Ecm, Skill
from aeros.spec.model.perception import Perceiver
from aeros.spec.model.rules import Risk
from aeros.spec.model.site import Site
from aeros.spec.model.step_graph import If, NestedIf, walk_parts
from aeros.spec.obligations.claim_id import ClaimForm, ClaimId
from aeros.spec.obligations.obligation import ClaimMode, Obligation, label_conjuncts
from aeros.spec.obligations.policy import action_space
from aeros.spec.obligations.safety import envelope_space, parameter_cures
from aeros.spec.obligations.verdicts import StaticClaim, Verdict
from aeros.spec.text.site_layers import is_reference_site


def permission_obligations(ecm: Ecm, site: Site) -> Iterator[Obligation | StaticClaim]:
    """Make every claim of group permission about a module.

    Args:
        ecm: the module.
        site: site whose policy applies.

    Yields:
        Claims settled at once, and obligations for the solver.
    """
    yield from _access_granted(ecm, site)
    for kind, clause in ecm.permitted_actions.items():
        yield Obligation(
            id=ClaimForm.PERMISSION_NOT_EMPTY(kind),
            code="AE409",
            mode=ClaimMode.SOMETIMES,
            space=action_space(site, site.kinds[kind]),
            conclusion=clause.term,
            headline=f"this permission allows no `{clause.kind_name or kind}` at all",
            primary=SpanLabel(clause.span, "never true"),
            failure_verdict=Verdict.VACUOUS,
            labelled_conjuncts=label_conjuncts(clause.conjuncts, "clashes"),
        )
    for skill in ecm.skills.values():
        yield from _envelope_permitted(ecm, site, skill)
        yield from _risk_in_bounds(site, skill)
        yield _actuators_permitted(ecm, skill)
        yield _actuators_reserved(ecm, site, skill)
        yield _sensors_permitted(ecm, site, skill)
    for perceiver in ecm.perceivers.values():
        yield _perceiver_sensors_permitted(ecm, site, perceiver)
    for name, one in ecm.definitions.items():
        claim = ClaimForm.DEFINITION_SENSORS_PERMITTED(name.partition(".")[2])
        yield _reads_permitted(claim, ecm, site, [(one.term, one.span)])
    for task in ecm.tasks.values():
        read = [(task.goal, ecm.span), *((rule.satisfied_condition, rule.span) for rule in task.rules)]
        read += [(invariant.term, invariant.span) for invariant in task.invariants]
        yield _reads_permitted(ClaimForm.TASK_SENSORS_PERMITTED(task.id), ecm, site, read)
    for composition in ecm.compositions.values():
        parts = walk_parts(composition.body)
        guards = [part for part in parts if isinstance(part, If) and not isinstance(part, NestedIf)]
        read = [(guard.condition, guard.span) for guard in guards]
        read.append((composition.precondition, composition.precondition_span or composition.span))
        claim_id = ClaimForm.COMPOSITION_SENSORS_PERMITTED(composition.id)
        yield _reads_permitted(claim_id, ecm, site, read)
    yield from _warn_of_blocks(ecm, site)


def _static_claim(claim_id: ClaimId, holds: bool, diagnostic: Diagnostic) -> StaticClaim:
    return StaticClaim(claim_id, None if holds else diagnostic)


def _access_granted(ecm: Ecm, site: Site) -> Iterator[StaticClaim]:
    """Claim that `P` asks only for actuators, sensors, channels and computing devices that Π grants.

    The sensors of `P` are those it lists, and those that the conditions of its permitted actions read.
    """
    missing = {group: _missing_access(ecm, site, group) for group in _ACCESS_GROUPS}
    for group, excess in missing.items():
        claim_id = ClaimForm.ACCESS_GRANTED(group)
        if excess or group != "sensors":
            yield _static_claim(claim_id, not excess, _not_granted(ecm, site, group, missing))
        else:
            read = [(clause.term, clause.span) for clause in ecm.permitted_actions.values()]
            yield _reads_permitted(claim_id, ecm, site, read)


_ACCESS_GROUPS: Final = ("actuators", "sensors", "channels", "compute")

_NEEDED_SORTS: Final = {"actuators": ("action",), "sensors": ("sensor", "variable", "camera")}
"""Sorts of needs whose names may be among the actuators or sensors of a module; the first is the example."""


def _known_names(site: Site, group: str) -> frozenset[str]:
    """Return the site's names of its actuators or sensors."""
    if group == "sensors":
        return frozenset(site.sensor_names)
    return frozenset(one for kind in site.kinds.values() for one in kind.actuators)


def _missing_access(ecm: Ecm, site: Site, group: str) -> list[str]:
    """List the site's names that a module asks for and the site does not grant it."""
    return sorted(getattr(ecm.requested_access, group) - getattr(site.access_of(ecm.id), group))


def _own_names(ecm: Ecm, group: str, names: Iterable[str]) -> tuple[str, ...]:
    """Return the manifest's names for things of the site that a module asks for."""
    return module_names(names, getattr(ecm.names, group, {}))


def _not_granted(ecm: Ecm, site: Site, group: str, missing: Mapping[str, Sequence[str]]) -> Diagnostic:
    """Describe access of a group that the site does not grant, at the first entry that needs it."""
    excess = missing[group]
    own = _own_names(ecm, group, excess)
    entries = [ecm.access_spans[name] for name in own if name in ecm.access_spans]
    asked = "" if set(own) == set(excess) else f", which it asks for as {_join_names(own)}"
    return Diagnostic(
        "AE404",
        f"the site does not grant `{ecm.id}` the {group} {_join_names(excess)}{asked}",
        SpanLabel(min(entries, default=ecm.access_span)),
        help=_access_cures(ecm, site, group, missing),
    )


def _access_cures(ecm: Ecm, site: Site, group: str, missing: Mapping[str, Sequence[str]]) -> tuple[str, ...]:
    """Propose to declare names that the site does not know as needs, and to grant or remove the others."""
    unknown = {one for sort in _NEEDED_SORTS for one in set(missing[sort]) - _known_names(site, sort)}
    cures = [
        f"this site has no `{one}`: if the module uses this name for a thing of the site, declare it under "
        f"`needs`, as in `{one}: {{is: {_NEEDED_SORTS[group][0]}}}`{_other_sorts(_NEEDED_SORTS[group][1:])}"
        for one in missing[group]
        if one in unknown
    ]
    undeclared = [one for one in missing["compute"] if one not in site.devices]
    if group == "compute":
        cures += [
            f"this site has no device `{one}`: only its file can declare one, as in "
            f"`compute: {{{one}: /dev/nvidia0}}`"
            for one in undeclared
        ]
    unknown |= set(undeclared)
    lists = {one: [name for name in names if name not in unknown] for one, names in missing.items()}
    if not lists[group]:
        return tuple(cures)
    access = ", ".join(f"{one}: [{', '.join(names)}]" for one, names in lists.items() if names)
    grant = f"{ecm.id}: {{{access}}}"
    if is_reference_site(site.span.source):
        lines = f"`schema: aeros/overlay/1` and `grants: {{{grant}}}`"
        cures.append(f"remove the entry; or, as the operator, write a file `cell.yaml` of two lines, {lines}")
        cures.append("use it with `--site cell.yaml`, and on a robot with `aeros policy cell.yaml`")
    else:
        cures.append(
            f"remove the entry; or, as the operator, write `{grant}` under `policy.grants` of the site file, "
            "or under `grants` of an overlay on it"
        )
    return tuple(cures)


def _envelope_permitted(ecm: Ecm, site: Site, skill: Skill) -> Iterator[Obligation | StaticClaim]:
    """Claim that every action kind of the envelope is permitted, and its actions lie in the permission."""
    for kind, clause in skill.envelope.items():
        permitted = ecm.permitted_actions.get(kind)
        word = clause.kind_name or kind
        moved = module_names(sorted(site.kinds[kind].actuators - skill.actuators), ecm.names.actuators)
        yield _static_claim(
            ClaimForm.ENVELOPE_ACTUATORS_DECLARED(skill.id, kind),
            not moved,
            Diagnostic(
                "AE402",
                f"`{word}` moves {_join_names(moved)}, which `{skill.id}` does not declare",
                SpanLabel(clause.span),
                help=("add it to the skill's `actuators`, or take the action out of its envelope",),
            ),
        )
        channels = sorted(site.kinds[kind].channels - ecm.requested_access.channels)
        used = module_names(channels, ecm.names.channels)
        if site.kinds[kind].channels:
            yield _static_claim(
                ClaimForm.ENVELOPE_CHANNELS_PERMITTED(skill.id, kind),
                not used,
                Diagnostic(
                    "AE411",
                    f"`{word}` uses {_join_names(used)}, which `{ecm.id}` has no permission for",
                    SpanLabel(clause.span),
                    help=("add it to `permissions.channels`, or take the action out of the envelope",),
                ),
            )
        if permitted is None:
            yield StaticClaim(
                ClaimForm.ENVELOPE_PERMITTED(skill.id, kind),
                Diagnostic(
                    "AE401",
                    f"`{skill.id}` may ask for `{word}`, but `{ecm.id}` has no permission for it",
                    SpanLabel(clause.span),
                    help=(f"permit it under `permissions.actions.{word}`, or take it out of the envelope",),
                ),
            )
            continue
        yield Obligation(
            id=ClaimForm.ENVELOPE_PERMITTED(skill.id, kind),
            code="AE403",
            mode=ClaimMode.ALWAYS,
            space=envelope_space(site, skill, kind, clause),
            conclusion=permitted.term,
            headline=f"`{skill.id}` may ask for {an(word)} beyond the permission of `{ecm.id}`",
            primary=SpanLabel(clause.span, "allows it"),
            secondary=(SpanLabel(permitted.span, "does not permit it"),),
            help=(
                *parameter_cures(ecm, clause),
                "tighten the envelope, or widen the permission if the module is to be trusted with it",
            ),
            labelled_conjuncts=label_conjuncts(permitted.conjuncts, "does not permit it"),
            clause=clause,
        )


def _actuators_permitted(ecm: Ecm, skill: Skill) -> StaticClaim:
    excess = module_names(sorted(skill.actuators - ecm.requested_access.actuators), ecm.names.actuators)
    return _static_claim(
        ClaimForm.SKILL_ACTUATORS_PERMITTED(skill.id),
        not excess,
        Diagnostic(
            "AE402",
            f"`{skill.id}` moves {_join_names(excess)}, which `{ecm.id}` has no permission for",
            SpanLabel(skill.span),
            help=(f"add {_join_names(excess)} to `permissions.actuators`, or remove it from the skill",),
        ),
    )


def _actuators_reserved(ecm: Ecm, site: Site, skill: Skill) -> StaticClaim:
    """Claim that a skill holds each actuator that it moves and that the site counts as a resource.

    Then no other skill moves it at the same time.
    """
    loose = module_names(
        sorted((skill.actuators & site.resources.keys()) - skill.resources), ecm.names.resources
    )
    return _static_claim(
        ClaimForm.SKILL_ACTUATORS_HELD(skill.id),
        not loose,
        Diagnostic(
            "AE410",
            f"`{skill.id}` moves {_join_names(loose)} without holding it as a resource",
            SpanLabel(skill.span),
            help=("add it to the skill's `resources`",),
        ),
    )


def _risk_in_bounds(site: Site, skill: Skill) -> Iterator[StaticClaim]:
    """Claim that a skill's risk is at most the ceiling and at least that of every action it may ask for."""
    ceiling = site.risk_ceiling
    yield _static_claim(
        ClaimForm.SKILL_RISK_UNDER_CEILING(skill.id),
        skill.risk <= ceiling,
        Diagnostic(
            "AE406",
            f"`{skill.id}` is of {_format_risk(skill.risk)} risk; "
            f"this site allows {_format_risk(ceiling)} at most",
            SpanLabel(skill.risk_span),
        ),
    )
    riskier = sorted(kind for kind in skill.envelope if site.kinds[kind].risk > skill.risk)
    carry = f"{_join_names(riskier)} {'carry' if riskier[1:] else 'carries'} more"
    yield _static_claim(
        ClaimForm.SKILL_RISK_STATED(skill.id),
        not riskier,
        Diagnostic(
            "AE407",
            f"`{skill.id}` declares {_format_risk(skill.risk)} risk, but {carry}",
            SpanLabel(skill.risk_span),
            help=("declare the risk of the riskiest action it may ask for",),
        ),
    )


def _sensors_permitted(ecm: Ecm, site: Site, skill: Skill) -> StaticClaim:
    conditions = [one for one in (skill.precondition, skill.hold_condition) if one is not None]
    clauses = [*skill.envelope.values(), *conditions]
    read: list[tuple[t.Term, SourceSpan]] = [(clause.term, clause.span) for clause in clauses]
    for outcome in skill.outcomes.values():
        changed = (*outcome.effects, *(one.variable for one in outcome.ranges))
        read += [(site.state[name].variable, skill.span) for name in changed]
    return _reads_permitted(ClaimForm.SKILL_SENSORS_PERMITTED(skill.id), ecm, site, read)


def _reads_permitted(
    claim_id: ClaimId, ecm: Ecm, site: Site, read: Iterable[tuple[t.Term, SourceSpan]]
) -> StaticClaim:
    """Claim that every state variable that is read comes from a sensor the module may use.

    The sensors of its perceivers and definitions are claimed apart.  It can read variables of other modules
    only if the site shares them.
    """
    for term, span in read:
        for name, variable in t.variables_of(term).items():
            is_measured = variable.role is t.VariableRole.STATE and name in site.state
            sensor = site.state[name].sensor if is_measured else None
            if sensor is not None and "." not in sensor and sensor not in ecm.requested_access.sensors:
                (own,) = module_names((sensor,), ecm.names.sensors)
                diagnostic = Diagnostic(
                    "AE405",
                    f"`{name}` is measured by `{sensor}`, which `{ecm.id}` has no permission to read",
                    SpanLabel(span),
                    help=_sensor_cures(ecm, own),
                )
                return StaticClaim(claim_id, diagnostic)
    return StaticClaim(claim_id, None)


def _sensor_cures(ecm: Ecm, own: str) -> tuple[str, ...]:
    """Propose to ask for a sensor, by a name that suits other sites if the module has such names."""
    cure = f"add `{own}` to `permissions.sensors`"
    if not ecm.names.bindings or own in ecm.names.bindings:
        return (cure,)
    return (cure, f"to suit sites with other names, declare it under `needs`, too: `{own}: {{is: sensor}}`")


def _perceiver_sensors_permitted(ecm: Ecm, site: Site, perceiver: Perceiver) -> StaticClaim:
    """Claim that a perceiver's pictures and readings come from sensors that the module may use."""
    used = [(f"pictures of `{one.camera}`", site.cameras[one.camera].sensor) for one in perceiver.pictures]
    for name in perceiver.readings:
        sensor = site.state[name].sensor
        used += [] if sensor is None or "." in sensor else [(f"`{name}`", sensor)]
    excess = next((one for one in used if one[1] not in ecm.requested_access.sensors), None)
    what, sensor = excess or ("", "")
    (own,) = module_names((sensor,), ecm.names.sensors)
    return _static_claim(
        ClaimForm.PERCEIVER_SENSORS_PERMITTED(perceiver.id),
        excess is None,
        Diagnostic(
            "AE405",
            f"`{perceiver.id}` gets {what}, which come from `{sensor}`; `{ecm.id}` may not use it",
            SpanLabel(perceiver.span),
            help=_sensor_cures(ecm, own),
        ),
    )


def _warn_of_blocks(ecm: Ecm, site: Site) -> Iterator[StaticClaim]:
    """Warn of operator overrides that will deny actions of the module; they refute nothing."""
    for block in site.blocks:
        hit = [
            f"{skill.id}/{kind}"
            for skill in ecm.skills.values()
            for kind in skill.envelope
            if block.matches(ecm.id, skill.id, kind)
        ]
        yield _static_claim(
            ClaimForm.NOT_BLOCKED(block.id),
            not hit,
            Diagnostic(
                "AE408",
                f"the operator override `{block.id}` blocks {_join_names(hit)}: {block.reason}",
                SpanLabel(ecm.span),
                severity=Severity.WARNING,
            ),
        )


def _other_sorts(sorts: Sequence[str]) -> str:
    return f", or {' or '.join(f'`is: {one}`' for one in sorts)}" if sorts else ""


def _format_risk(risk: Risk) -> str:
    return risk.name.lower()


def _join_names(names: Iterable[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)
