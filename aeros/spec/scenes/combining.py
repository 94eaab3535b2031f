"""One cell from several scenes: equal bodies are shared, and other names are made to differ.

The scenes are those of tasks, or of files that a scene includes. A scene knows nothing of
those that it is combined with. So two of them may well have a thing of the same name: then each of these
things gets the label of its scene in front of its name.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import fields, replace
from itertools import chain, count
from math import dist, radians, tan
from typing import Final, NamedTuple

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.model.scene import RobotMount, Scene, SceneCamera, Vector
from aeros.spec.scenes.merging import merge, names_in_use, renamed

_ROOM_AROUND: Final = 1.2
"""Room around the stations in the combined view, m."""


class LabelledScene(NamedTuple):
    """A scene as a part of a cell.

    Attributes:
        label: put before its names that other scenes use for other things.
        scene: the scene.
        at: where a file asks for it; None if a task does.
    """

    label: str
    scene: Scene
    at: SourceSpan | None = None


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
    diagnostics = Diagnostics()
    whole = join([LabelledScene(label, scene) for label, scene in scenes.items()], diagnostics)
    diagnostics.raise_if_errors()
    return whole


def join(scenes: Sequence[LabelledScene], diagnostics: Diagnostics, *, own_robot: bool = False) -> Scene:
    """Join scenes to one cell; what cannot be one is reported at its place.

    Args:
        scenes: the scenes, at least one; all have the same W. One that another includes adds nothing.
        diagnostics: receives the faults.
        own_robot: True if the cell has a robot of its own, so that those of the scenes do not count.

    Returns:
        Everything of all. The robot starts where the first scene has it; the view shows all.
    """
    first = next((one.scene for one in scenes if one.scene.robot is not None and not own_robot), None)
    robot = None if first is None else first.robot
    included = {part for one in scenes for part in one.scene.parts[1:]}
    kept = [one for one in scenes if one.scene.parts[0] not in included]
    if len(kept) == 1:
        return replace(kept[0].scene, robot=robot)
    if first is not None:
        for one in kept:
            _check_robot(first, one, diagnostics)
    labels = _different_labels(kept)
    cells = list(_with_own_names(dict(zip(labels, (one.scene for one in kept), strict=True)), robot))
    places = [one.at for one in kept]
    _check_variables(cells, places, diagnostics)
    whole = cells[0]
    for cell, at in zip(cells[1:], places[1:], strict=True):
        whole = merge(whole, cell, at, diagnostics)
    name, description = "+".join(one.name for one in cells), "; ".join(one.description for one in cells)
    return replace(whole, name=name, description=description, view=_view_of_all(cells))


def _different_labels(scenes: Sequence[LabelledScene]) -> list[str]:
    """Return a label for each scene; one that is in use is followed by the scene's name or by a number."""
    labels: list[str] = []
    for one in scenes:
        choices = chain((one.label, f"{one.label}_{one.scene.name}"), (f"{one.label}_{n}" for n in count(2)))
        labels.append(next(label for label in choices if label not in labels))
    return labels


def _check_robot(first: Scene, other: LabelledScene, diagnostics: Diagnostics) -> None:
    """Report a robot that cannot be the first scene's: one that drives may start elsewhere."""
    one, two = first.robot, other.scene.robot
    if one is None or two is None:
        return
    if one.carriage != two.carriage or one.base[2] != two.base[2]:
        fault = f"is not put up as that of `{first.name}`"
    elif not one.carriage and one.base != two.base:
        fault = f"does not stand where that of `{first.name}` does, and cannot drive"
    else:
        return
    cure = (
        "run the tasks one after the other, or put the robot up in the same way in both files"
        if other.at is None
        else "write `robot` in the scene that includes both"
    )
    diagnostics.error("AE208", f"the robot of the scene `{other.scene.name}` {fault}", other.at, help=(cure,))


def _check_variables(
    scenes: Sequence[Scene], places: Sequence[SourceSpan | None], diagnostics: Diagnostics
) -> None:
    """Report state variables that two scenes measure differently."""
    measured: dict[str, str] = {}
    for scene, at in zip(scenes, places, strict=True):
        for variable, _ in scene.measured():
            if variable in measured:
                headline = (
                    f"`{variable}` is measured in the scene `{scene.name}` and in `{measured[variable]}`"
                )
                cure = "run the tasks one by one" if at is None else "include one of them with a `prefix`"
                diagnostics.error("AE121", headline, at, help=(f"make both equal, or {cure}",))
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
    if len(views) == 1:
        return views[0]
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
