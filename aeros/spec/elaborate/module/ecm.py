"""Elaboration of a declared module under a site to the resolved model, with every fault reported."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Final

from packaging.licenses import InvalidLicenseExpression, canonicalize_license_expression

from aeros.spec.declared import ecm as declared
from aeros.spec.diagnostics.codes import Diagnostics, quoted
from aeros.spec.elaborate.module.action_conditions import elaborate_action_conditions
from aeros.spec.elaborate.module.callables import CallableNames, alternative_name, capability_names
from aeros.spec.elaborate.module.composed_tasks import composed_tasks
from aeros.spec.elaborate.module.composition import elaborate_compositions, elaborate_sequence
from aeros.spec.elaborate.module.interfaces import elaborate_interfaces
from aeros.spec.elaborate.module.models import elaborate_models
from aeros.spec.elaborate.module.needs import ModuleNeeds
from aeros.spec.elaborate.module.skills import elaborate_skill
from aeros.spec.elaborate.module.tasks import elaborate_tasks
from aeros.spec.elaborate.module.things import elaborate_things
from aeros.spec.elaborate.names import resolve_name
from aeros.spec.elaborate.perception import ModulePerception
from aeros.spec.elaborate.policy import elaborate_access, elaborate_worker_limits
from aeros.spec.model.configured import BoundNames, site_names
from aeros.spec.model.ecm import Ecm, ForeignNames
from aeros.spec.model.policy import Access
from aeros.spec.model.site import Site
from aeros.spec.text.digests import MAX_MODELS, model_digest
from aeros.spec.text.fields import TextField
from aeros.spec.text.versions import parse_range, parse_version

_MAX_LICENSE: Final = 256  # characters
_NO_FOREIGN_NAMES: Final = ForeignNames()


def elaborate_ecm(
    ecm: declared.Ecm,
    site: Site,
    folder: str,
    digests: tuple[str, str],
    diagnostics: Diagnostics,
    foreign: ForeignNames = _NO_FOREIGN_NAMES,
) -> Ecm | None:
    """Elaborate a declared module under a site.

    Reads the files that its models name, to take their digests.

    Args:
        ecm: the declared module.
        site: site that gives names, units and limits their meaning.
        folder: path of the module's folder.
        digests: SHA-256 in hexadecimal of the manifest and of the code.
        diagnostics: receives the faults.
        foreign: skills and capabilities of other modules that its steps may name.

    Returns:
        The model of the module, or None after reporting every fault.
    """
    before = len(diagnostics)
    _check_metadata(ecm, diagnostics)
    unbound = len(diagnostics)
    needs = ModuleNeeds(ecm, site, diagnostics)
    if len(diagnostics) > unbound:
        return None  # a name that is not bound would be reported at each of its uses
    bound = needs.names
    models = elaborate_models(ecm.models, diagnostics)
    perception = ModulePerception(ecm, needs.site, bound, diagnostics, foreign.public_variables, models)
    site = perception.site
    skills = {
        name.value: elaborate_skill(name, skill, site, bound, models, diagnostics)
        for name, skill in ecm.skills
    }
    capabilities = _capabilities(ecm, diagnostics)
    required = {name.value: one.version.value for name, one in ecm.dependencies.required_capabilities}
    modules = {name.value: specifier.value for name, specifier in ecm.dependencies.modules}
    requirements = frozenset((*required, *modules))
    names = CallableNames(ecm.id.value, skills, capabilities, {}, foreign, requirements)
    sequences = [one for _, each in ecm.capabilities for one in each.provided_by if isinstance(one, tuple)]
    made = [elaborate_sequence(one, alternative_name(one), names, diagnostics) for one in sequences]
    names = replace(names, compositions={one.id: one for one in made if one is not None})
    compositions = elaborate_compositions(ecm.compositions, site, names, diagnostics)
    names = replace(names, compositions=compositions)
    elaborated = Ecm(
        id=ecm.id.value,
        version=ecm.version.value,
        folder=folder,
        manifest_digest=digests[0],
        code_digest=digests[1],
        model_digests=_model_digests(ecm, Path(folder), diagnostics),
        capabilities=capabilities,
        skills=skills,
        tasks=elaborate_tasks(ecm, names, site, perception.task_parameters, diagnostics),
        requested_access=_requested_access(ecm.permissions, bound),
        permitted_actions=elaborate_action_conditions(ecm.permissions.actions, {}, site, diagnostics),
        required_modules=modules,
        requires_spans={name.value: name.span for name, _ in ecm.dependencies.modules},
        required_aeros_version=ecm.dependencies.aeros.value,
        runtime_span=ecm.dependencies.aeros.span,
        access_span=ecm.permissions.key_span or ecm.permissions.span,
        span=ecm.id.span,
        models=models,
        compositions=compositions,
        capability_versions=ecm.capability_versions,
        required_capabilities=required,
        capability_spans={name.value: name.span for name, _ in ecm.dependencies.capabilities},
        interfaces=elaborate_interfaces(ecm, site, diagnostics),
        foreign=foreign,
        state=perception.state,
        perceivers=perception.perceivers,
        definitions=perception.definitions,
        things=elaborate_things(ecm, site, diagnostics),
        names=bound,
        worker=elaborate_worker_limits(ecm.permissions.worker, site.isolation, diagnostics),
        access_spans={
            name.value: name.span
            for group in (
                ecm.permissions.actuators,
                ecm.permissions.sensors,
                ecm.permissions.channels,
                ecm.permissions.compute,
            )
            for name in group
        },
    )
    if len(diagnostics) > before:
        return None
    tasks = {
        name: replace(task, composed=composed_tasks(elaborated, task))
        for name, task in elaborated.tasks.items()
    }
    return replace(elaborated, tasks=tasks)


def _requested_access(permissions: declared.Permissions, names: BoundNames) -> Access:
    """Collect the access that a module asks for, by the site's names."""
    asked = elaborate_access(permissions)
    return replace(
        asked,
        actuators=site_names(asked.actuators, names.actuators),
        sensors=site_names(asked.sensors, names.sensors),
        channels=site_names(asked.channels, names.channels),
    )


def _check_metadata(ecm: declared.Ecm, diagnostics: Diagnostics) -> None:
    """Check the forms of the version, the licence and the version ranges."""
    _check_version(ecm.version, parse_version, "as in `1.0.0`", diagnostics)
    text = ecm.license.value
    try:
        canonicalize_license_expression(text)
        is_license = len(text) <= _MAX_LICENSE and text == text.strip() and text.isprintable()
    except InvalidLicenseExpression:
        is_license = False
    if not is_license:
        diagnostics.error(
            "AE132",
            f"{quoted(text)} is not an SPDX licence expression",
            ecm.license.span,
            help=("as in `Apache-2.0` or `LicenseRef-Proprietary`",),
        )
    for _, capability in ecm.capabilities:
        if capability.version is not None:
            _check_version(capability.version, parse_version, "as in `1.0.0`", diagnostics)
    modules = (specifier for _, specifier in ecm.dependencies.modules)
    capabilities = (one.version for _, one in ecm.dependencies.required_capabilities)
    for specifier in (ecm.dependencies.aeros, *modules, *capabilities):
        _check_version(specifier, parse_range, 'as in `">=1.0,<2"`', diagnostics)


def _check_version(
    field: TextField, parse: Callable[[str], object], example: str, diagnostics: Diagnostics
) -> None:
    try:
        parse(field.value)
    except ValueError as error:
        diagnostics.error("AE125", f"{quoted(field.value)} {error}", field.span, help=(example,))


def _model_digests(ecm: declared.Ecm, folder: Path, diagnostics: Diagnostics) -> dict[str, str]:
    """Compute the digest of every file that a model names, each in the module's own folder."""
    digests: dict[str, str] = {}
    left = MAX_MODELS
    for name, model in ecm.models:
        if model.file is None or model.file.value in digests:
            continue
        try:
            digests[model.file.value], size = model_digest(folder, model.file.value, left)
        except OSError as error:
            headline = f"`{name.value}`: `{model.file.value}` is not a file of this module"
            diagnostics.error("AE131", headline, model.file.span, f"{error.strerror}".lower())
        else:
            left -= size
    return digests


def _capabilities(ecm: declared.Ecm, diagnostics: Diagnostics) -> dict[str, tuple[str, ...]]:
    known = {name.value: None for name, _ in (*ecm.skills, *ecm.compositions)}
    for _, capability in ecm.capabilities:
        if not capability.provided_by:
            diagnostics.error("AE112", "a capability is provided by at least one skill", capability.span)
        for one in capability.provided_by:
            if isinstance(one, TextField):
                resolve_name(one, known, "a skill or composition of this module", diagnostics)
    return capability_names(ecm)
