"""One cell from the scenes of several tasks: equal bodies are shared, and other names are made to differ.

A scene knows nothing of those that it is combined with. So two of them may well have a thing of the same
name: then each of these things gets the label of its scene in front of its name.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import reduce
from math import dist, radians, tan
from typing import Final

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.model.scene import Scene, SceneCamera, Vector
from aeros.spec.scenes.merging import merge, names_in_use, renamed

_ROOM_AROUND: Final = 1.2
"""Room around the stations in the combined view, m."""


def combine(scenes: Mapping[str, Scene]) -> Scene:
    """Combine the scenes of several tasks into one cell.

    Args:
        scenes: the scenes by label, the first task's first. Each has a robot and a view, and all have the
            same W.

    Returns:
        Everything of all. The robot starts where the first scene has it; the view shows all.

    Raises:
        UserError: robots are put up differently, or cameras, surveyed places, instruments or truths of one
            name differ.
    """
    (_, first), *others = scenes.items()
    if not others:
        return first
    diagnostics = Diagnostics()
    for _, other in others:
        _check_robot(first, other, diagnostics)
    cells = list(_with_own_names(scenes))
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
        fault = "is not put up as"
    elif not one.carriage and one.base != two.base:
        fault = "does not stand where it cannot drive to, as does"
    else:
        return
    diagnostics.error(
        "AE208",
        f"the robot of the scene `{other.name}` {fault} that of `{first.name}`",
        help=("run the tasks one after the other, or put the robot up in the same way in both files",),
    )


def _with_own_names(scenes: Mapping[str, Scene]) -> Iterator[Scene]:
    """Yield the scenes, only the first with its robot, shared bodies only once, other names all different."""
    used = Counter(name for scene in scenes.values() for name in names_in_use(scene))
    shared = {name for name, count in used.items() if count > 1 and _is_shared(name, scenes.values())}
    taken = set(used)
    for number, (label, scene) in enumerate(scenes.items()):
        names: dict[str, str] = {}
        for name in names_in_use(scene):
            if used[name] > 1 and name not in shared:
                names[name] = _free_name(label, name, taken)
                taken.add(names[name])
        cell = renamed(scene, names)
        if number > 0:
            bodies = {name: body for name, body in cell.bodies.items() if name not in shared}
            cell = replace(cell, robot=None, bodies=bodies)
        yield cell


def _is_shared(name: str, scenes: Collection[Scene]) -> bool:
    """Return True if all things of a name are equal bodies, placed in W."""
    things = [scene for scene in scenes if name in names_in_use(scene)]
    bodies = [scene.bodies[name] for scene in things if name in scene.bodies]
    return len(bodies) == len(things) and all(
        body.placement.frame is None and replace(body, span=bodies[0].span) == bodies[0] for body in bodies
    )


def _free_name(label: str, name: str, taken: set[str]) -> str:
    found = f"{label}_{name}"
    while found in taken:
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
