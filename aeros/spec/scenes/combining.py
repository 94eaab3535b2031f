"""One cell from the scenes of several tasks: equal bodies are shared, and other names are made to differ.

A scene knows nothing of those that it is combined with. So two of them may well have a thing of the same
name: then each of these things gets the label of its scene in front of its name.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import fields, replace
from functools import reduce
from math import dist, radians, tan
from typing import Final

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.model.scene import RobotMount, Scene, SceneCamera, Vector
from aeros.spec.scenes.merging import merge, names_in_use, renamed

_ROOM_AROUND: Final = 1.2
"""Room around the stations in the combined view, m."""


def combine(scenes: Mapping[str, Scene]) -> Scene:
    """Combine the scenes of several tasks into one cell.

    Args:
        scenes: the scenes by label, the first task's first. Each has a robot and a view, and all have the
            same W. One that another includes adds nothing.

    Returns:
        Everything of all. The robot starts where the first scene has it; the view shows all.

    Raises:
        UserError: robots are put up differently, or cameras, surveyed places, instruments or truths of one
            name differ.
    """
    first = next(iter(scenes.values()))
    included = {part for scene in scenes.values() for part in scene.parts[1:]}
    kept = {label: scene for label, scene in scenes.items() if scene.parts[0] not in included}
    if len(kept) == 1:
        return replace(next(iter(kept.values())), robot=first.robot)
    diagnostics = Diagnostics()
    for scene in kept.values():
        _check_robot(first, scene, diagnostics)
    cells = list(_with_own_names(kept, first.robot))
    _check_variables(cells, diagnostics)
    whole = reduce(lambda one, other: merge(one, other, None, diagnostics), cells)
    diagnostics.raise_if_errors()
    name, description = "+".join(one.name for one in cells), "; ".join(one.description for one in cells)
    return replace(whole, name=name, description=description, view=_view_of_all(cells))


def _check_robot(first: Scene, other: Scene, diagnostics: Diagnostics) -> None:
    """Report a robot that cannot be the first scene's: one that drives may start elsewhere."""
    one, two = first.robot, other.robot
    if one is None or two is None:
        return
    if one.carriage != two.carriage or one.base[2] != two.base[2]:
        fault = f"is not put up as that of `{first.name}`"
    elif not one.carriage and one.base != two.base:
        fault = f"does not stand where that of `{first.name}` does, and cannot drive"
    else:
        return
    diagnostics.error(
        "AE208",
        f"the robot of the scene `{other.name}` {fault}",
        help=("run the tasks one after the other, or put the robot up in the same way in both files",),
    )


def _check_variables(scenes: Sequence[Scene], diagnostics: Diagnostics) -> None:
    """Report state variables that two scenes measure differently."""
    measured: dict[str, str] = {}
    for scene in scenes:
        for variable, _ in scene.measured():
            if variable in measured:
                headline = (
                    f"`{variable}` is measured in the scene `{scene.name}` and in `{measured[variable]}`"
                )
                diagnostics.error("AE121", headline, help=("make both equal, or run the tasks one by one",))
            measured[variable] = scene.name


def _with_own_names(scenes: Mapping[str, Scene], robot: RobotMount | None) -> Iterator[Scene]:
    """Yield the scenes: the robot and what all share with the first, and other names all different."""
    used = Counter(name for scene in scenes.values() for name in names_in_use(scene))
    shared = {name for name, count in used.items() if count > 1 and _is_shared(name, scenes.values())}
    in_use, given = set(used), set[str]()
    for number, (label, scene) in enumerate(scenes.items()):
        names: dict[str, str] = {}
        for name in names_in_use(scene):
            if used[name] > 1 and name not in shared:
                names[name] = _free_name(label, name, in_use)
                in_use.add(names[name])
        cell = replace(renamed(scene, names), robot=robot if number == 0 else None)
        for name in given & names_in_use(cell).keys():
            cell = _without(cell, name)
        given |= shared & names_in_use(cell).keys()
        yield cell


def _is_shared(name: str, scenes: Collection[Scene]) -> bool:
    """Return True if all things of a name are equal bodies or equal places of one variable, placed in W."""
    things = [_shareable(name, scene) for scene in scenes if name in names_in_use(scene)]
    return None not in things and all(thing == things[0] for thing in things)


def _shareable(name: str, scene: Scene) -> tuple[object, ...] | None:
    """Return all that tells a body or place from others; None for other things and one in another's frame."""
    body, place = scene.bodies.get(name), scene.places.get(name)
    if body is not None and body.placement.frame is None:
        return tuple(getattr(body, one.name) for one in fields(body) if one.name != "span")
    if place is not None and place.frame is None:
        return place, scene.variables.get(name)
    return None


def _without(scene: Scene, name: str) -> Scene:
    """Return a scene without a body or place."""
    return replace(
        scene,
        bodies={other: body for other, body in scene.bodies.items() if other != name},
        places={other: place for other, place in scene.places.items() if other != name},
        variables={other: variable for other, variable in scene.variables.items() if other != name},
    )


def _free_name(label: str, name: str, in_use: set[str]) -> str:
    found = f"{label}_{name}"
    while found in in_use:
        found = f"{label}_{found}"
    return found


def _view_of_all(scenes: Sequence[Scene]) -> SceneCamera | None:
    """Return the first scene's view, moved back until it shows the targets of all views."""
    views = [scene.view for scene in scenes if scene.view is not None]
    if not views:
        return None
    first, targets = views[0], [view.target for view in views]
    middle = _mean([tuple(map(min, zip(*targets, strict=True))), tuple(map(max, zip(*targets, strict=True)))])
    radius = max(dist(middle, target) for target in targets) + _ROOM_AROUND
    away = tuple(a - b for a, b in zip(first.eye, first.target, strict=True))
    scale = radius / tan(radians(first.field_of_view) / 2.0) / dist(first.eye, first.target)
    x, y, z = (at + max(1.0, scale) * way for at, way in zip(middle, away, strict=True))
    return first._replace(eye=(x, y, z), target=middle)


def _mean(points: Sequence[tuple[float, ...]]) -> Vector:
    x, y, z = (sum(values) / len(points) for values in zip(*points, strict=True))
    return (x, y, z)
