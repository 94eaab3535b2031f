"""Comparison of a plant with the site before a run starts: measured variables, and action kinds."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.request_check import is_module_variable
from aeros.runtime.ports import Plant, known_action_kinds
from aeros.session.plant_factory import PlantSetupError
from aeros.spec.declared.site import StateVariable
from aeros.spec.elaborate.load import decode_site
from aeros.spec.expr.units import format_number
from aeros.spec.model.rules import SIMULATED_ACTIONS, ActionKind, parameter_differences
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import reference_site_path


def require_declared_measurements(plant: Plant, site: Site) -> None:
    """Require that the site declares every state variable that the plant measures.

    The gate denies every request that holds a reading of an unknown name, so nothing could run. A declared
    variable that the plant does not measure is no error: it is unknown, as one of a sensor that failed.

    Args:
        plant: The plant, at its start.
        site: The site in force, with the variables of the modules.

    Raises:
        PlantSetupError: Some are not declared; the message has a declaration for each.
    """
    readings = plant.observe()
    missing = [name for name in readings if name not in site.state and not is_module_variable(name)]
    if not missing:
        return
    reference = _reference_declarations()
    lines = [
        f"  {name}: {_declaration(reference.get(name), readings[name].value)}" for name in sorted(missing)
    ]
    count = "1 state variable" if len(missing) == 1 else f"{len(missing)} state variables"
    raise PlantSetupError(
        f"the plant measures {count} that the site `{site.id}` does not declare, so the gate would deny "
        "every action; add under `state` in the site file, with the site's own names of sensors and of the "
        f"enum of joints (docs/plants.md, A site for the simulators):\n" + "\n".join(lines)
    )


def require_known_actions(plant: Plant, configuration: Configuration) -> None:
    """Require that the plant can do the actions that the modules need, if it says its action kinds.

    Args:
        plant: The plant.
        configuration: The modules and the site in force.

    Raises:
        PlantSetupError: It cannot do some of them, or has other parameters for them; the message says what to
            write in the site file.
    """
    known = known_action_kinds(plant)
    if known is None:
        return
    site = configuration.site
    needed = {
        kind
        for ecm in configuration.modules.values()
        for skill in ecm.skills.values()
        for kind in skill.envelope
    }
    motions = {name: site.kinds[name].plant_word for name in sorted(needed) if not site.kinds[name].tool}
    for name, word in motions.items():
        differences = parameter_differences(site.kinds[name], word) if word in SIMULATED_ACTIONS else []
        if word in known and differences:
            raise PlantSetupError(
                f"the plant cannot do `{name}` of the site `{site.id}`: its parameters are not those of the "
                f"plant's `{word}`: {'; '.join(differences)}"
            )
    missing = [name for name, word in motions.items() if word not in known]
    if not missing:
        return
    lines = [f"  {name}: {{means: {_nearest(site.kinds[name], known)}, …}}" for name in missing]
    count = "1 action kind" if len(missing) == 1 else f"{len(missing)} action kinds"
    raise PlantSetupError(
        f"the plant cannot do {count} of the site `{site.id}` that the modules need. It knows "
        f"{', '.join(sorted(known))}. If the site has other words for these, say so under `actions` in the "
        "site file (docs/plants.md, A site for the simulators):\n" + "\n".join(lines)
    )


def _nearest(kind: ActionKind, known: Collection[str]) -> str:
    """Return the known action kinds that have the same parameters, or a place holder."""
    suiting = [word for word in SIMULATED_ACTIONS if word in known and not parameter_differences(kind, word)]
    return " or ".join(suiting) or "WORD"


def _reference_declarations() -> Mapping[str, StateVariable]:
    site = decode_site(reference_site_path())
    return {} if site is None else {name.value: one for name, one in site.state}


def _declaration(reference: StateVariable | None, value: Any) -> str:
    """Write a declaration as the reference site has it; one by the measured value for other names."""
    if reference is None:
        kind = "bool" if type(value) is bool else "real, unit: UNIT, range: [LOW, HIGH]"
        if isinstance(value, tuple | list):
            kind = f"vec3{kind[4:]}" if len(value) == 3 else f"real, index: ENUM{kind[4:]}"
        return f"{{type: {kind}, sensor: SENSOR, max_age: 50 ms}}"
    parts = [f"type: {reference.type.value}"]
    if reference.index is not None:
        parts.append(f"index: {reference.index.value}")
    if reference.unit is not None:
        parts.append(f"unit: {reference.unit.value}")
    if reference.range is not None:
        parts.append(f"range: [{', '.join(format_number(bound.value) for bound in reference.range)}]")
    parts += [f"sensor: {reference.sensor.value}", f"max_age: {reference.max_age.value}"]
    return f"{{{', '.join(parts)}}}"
