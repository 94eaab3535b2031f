"""Things at places: state variables of modules that say where in the cell something is.

A vector in metres may also be a shift or a way. It counts as a place if the module states the space that is
occupied around it, or if the last word of its name is `position` or `place`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from fractions import Fraction
from typing import Final, NamedTuple

from aeros.runtime.bus.measurement_messages import position_variables
from aeros.runtime.ports import Vec3
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared

_PLACE_NAMES: Final = ("position", "place")


class SceneThing(NamedTuple):
    """A thing that a state variable says the place of.

    Attributes:
        variable: full name of the variable.
        label: name for people.
        perceiver: full name of the perceiver that provides it; empty if another sensor does.
        max_age: time after which a measured place is unknown, s; 0 if never.
        box: lower and upper corner of the space that it occupies, relative to its place, m; None if unknown.
    """

    variable: str
    label: str
    perceiver: str
    max_age: float
    box: tuple[Vec3, Vec3] | None


def things_of(site: Site) -> list[SceneThing]:
    """Find the things of a site's modules.

    Args:
        site: declares the state variables.

    Returns:
        The things, in the order of the variables.
    """
    places = [name for name in position_variables(site) if "." in name]
    return [
        _thing(name, one)
        for name in places
        if (one := site.state[name]).occupies is not None or re.split(r"[._]", name)[-1] in _PLACE_NAMES
    ]


def cameras_of_perceivers(modules: Iterable[Ecm]) -> dict[str, frozenset[str]]:
    """List the cameras of each perceiver.

    Args:
        modules: the modules.

    Returns:
        Names of cameras of the site, by full name of the perceiver.
    """
    return {
        f"{ecm.id}.{name}": frozenset(one.camera for one in perceiver.pictures)
        for ecm in modules
        for name, perceiver in ecm.perceivers.items()
    }


def seen_by(
    things: Iterable[SceneThing], cameras: Mapping[str, frozenset[str]]
) -> dict[str, list[SceneThing]]:
    """Sort things by the cameras in whose pictures they are found.

    Args:
        things: the things.
        cameras: names of cameras by perceiver, as `cameras_of_perceivers` returns them.

    Returns:
        The things by camera.
    """
    found: dict[str, list[SceneThing]] = {}
    for thing in things:
        for camera in sorted(cameras.get(thing.perceiver, ())):
            found.setdefault(camera, []).append(thing)
    return found


def _thing(name: str, one: Declared) -> SceneThing:
    module, _, short = name.rpartition(".")
    label = short.removesuffix("_position").replace("_", " ")
    sensor = one.sensor or ""
    box = None if one.occupies is None else (_point(one.occupies.lower), _point(one.occupies.upper))
    return SceneThing(
        name, label, sensor if sensor.startswith(f"{module}.") else "", float(one.max_age or 0.0), box
    )


def _point(corner: tuple[Fraction, Fraction, Fraction]) -> Vec3:
    x, y, z = map(float, corner)
    return (x, y, z)
