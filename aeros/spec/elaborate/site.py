"""Elaboration of a declared site to the resolved model: names, units and types, with every fault reported."""

from __future__ import annotations

from aeros.spec.declared import site as declared
from aeros.spec.declared.configuration import ModuleSettings
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.motion import check_tracking_rules, elaborate_motion
from aeros.spec.elaborate.perception import (
    elaborate_cameras,
    elaborate_perception_policy,
    elaborate_shared_variables,
)
from aeros.spec.elaborate.policy import (
    check_access,
    check_moved_by,
    elaborate_access,
    elaborate_isolation,
    elaborate_limits,
    elaborate_mcp,
    elaborate_overrides,
    elaborate_quotas,
    policy_spans,
)
from aeros.spec.elaborate.rules import ElaboratedRules, check_unique_ids, elaborate_rules
from aeros.spec.elaborate.sensor_errors import elaborate_area_scanners, elaborate_sensor_errors
from aeros.spec.elaborate.task_parameters import elaborate_objects
from aeros.spec.elaborate.tools import check_rules_read_no_answers
from aeros.spec.elaborate.vocabulary import (
    check_protective_stop,
    elaborate_site_definitions,
    elaborate_vocabulary,
)
from aeros.spec.model.configured import ModuleConfiguration
from aeros.spec.model.policy import Durability
from aeros.spec.model.rules import Risk
from aeros.spec.model.sensor_errors import SensorErrors
from aeros.spec.model.site import Site
from aeros.spec.text.fields import TextField


def elaborate_site(site: declared.Site, digest: str, diagnostics: Diagnostics) -> Site | None:
    """Elaborate a declared site.

    Args:
        site: the declared site.
        digest: SHA-256 of the site file, in hexadecimal.
        diagnostics: receives the faults.

    Returns:
        The model of the site, or None after reporting every fault.
    """
    before = len(diagnostics)
    vocabulary = elaborate_vocabulary(site, diagnostics)
    # What refers to the vocabulary, and then to definitions, is elaborated only if all of that is right: a
    # faulty name is not an undeclared one.
    is_whole = len(diagnostics) == before
    check_protective_stop(site, vocabulary, diagnostics)
    check_unique_ids(site, diagnostics)
    rules, policy, motion = ElaboratedRules(), site.policy, None
    shared, cameras, sensor_errors, scanners = {}, {}, SensorErrors(), None
    devices = _devices(site, diagnostics)
    objects = elaborate_objects(site, diagnostics)
    if is_whole:
        faults = len(diagnostics)
        shared = elaborate_shared_variables(policy.perception, vocabulary, diagnostics)
        if len(diagnostics) == faults:
            elaborate_site_definitions(site, vocabulary, shared, diagnostics)
        cameras = elaborate_cameras(site, vocabulary, diagnostics)
        sensor_errors = elaborate_sensor_errors(site, vocabulary, diagnostics)
        scanners = elaborate_area_scanners(site, vocabulary, diagnostics)
        is_whole = len(vocabulary.definitions) == len(site.definitions.items)
    if is_whole:
        rules = elaborate_rules(site, vocabulary, diagnostics)
        tools = {name: kind.tool for name, kind in vocabulary.kinds.items() if kind.tool is not None}
        check_rules_read_no_answers(tools, rules.rules, rules.joint_rules, rules.histories, diagnostics)
        for access in (policy.access, *(access for _, access in policy.grants)):
            sensors = [name.value for name, _ in site.sensors]
            check_access(access, vocabulary, sensors, cameras, devices, diagnostics)
        check_moved_by(site, vocabulary, diagnostics)
    limits = elaborate_limits(policy.limits, diagnostics)
    blocks = elaborate_overrides(policy.blocks, vocabulary, diagnostics)
    quotas = elaborate_quotas(policy.quotas, vocabulary, diagnostics)
    if is_whole and site.motion is not None:
        motion = elaborate_motion(site.motion, vocabulary, diagnostics)
        check_tracking_rules(site.motion, motion, rules.rules, diagnostics)
    isolation = elaborate_isolation(policy.isolation, diagnostics)
    perception = elaborate_perception_policy(policy.perception, shared, diagnostics)
    if len(diagnostics) > before:
        return None
    undeclared = policy.undeclared_outcome
    return Site(
        id=site.id.value,
        digest=digest,
        enums=vocabulary.enums,
        constants=vocabulary.constants,
        volumes=vocabulary.volumes,
        definitions=vocabulary.definitions,
        state={**vocabulary.state, **shared},
        kinds=vocabulary.kinds,
        rules=rules.rules,
        access=elaborate_access(policy.access),
        grants={name.value: elaborate_access(access) for name, access in policy.grants},
        risk_ceiling=Risk[policy.risk_ceiling.value.upper()],
        limits=limits,
        blocks=blocks,
        quotas=quotas,
        resources={name.value: count.value for name, count in site.resources},
        span=site.span,
        joint_rules=rules.joint_rules,
        grant_spans={name.value: name.span for name, _ in policy.grants},
        histories=rules.histories,
        policy_spans=policy_spans(site),
        motion=motion,
        durability=Durability(policy.audit.durability.value if policy.audit else "every-record"),
        isolation=isolation,
        mcp=elaborate_mcp(policy.mcp),
        stops_on_undeclared_outcome=undeclared is None or undeclared.value == "stop",
        cameras=cameras,
        perception=perception,
        offers=_offers(site),
        configurations={name.value: _configuration(one) for name, one in site.modules},
        devices=devices,
        objects=objects,
        sensors={
            name.value: one.value if isinstance(one, TextField) else one.description.value
            for name, one in site.sensors
        },
        sensor_errors=sensor_errors,
        area_scanners=scanners,
        robot=None if site.robot is None else site.robot.value,
        standing_postures={
            name.value: tuple(one.value for one in posture) for name, posture in site.standing_postures
        },
        moved_by={name.value: frozenset(one.value for one in actuators) for name, actuators in site.moved_by},
    )


def _devices(site: declared.Site, diagnostics: Diagnostics) -> dict[str, str]:
    """Collect the device file of each computing device; report one that is no absolute path in `/dev`."""
    for name, path in site.compute:
        if not path.value.startswith("/dev/") or ".." in path.value:
            headline = (
                f"`{path.value}` is not a device file, so no computer could show that it has `{name.value}`"
            )
            diagnostics.error("AE112", headline, path.span, help=("as in `gpu: /dev/nvidia0`",))
    return {name.value: path.value for name, path in site.compute}


def _offers(site: declared.Site) -> dict[str, frozenset[str]]:
    """Collect the uses that modules may make of things of the site, by name."""
    sensors = ((name, one) for name, one in site.sensors if isinstance(one, declared.ModuleSensor))
    things = (*site.volumes, *site.state, *site.constants, *site.cameras, *sensors)
    offers: dict[str, frozenset[str]] = {}
    for name, thing in things:  # a sensor may have the name of a volume or variable
        if thing.offers:
            words = frozenset(one.value for one in thing.offers)
            offers[name.value] = offers.get(name.value, frozenset()) | words
    return offers


def _configuration(settings: ModuleSettings) -> ModuleConfiguration:
    return ModuleConfiguration(
        {name.value: bound.value for name, bound in settings.bind},
        {name.value: expression.value for name, expression in settings.set},
    )
