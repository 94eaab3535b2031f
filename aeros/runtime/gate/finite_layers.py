"""The gate's layers that need no formula: overrides, lifecycle, access, risk and quotas."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import Caller, Reason
from aeros.spec.model.ecm import Ecm, Skill
from aeros.spec.model.policy import Quota
from aeros.spec.model.rules import ActionKind
from aeros.spec.model.site import Site


def finite_objections(
    configuration: Configuration, caller: Caller, kind: str, usage: Mapping[str, int]
) -> Iterator[Reason]:
    """List these layers' objections to actions of one kind; they depend on neither parameters nor state.

    Args:
        configuration: the configuration in force.
        caller: the skill that asks.
        kind: the action kind it asks for.
        usage: number of actions that each quota counts in its window now, by quota id.

    Yields:
        Each objection.
    """
    site = configuration.site
    declared = site.kinds.get(kind)
    if declared is None:
        yield Reason("AE702", kind, f"`{kind}` is not an action kind of this site")
    for block in site.blocks:
        if block.matches(caller.module, caller.skill, kind):
            yield Reason("AE710", block.id, f"the operator blocks it: {block.reason}")
    ecm = configuration.modules.get(caller.module)
    skill = None if ecm is None else ecm.skills.get(caller.skill)
    if ecm is None:
        yield Reason("AE720", caller.module, f"`{caller.module}` is not an active module")
    elif skill is None:
        yield Reason("AE720", caller.skill, f"`{caller.module}` has no skill `{caller.skill}`")
    elif declared is not None:
        yield from _access_objections(site, ecm, skill, declared)
        yield from _risk_objections(site, skill, declared)
    yield from _malformed_usage_objections(site, usage)
    for quota in site.quotas:
        if kind in quota.kinds:
            yield from _quota_objections(quota, usage)


def _access_objections(site: Site, ecm: Ecm, skill: Skill, kind: ActionKind) -> Iterator[Reason]:
    granted = site.access_of(ecm.id)
    usable = skill.actuators & ecm.requested_access.actuators & granted.actuators
    for actuator in sorted(kind.actuators - usable):
        yield Reason("AE740", actuator, f"`{skill.id}` may not move `{actuator}`")
    for channel in sorted(kind.channels - (ecm.requested_access.channels & granted.channels)):
        yield Reason("AE740", channel, f"`{ecm.id}` may not use the channel `{channel}`")


def _risk_objections(site: Site, skill: Skill, kind: ActionKind) -> Iterator[Reason]:
    if kind.risk > skill.risk:
        yield Reason("AE741", skill.id, f"`{kind.name}` carries more risk than `{skill.id}` declares")
    if skill.risk > site.risk_ceiling:
        yield Reason("AE741", skill.id, f"`{skill.id}` carries more risk than the site allows")


def _malformed_usage_objections(site: Site, usage: Mapping[str, int]) -> Iterator[Reason]:
    """Check every count in `usage`, even if no quota governs the action."""
    known = {quota.id for quota in site.quotas}
    for name, used in usage.items():
        if name not in known:
            yield Reason("AE702", name, f"`{name}` is not a quota of this site")
        elif not _is_count(used):
            yield Reason("AE704", name, f"the use of `{name}` is not a whole number of at least 0")


def _is_count(used: object) -> bool:
    return type(used) is int and used >= 0


def _quota_objections(quota: Quota, usage: Mapping[str, int]) -> Iterator[Reason]:
    used = usage.get(quota.id)
    if used is None:
        yield Reason("AE703", quota.id, f"the use of the quota `{quota.id}` is unknown")
    elif _is_count(used) and used >= quota.max_count:
        yield Reason("AE742", quota.id, f"the quota `{quota.id}` of {quota.max_count} is used up")
