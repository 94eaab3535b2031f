"""Scenes put together: the things of one under a prefix and at an offset, and two scenes as one."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, replace
from typing import Any, Final, TypeVar

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.expr import terms as t
from aeros.spec.model.scene import (
    BodyPart,
    Coating,
    ForceInstrument,
    Instrument,
    JointInstrument,
    LoadInstrument,
    Placement,
    PositionInstrument,
    Press,
    Region,
    Scene,
    SceneBody,
    SceneCamera,
    SceneCondition,
    Seal,
    Vector,
)
from aeros.spec.scenes.conditions import is_membership, membership

_T = TypeVar("_T")

NAMED: Final[Mapping[str, str]] = {
    "places": "a place",
    "bodies": "a body",
    "instruments": "an instrument",
    "regions": "a region",
    "coatings": "a coating",
    "conditions": "a condition",
    "seals": "a seal",
    "timers": "a timer",
    "presses": "a press",
}
"""Fields of a scene whose names must all differ, with what each names. Names of `cameras` and of `truth` are
the site's, and differ among themselves."""


def names_in_use(scene: Scene) -> dict[str, str]:
    """List the names of a scene's things.

    Args:
        scene: the scene.

    Returns:
        What each name is, as `a body`, by name.
    """
    return {name: what for field, what in NAMED.items() for name in getattr(scene, field)}


def moved(scene: Scene, prefix: str, offset: Vector) -> Scene:
    """Give the things of a scene other names and another place.

    Args:
        scene: the scene.
        prefix: put before each name.
        offset: added to each position in W, m. Lengths in the text of conditions stay as they are.

    Returns:
        The scene.
    """

    def prefixed(name: str) -> str:
        return prefix + name

    return _Move(prefixed, prefixed, offset).scene(scene)


def renamed(scene: Scene, names: Mapping[str, str]) -> Scene:
    """Give some things of a scene other names; cameras, state variables and random streams keep theirs.

    Args:
        scene: the scene.
        names: new names by the old ones.

    Returns:
        The scene.
    """
    return _Move(lambda name: names.get(name, name), str, (0.0, 0.0, 0.0)).scene(scene)


def merge(first: Scene, second: Scene, at: SourceSpan | None, diagnostics: Diagnostics) -> Scene:
    """Put two scenes together; names that both have are reported.

    Args:
        first: a scene, whose name, description, robot and view the result has.
        second: the scene that is added.
        at: where the second is asked for; None if a command line does.
        diagnostics: receives the faults.

    Returns:
        Everything of both. Robot, view and variation are the second's where the first has none.
    """
    in_use = names_in_use(first)
    clashes = {name: what for name, what in names_in_use(second).items() if name in in_use}
    clashes |= {name: "a camera" for name in second.cameras if _differs(name, first.cameras, second.cameras)}
    clashes |= {name: "the truth of a state variable" for name in second.truth if name in first.truth}
    for name, what in clashes.items():
        diagnostics.error(
            "AE121",
            f"`{name}` of the scene `{second.name}` is already {in_use.get(name, what)} of `{first.name}`",
            at,
            help=(_cure(what, at),),
        )
    if first.robot is not None and second.robot is not None and first.robot != second.robot:
        diagnostics.error(
            "AE208",
            f"the robot of the scene `{second.name}` is not put up as that of `{first.name}`",
            at,
            help=("write `robot` in the scene that includes both",) if at else ("remove its `robot`",),
        )
    joined: dict[str, Any] = {
        field: {**getattr(first, field), **getattr(second, field)}
        for field in (*NAMED, "cameras", "truth", "variables")
    }
    return replace(
        first,
        **joined,
        robot=first.robot or second.robot,
        view=first.view or second.view,
        variation=first.variation or second.variation,
        parts=(*first.parts, *second.parts),
    )


def _cure(what: str, at: SourceSpan | None) -> str:
    if what == "a camera":
        return "make both equal, or bind one of them to another camera of the site"
    return "rename one of them" if at is None else "include one of them with a `prefix`"


def _differs(name: str, first: Mapping[str, SceneCamera], second: Mapping[str, SceneCamera]) -> bool:
    return name in first and first[name] != second[name]


class _Move:
    """Renames and moves things.

    Args:
        name: gives the new name of a thing.
        outer: gives the new name of what is known outside of the scene: cameras, state variables, streams.
        offset: added to each position in W.
    """

    def __init__(self, name: Callable[[str], str], outer: Callable[[str], str], offset: Vector) -> None:
        self._name = name
        self._outer = outer
        self._offset = offset
        self._truth: Mapping[str, SceneCondition] = {}
        self._coatings: Mapping[str, Coating] = {}

    def scene(self, scene: Scene) -> Scene:
        """Rename and move everything."""
        robot, self._truth, self._coatings = scene.robot, scene.truth, scene.coatings
        return replace(
            scene,
            robot=None if robot is None else robot._replace(base=self._point(robot.base)),
            view=None if scene.view is None else self._camera(scene.view),
            places=self._all(scene.places, self._placement),
            bodies=self._all(scene.bodies, self._body),
            cameras={self._outer(name): self._camera(one) for name, one in scene.cameras.items()},
            instruments=self._all(scene.instruments, self._instrument),
            regions=self._all(scene.regions, self._region),
            coatings=self._all(scene.coatings, self._coating),
            conditions=self._all(scene.conditions, self._condition),
            seals=self._all(scene.seals, self._seal),
            timers=self._all(scene.timers, self._condition),
            presses=self._all(scene.presses, self._press),
            truth={self._full_name(name): self._condition(one) for name, one in scene.truth.items()},
            variables=dict(self._variables(scene)),
            parts=tuple(
                part._replace(prefix=self._outer(part.prefix), offset=self._point(part.offset))
                for part in scene.parts
            ),
        )

    def _all(self, things: Mapping[str, _T], move: Callable[[_T], _T]) -> dict[str, _T]:
        return {self._name(name): move(thing) for name, thing in things.items()}

    def _variables(self, scene: Scene) -> Iterator[tuple[str, str]]:
        for variable, thing in scene.measured():
            found = (self._name(thing), self._full_name(variable))
            if found[0] != found[1]:
                yield found

    def _full_name(self, name: str) -> str:
        """Rename a state variable, which may be a module's."""
        module, dot, short = name.rpartition(".")
        return f"{module}{dot}{self._outer(short)}"

    def _point(self, point: Vector) -> Vector:
        x, y, z = (part + by for part, by in zip(point, self._offset, strict=True))
        return (x, y, z)

    def _placement(self, placement: Placement) -> Placement:
        frame, alternative = placement.frame, placement.alternative
        if alternative is not None:
            there = alternative.position if frame else self._point(alternative.position)
            alternative = alternative._replace(
                position=there, farther_from=self._name(alternative.farther_from)
            )
        return placement._replace(
            frame=None if frame is None else self._name(frame),
            position=placement.position if frame else self._point(placement.position),
            stream=self._outer(placement.stream),
            alternative=alternative,
        )

    def _body(self, body: SceneBody) -> SceneBody:
        return replace(body, name=self._name(body.name), placement=self._placement(body.placement))

    def _camera(self, camera: SceneCamera) -> SceneCamera:
        if camera.frame != "cell":
            return camera
        return camera._replace(eye=self._point(camera.eye), target=self._point(camera.target))

    def _part(self, part: BodyPart) -> BodyPart:
        return part._replace(body=self._name(part.body))

    def _instrument(self, instrument: Instrument) -> Instrument:
        match instrument:
            case ForceInstrument(first, second):
                return ForceInstrument(self._part(first), self._part(second))
            case LoadInstrument(of):
                return LoadInstrument(self._part(of))
            case PositionInstrument(of):
                return PositionInstrument(self._part(of))
            case JointInstrument(joint):
                return JointInstrument(self._part(joint))

    def _region(self, region: Region) -> Region:
        if region.of is not None:
            return region._replace(of=self._name(region.of))
        return region._replace(low=self._point(region.low), high=self._point(region.high))

    def _coating(self, coating: Coating) -> Coating:
        dx, dy, _ = self._offset
        return coating._replace(
            low=(coating.low[0] + dx, coating.low[1] + dy),
            high=(coating.high[0] + dx, coating.high[1] + dy),
            on=self._name(coating.on),
            wiped_by=self._name(coating.wiped_by),
        )

    def _seal(self, seal: Seal) -> Seal:
        return seal._replace(joint=self._part(seal.joint), when=self._condition(seal.when))

    def _press(self, press: Press) -> Press:
        return press._replace(
            lid=self._part(press.lid),
            handle=self._part(press.handle),
            folds=self._part(press.folds),
            place=self._point(press.place),
            filling=self._name(press.filling),
            inside=self._name(press.inside),
            seal=self._name(press.seal),
        )

    def _condition(self, condition: SceneCondition) -> SceneCondition:
        return replace(condition, term=self._term(condition.term))

    def _term(self, value: Any) -> Any:
        """Rename the variables of a term."""
        if isinstance(value, t.Variable):
            return replace(value, name=self._variable(value.name))
        if isinstance(value, tuple):
            return tuple(self._term(part) for part in value)
        if isinstance(value, t.Term):
            changed = {field.name: self._term(getattr(value, field.name)) for field in fields(value)}
            return replace(value, **changed)
        return value

    def _variable(self, name: str) -> str:
        if is_membership(name):
            point, region = membership(name)
            return f"{self._variable(point)} in {self._name(region)}"
        if name in self._truth:
            return self._full_name(name)
        thing, dot, part = name.partition(".")
        if thing in self._coatings and "." in part:
            region, _, measured = part.partition(".")
            part = f"{self._name(region)}.{measured}"
        return name if thing == "robot" else f"{self._name(thing)}{dot}{part}"
