"""Plants of other distributions: registered as entry points of the group `aeros.plants`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from typing import Any, Final

from aeros.descriptions import describe_exception, type_name
from aeros.runtime.ports import Plant
from aeros.sim.conformance.plant_under_test import PlantUnderTest
from aeros.spec.diagnostics.codes import did_you_mean
from aeros.spec.model.scene import Scene
from aeros.spec.model.site import Site

GROUP: Final = "aeros.plants"
"""Group of entry points under which an installed distribution provides plants, each a `PlantProvider`."""


class PlantProviderError(Exception):
    """There is no such plant, or its distribution cannot provide it; the message says why and what to do."""


@dataclass(frozen=True)
class PlantRequest:
    """Request of a run for a plant.

    Attributes:
        site: the site, whose vocabulary the plant measures and whose actions it executes.
        scene: bodies, cameras and the robot's mount, as data; None if the task names no scene.
        start: values (SI) of state variables at the declared start of the task, by name.
        seed: seed of all random numbers; the same request gives the same run.
    """

    site: Site
    scene: Scene | None
    start: Mapping[str, Any]
    seed: int


@dataclass(frozen=True)
class PlantProvider:
    """Provider of a plant, as an entry point of the group `aeros.plants` names it.

    Attributes:
        open_plant: makes a plant for a run, at rest; AEROS closes it.
        subject: makes what the conformance suite holds the plant to, for `aeros check-plant`; None for a
            plant that cannot be checked.
        runs_in_real_time: as of `Plant`: True for a robot. Trainers refuse it without opening it.
    """

    open_plant: Callable[[PlantRequest], Plant]
    subject: Callable[[], PlantUnderTest] | None = None
    runs_in_real_time: bool = False


def provided_plants() -> tuple[str, ...]:
    """List the plants that installed distributions provide.

    Returns:
        Their names, sorted.
    """
    return tuple(sorted({one.name for one in entry_points(group=GROUP)}))


def load_provider(name: str, shipped: tuple[str, ...] = ()) -> PlantProvider:
    """Import the provider of a plant.

    Args:
        name: name of its entry point.
        shipped: names of the plants that come with AEROS, for the message.

    Returns:
        The provider.

    Raises:
        PlantProviderError: no distribution has it, several have, or it cannot be imported.
    """
    found = [*entry_points(group=GROUP, name=name)]
    if not found:
        known = (*shipped, *provided_plants())
        near = did_you_mean(name, known)
        help_ = f"did you mean `{near}`?" if near else f"there are {', '.join(known) or 'none'}"
        raise PlantProviderError(
            f"no plant is called `{name}`: {help_} (an installed distribution may provide one, as an entry "
            f"point of `{GROUP}`)"
        )
    if len(found) > 1:
        raise PlantProviderError(
            f"several distributions provide a plant `{name}`: {', '.join(map(_origin, found))}; "
            "uninstall all but one"
        )
    (entry,) = found
    try:
        provider = entry.load()
    except Exception as failure:
        raise PlantProviderError(
            f"the plant `{name}`, {_origin(entry)}, cannot be imported: "
            f"{describe_exception(failure, one_line=True)}"
        ) from failure
    if not isinstance(provider, PlantProvider):
        raise PlantProviderError(
            f"the entry point `{name}`, {_origin(entry)}, is of type {type_name(provider)}, and not an "
            "`aeros.session.plant_provider.PlantProvider`"
        )
    return provider


def open_provided_plant(name: str, request: PlantRequest) -> Plant:
    """Open the plant of another distribution.

    Args:
        name: name of its entry point.
        request: what the run needs.

    Returns:
        The plant.

    Raises:
        PlantProviderError: there is no such plant, or its code fails.
    """
    provider = load_provider(name)
    try:
        return provider.open_plant(request)
    except Exception as failure:
        raise PlantProviderError(
            f"the plant `{name}` cannot be opened: {describe_exception(failure, one_line=True)}"
        ) from failure


def _origin(entry: EntryPoint) -> str:
    owner = "an unnamed distribution" if entry.dist is None else entry.dist.name
    return f"`{entry.value}` of {owner}"
