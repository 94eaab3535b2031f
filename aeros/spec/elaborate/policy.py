"""Elaboration of a site's policy section: access, limits, overrides, quotas, isolation and MCP clients."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from fractions import Fraction

from aeros.spec.declared import ecm as declared_ecm
from aeros.spec.declared import policy as declared
from aeros.spec.declared.site import Site
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.elaborate.expressions import elaborate_quantity
from aeros.spec.elaborate.names import resolve_site_name
from aeros.spec.elaborate.quantities import elaborate_memory, elaborate_processor_share
from aeros.spec.elaborate.rules import resolve_kinds
from aeros.spec.elaborate.vocabulary import SiteVocabulary
from aeros.spec.expr.units import TIME, format_number
from aeros.spec.model.perception import SiteCamera
from aeros.spec.model.policy import (
    Access,
    Execute,
    IsolationPolicy,
    McpPolicy,
    ModuleLimits,
    OperatorOverride,
    Quota,
    WorkerLimits,
)
from aeros.spec.text.fields import TextField

_LONGEST_TIMEOUT = 3600  # s; a longer timeout would halt nothing in time


def elaborate_access(access: declared.Access) -> Access:
    """Collect the names of an access list in sets, without checking them.

    Args:
        access: declared lists of actuators, sensors, channels and computing devices.

    Returns:
        The same names as sets.
    """
    groups = (access.actuators, access.sensors, access.channels, access.compute)
    return Access(*(frozenset(name.value for name in group) for group in groups))


def check_moved_by(site: Site, vocabulary: SiteVocabulary, diagnostics: Diagnostics) -> None:
    """Check that `moved_by` names sensors of quantities, and actuators that some action kind moves.

    Args:
        site: declared site.
        vocabulary: vocabulary of the site, without faults.
        diagnostics: receives the faults.
    """
    sensors = dict.fromkeys((name.value for name, _ in site.sensors), True)
    sensors |= {one.sensor: True for one in vocabulary.state.values() if one.sensor is not None}
    actuators = {name: True for kind in vocabulary.kinds.values() for name in sorted(kind.actuators)}
    for sensor, movers in site.moved_by:
        resolve_site_name(sensor, sensors, "a sensor of any quantity", diagnostics)
        for name in movers:
            resolve_site_name(name, actuators, "an actuator of any action kind", diagnostics)


def check_access(
    access: declared.Access,
    vocabulary: SiteVocabulary,
    sensors: Iterable[str],
    cameras: Mapping[str, SiteCamera],
    devices: Mapping[str, str],
    diagnostics: Diagnostics,
) -> None:
    """Check that an access list names actuators, sensors and computing devices of the site.

    Args:
        access: declared lists of actuators, sensors, channels and computing devices.
        vocabulary: vocabulary of the site, without faults.
        sensors: sensors that only modules read.
        cameras: cameras of the site by name.
        devices: device files of its computing devices by name.
        diagnostics: receives the faults.
    """
    actuators = {name for kind in vocabulary.kinds.values() for name in kind.actuators}
    known_sensors = dict.fromkeys(sensors, True)
    known_sensors |= {one.sensor: True for one in vocabulary.state.values() if one.sensor is not None}
    known_sensors |= {camera.sensor: True for camera in cameras.values()}
    for name in access.actuators:
        known = dict.fromkeys(sorted(actuators), True)
        resolve_site_name(name, known, "an actuator of any action kind", diagnostics)
    for name in access.sensors:
        resolve_site_name(name, known_sensors, "a sensor of any state variable or camera", diagnostics)
    for name in access.compute:
        resolve_site_name(name, devices, "a device under `compute` of the site", diagnostics)


def elaborate_limits(limits: declared.ModuleLimits, diagnostics: Diagnostics) -> ModuleLimits:
    """Elaborate the limits on what modules may declare.

    Args:
        limits: declared limits.
        diagnostics: receives the faults.

    Returns:
        The limits, times in seconds.
    """
    timeout = _timeout(limits.skill_timeout, "a timeout", diagnostics)
    found = ModuleLimits(timeout or Fraction(0), limits.retries.value, limits.replans.value)
    if limits.planning is None:
        return found
    planning = _timeout(limits.planning, "the time for a plan", diagnostics)
    return found if planning is None else replace(found, planning=planning)


def _timeout(text: TextField, what: str, diagnostics: Diagnostics) -> Fraction | None:
    duration = elaborate_quantity(text, TIME, diagnostics)
    if duration is not None and not 0 < duration <= _LONGEST_TIMEOUT:
        diagnostics.error("AE129", f"{what} must be above 0 s and at most 1 h", text.span)
    return duration


def elaborate_overrides(
    blocks: Iterable[declared.OperatorOverride], vocabulary: SiteVocabulary, diagnostics: Diagnostics
) -> tuple[OperatorOverride, ...]:
    """Elaborate the operator overrides of a site.

    Args:
        blocks: declared overrides.
        vocabulary: vocabulary of the site.
        diagnostics: receives the faults.

    Returns:
        The overrides, in order.
    """
    return tuple(_override(block, vocabulary, diagnostics) for block in blocks)


def _override(
    block: declared.OperatorOverride, vocabulary: SiteVocabulary, diagnostics: Diagnostics
) -> OperatorOverride:
    if block.skill is not None and block.module is None:
        diagnostics.error("AE102", "a blocked skill needs its `module`", block.skill.span)
    if block.action is not None:
        resolve_site_name(block.action, vocabulary.kinds, "an action kind", diagnostics)
    if block.module is None and block.action is None:
        diagnostics.error(
            "AE102", "an operator override needs a `module`, a `skill` or an `action`", block.span
        )
    names = (None if name is None else name.value for name in (block.module, block.skill, block.action))
    module, skill, action = names
    return OperatorOverride(block.id.value, block.reason.value, module, skill, action, block.id.span)


def elaborate_quotas(
    quotas: Iterable[declared.Quota], vocabulary: SiteVocabulary, diagnostics: Diagnostics
) -> tuple[Quota, ...]:
    """Elaborate the quotas of a site.

    Args:
        quotas: declared quotas.
        vocabulary: vocabulary of the site.
        diagnostics: receives the faults.

    Returns:
        The quotas whose windows are times, in order.
    """
    found = (_quota(quota, vocabulary, diagnostics) for quota in quotas)
    return tuple(quota for quota in found if quota is not None)


def _quota(quota: declared.Quota, vocabulary: SiteVocabulary, diagnostics: Diagnostics) -> Quota | None:
    within = elaborate_quantity(quota.within, TIME, diagnostics)
    kinds = resolve_kinds(quota.on, vocabulary, diagnostics)
    if within is None:
        return None
    if within <= 0:
        diagnostics.error("AE608", "a quota's window must be above 0 s", quota.within.span)
    for kind in kinds:
        if kind.protective:
            diagnostics.error("AE602", "a quota must not count the protective stop", quota.span)
    return Quota(
        quota.id.value, frozenset(kind.name for kind in kinds), quota.at_most.value, within, quota.id.span
    )


def elaborate_isolation(
    isolation: declared.IsolationPolicy | None, diagnostics: Diagnostics
) -> IsolationPolicy:
    """Elaborate the isolation of module code.

    Args:
        isolation: declared isolation; None for the defaults.
        diagnostics: receives the faults.

    Returns:
        The isolation, with the default of each field that is not declared.
    """
    usual = IsolationPolicy()
    if isolation is None:
        return usual
    within: Fraction | None = usual.answer_timeout_s
    if isolation.answer_within is not None:
        within = _timeout(isolation.answer_within, "a timeout", diagnostics)
    require = isolation.require
    return IsolationPolicy(
        usual.required_layers if require is None else frozenset(layer.value for layer in require),
        isolation.missing is None or isolation.missing.value == "refuse",
        frozenset(name.value for name in isolation.trusted),
        within or usual.answer_timeout_s,
        usual.memory if isolation.memory is None else elaborate_memory(isolation.memory, diagnostics) or 0,
        usual.processor
        if isolation.processor is None
        else elaborate_processor_share(isolation.processor, Fraction(1), diagnostics) or usual.processor,
    )


def elaborate_worker_limits(
    worker: declared_ecm.WorkerLimits | None, isolation: IsolationPolicy, diagnostics: Diagnostics
) -> WorkerLimits | None:
    """Elaborate the limits of a module on the processes of its skills.

    Args:
        worker: declared limits; None for those of the site.
        isolation: limits of the site, which they may not exceed.
        diagnostics: receives the faults.

    Returns:
        The limits; None for those of the site, and after a report.
    """
    if worker is None:
        return None
    memory, within, processor = isolation.memory, isolation.answer_timeout_s, isolation.processor
    if worker.memory is not None:
        memory = elaborate_memory(worker.memory, diagnostics) or 0
        if memory > isolation.memory:
            headline = f"this site allows the process of a skill at most {isolation.memory >> 20} MiB"
            diagnostics.error("AE129", headline, worker.memory.span)
    if worker.answer_within is not None:
        asked = elaborate_quantity(worker.answer_within, TIME, diagnostics)
        within = Fraction(0) if asked is None else asked
        if asked is not None and not 0 < asked <= isolation.answer_timeout_s:
            most = format_number(isolation.answer_timeout_s)
            headline = f"skill code has above 0 s and at most {most} s before each action at this site"
            diagnostics.error("AE129", headline, worker.answer_within.span)
    if worker.processor is not None:
        share = elaborate_processor_share(worker.processor, isolation.processor, diagnostics)
        processor = share or processor
    return WorkerLimits(memory, within, processor)


def elaborate_mcp(mcp: declared.McpPolicy | None) -> McpPolicy:
    """Elaborate the permissions of clients of `aeros mcp`.

    Args:
        mcp: declared permissions; None for the defaults.

    Returns:
        The permissions, with the default of each field that is not declared.
    """
    usual = McpPolicy()
    if mcp is None:
        return usual
    return McpPolicy(
        usual.execute if mcp.execute is None else Execute(mcp.execute.value),
        usual.max_steps if mcp.most_steps is None else mcp.most_steps.value,
        usual.skills if mcp.skills is None else frozenset(name.value for name in mcp.skills),
    )


def policy_spans(site: Site) -> dict[str, SourceSpan]:
    """Locate the settings of a site's policy, for reports about them.

    Args:
        site: the declared site.

    Returns:
        Where each setting is written, by its place in the file, as in `policy/limits/retries`.
    """
    policy, limits = site.policy, site.policy.limits
    optional = {
        "policy/limits/planning": limits.planning,
        "policy/isolation": policy.isolation,
        "policy/mcp": policy.mcp,
        "policy/undeclared_outcome": policy.undeclared_outcome,
    }
    return {
        "policy/access": policy.access.key_span or policy.access.span,
        "policy/risk_ceiling": policy.risk_ceiling.span,
        "policy/limits/skill_timeout": limits.skill_timeout.span,
        "policy/limits/retries": limits.retries.span,
        "policy/limits/replans": limits.replans.span,
        **{place: setting.span for place, setting in optional.items() if setting is not None},
        **{f"resources/{name.value}": count.span for name, count in site.resources},
        **{f"modules/{name.value}": name.span for name, _ in site.modules},
        **{
            f"modules/{name.value}/{kind}/{key.value}": value.span
            for name, one in site.modules
            for kind, given in (("bind", one.bind), ("set", one.set))
            for key, value in given
        },
    }
