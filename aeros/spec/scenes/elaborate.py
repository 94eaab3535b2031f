"""Elaboration of a declared scene: numbers in SI units, names resolved, every fault at its place."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import product
from math import degrees, hypot
from pathlib import Path
from typing import Final, TypeVar

from aeros.spec.declared import scene as declared
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.names import check_name_is_free, resolve_name
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
    RobotMount,
    Scene,
    SceneCamera,
    SceneVariation,
    Seal,
    UrdfModel,
)
from aeros.spec.scenes.bodies import BodyElaborator
from aeros.spec.scenes.conditions import SceneScope, resolve_part
from aeros.spec.scenes.looks import LookElaborator
from aeros.spec.scenes.merging import NAMED, names_in_use
from aeros.spec.scenes.quantities import Quantities
from aeros.spec.scenes.truth_names import check_parameters_are_used
from aeros.spec.scenes.truths_of_arguments import truth_name
from aeros.spec.text.fields import MappingField, TextField

_T = TypeVar("_T")

_DEFAULT_FIELD_OF_VIEW: Final = 50.0
"""Vertical angle of view, degrees."""

_LEAST_SINE: Final = 1e-3
"""Sine of the least angle between the way that a camera looks and the direction that is up in its picture."""

_DEFAULT_SIZE: Final = (320, 240)

_MAX_CONDITION_WORD: Final = ("robot",)
"""Words that conditions use themselves."""


def elaborate_scene(
    scene: declared.Scene,
    included: Scene,
    folder: Path,
    diagnostics: Diagnostics,
    cameras: Mapping[str, str],
) -> Scene:
    """Elaborate the things that a file declares itself.

    Args:
        scene: the declaration.
        included: the scenes that it includes, as one; its own name and parts.
        folder: folder of the file.
        diagnostics: receives the faults.
        cameras: the site's names of cameras, by the names that the file uses; the others keep theirs.

    Returns:
        Included and declared things together; where faults were reported, some are missing.
    """
    return _SceneElaborator(included, folder, diagnostics, cameras).scene(scene)


class _SceneElaborator:
    """Adds the things of a declaration to a scene, one kind after the other.

    Args:
        included: what is there already.
        folder: folder of the file.
        diagnostics: receives the faults.
        cameras: the site's names of cameras, by the file's.
    """

    def __init__(
        self, included: Scene, folder: Path, diagnostics: Diagnostics, cameras: Mapping[str, str]
    ) -> None:
        self._found = included
        self._site_cameras = cameras
        self._diagnostics = diagnostics
        self._numbers = Quantities(diagnostics)
        self._bodies = BodyElaborator(self._numbers, folder)

    def scene(self, scene: declared.Scene) -> Scene:
        """Elaborate everything."""
        self._check_names(scene)
        found = self._found
        robot = found.robot if scene.robot is None else self._robot(scene.robot)
        view = found.view if scene.view is None else self._camera(scene.view)
        variation = found.variation if scene.randomise is None else self._variation(scene.randomise)
        self._found = replace(
            found, description=scene.description.value, robot=robot, view=view, variation=variation
        )
        for name, place in scene.places:
            self._add("places", {name.value: self._bodies.placement(name.value, place, self._found.places)})
        looks = {name.value: look for name, look in scene.looks}
        self._bodies.looks = LookElaborator(self._numbers, looks)
        for name, body in scene.bodies:
            known = (*self._found.places, *self._found.bodies)
            self._add("bodies", {name.value: self._bodies.body(name.value, body, known)})
        if scene.module is not None:
            sensed = [name for name, one in scene.instruments if one.force is None]
            measured = [name.value for name in (*(place for place, _ in scene.places), *sensed)]
            self._add("variables", {name: f"{scene.module.value}.{name}" for name in measured})
        self._add("cameras", {self._site_camera(name): self._camera(one) for name, one in scene.cameras})
        self._add("instruments", _each(scene.instruments, self._instrument))
        self._add("regions", _each(scene.regions, self._region))
        self._add("coatings", _each(scene.coatings, self._coating))
        self._add_conditions(scene)
        self._add("presses", _each(scene.presses, self._press))
        return self._found

    def _add(self, field: str, things: Mapping[str, object]) -> None:
        whole = {name: thing for name, thing in things.items() if thing is not None}
        self._found = replace(self._found, **{field: {**getattr(self._found, field), **whole}})  # type: ignore[arg-type]

    def _check_names(self, scene: declared.Scene) -> None:
        used = names_in_use(self._found) | dict.fromkeys(_MAX_CONDITION_WORD, "the robot")
        for field, what in NAMED.items():
            for name, _ in getattr(scene, field):
                check_name_is_free(name, used, what.partition(" ")[2], self._diagnostics)
                used.setdefault(name.value, what)
        used = dict.fromkeys(self._found.truth, "a truth of a scene that is included")
        for name, _ in scene.truth:
            if "." not in name.value:
                check_name_is_free(name, used, "truth", self._diagnostics)
        used = dict.fromkeys(self._found.cameras, "a camera of a scene that is included")
        for name, _ in scene.cameras:
            site_camera = replace(name, value=self._site_camera(name))
            check_name_is_free(site_camera, used, "camera", self._diagnostics)
            used[site_camera.value] = f"the camera that this file calls `{name.value}`"

    def _site_camera(self, name: TextField) -> str:
        return self._site_cameras.get(name.value, name.value)

    def _robot(self, robot: declared.Robot) -> RobotMount:
        return RobotMount(robot.mount.value == "carriage", self._numbers.point(robot.at))

    def _variation(self, ranges: declared.SceneRanges) -> SceneVariation:
        return SceneVariation(self._numbers.factors(ranges.light), self._numbers.factors(ranges.sensors))

    def _camera(self, camera: declared.Camera) -> SceneCamera:
        number = self._numbers
        angle = None if camera.field_of_view is None else degrees(number.angle(camera.field_of_view))
        if angle is not None and not 1.0 <= angle <= 170.0:
            number.report("a field of view is from 1 to 170 deg", camera.span)
            angle = None
        up = (0.0, 0.0, 1.0)
        if camera.up is not None:
            x, y, z = (float(part.value) for part in camera.up)
            up = (x, y, z)
        eye, target = number.point(camera.eye), number.point(camera.target)
        if _looks_along(eye, target, up):
            number.report(
                "a camera has its `target` away from its `eye`, and looks another way than `up`",
                camera.span,
                "write `up: [1, 0, 0]` for one that looks straight down",
            )
        width, height = _DEFAULT_SIZE if camera.size is None else (part.value for part in camera.size)
        return SceneCamera(
            "cell" if camera.on is None else camera.on.value,
            eye,
            target,
            up,
            _DEFAULT_FIELD_OF_VIEW if angle is None else angle,
            width,
            height,
            camera.at_start is not None and camera.at_start.value,
        )

    def _instrument(self, instrument: declared.Instrument) -> Instrument | None:
        present = [
            word for word in ("load", "position", "joint", "force") if getattr(instrument, word) is not None
        ]
        if len(present) != 1:
            self._numbers.report(
                "an instrument needs exactly one of `load`, `position`, `joint` and `force`", instrument.span
            )
            return None
        if instrument.force is not None:
            first, second = (self._part(part, "link") for part in instrument.force)
            return None if first is None or second is None else ForceInstrument(first, second)
        if instrument.load is not None:
            under = self._part(instrument.load, "link")
            return None if under is None else LoadInstrument(under)
        if instrument.position is not None:
            of = self._part(instrument.position, "link")
            return None if of is None else PositionInstrument(of)
        assert instrument.joint is not None  # noqa: S101  for the type checker
        joint = self._part(instrument.joint, "joint")
        return None if joint is None else JointInstrument(joint)

    def _part(self, reference: TextField, what: str) -> BodyPart | None:
        return resolve_part(reference, self._found.bodies, what, self._diagnostics)

    def _region(self, region: declared.Region) -> Region:
        if region.of is not None:
            resolve_name(region.of, dict(self._placed()), "a place or body of this scene", self._diagnostics)
        low, high = self._numbers.point(region.low), self._numbers.point(region.high)
        if not all(a < b for a, b in zip(low, high, strict=True)):
            self._numbers.report("each coordinate of `low` is below that of `high`", region.span)
        return Region(None if region.of is None else region.of.value, low, high)

    def _placed(self) -> Iterable[tuple[str, Placement]]:
        return self._found.placements()

    def _coating(self, coating: declared.Coating) -> Coating:
        number = self._numbers
        for body in (coating.on, coating.wiped_by):
            resolve_name(body, self._found.bodies, "a body of this scene", self._diagnostics)
        (left, near), (right, far) = (
            (number.coordinate(corner[0]), number.coordinate(corner[1]))
            for corner in (coating.low, coating.high)
        )
        (cell,) = number.lengths((coating.cell,))
        if left + cell > right or near + cell > far:
            number.report("`low` and `high` are at least a `cell` apart", coating.span)
        red, green, blue = (float(share.value) for share in coating.colour)
        r, g, b = (float(share.value) for share in coating.under)
        return Coating(
            (left, near),
            (right, far),
            coating.on.value,
            coating.wiped_by.value,
            number.edges(coating.face),
            number.force(coating.force),
            number.distance(coating.gap),
            cell,
            (red, green, blue),
            (r, g, b),
        )

    def _add_conditions(self, scene: declared.Scene) -> None:
        """Elaborate conditions, seals, timers and truth, each of which may use those before it."""
        scope = SceneScope(self._found, self._diagnostics)
        for name, text in scene.conditions:
            self._add("conditions", {name.value: scope.condition(text)})
            scope.add_condition(name.value)
        for name, seal in scene.seals:
            self._add("seals", {name.value: self._seal(seal, scope)})
            scope.add_condition(name.value)
        for name, timer in scene.timers:
            self._add("timers", {name.value: scope.condition(timer.while_)})
            scope.add_timer(name.value)
        self._add_truth(scene, scope)

    def _add_truth(self, scene: declared.Scene, scope: SceneScope) -> None:
        """Elaborate each truth, for all values of the parameters that it speaks of."""
        things = {name.value: dict(values) for name, values in scene.parameters}
        known = {
            name: {value.value: thing.value for value, thing in values.items()}
            for name, values in things.items()
        }
        depends: dict[str, set[str]] = {}
        for name, text in scene.truth:
            full = _full_name(name.value, scene)
            earlier = scope.depends_on(text, depends)
            parameters = sorted(scope.depends_on(text, known).union(*(depends[one] for one in earlier)))
            for values in product(*(known[one] for one in parameters)):
                stated = dict(zip(parameters, values, strict=True))
                for one in earlier:
                    own = {each: stated[each] for each in depends[one]}
                    scope.add_condition(one, truth_name(_full_name(one, scene), own))
                aliases = {one: known[one][value] for one, value in stated.items()}
                names = [truth_name(full, stated)] if stated else self._names_of_truth(full)
                self._add("truth", dict.fromkeys(names, scope.truth(text, aliases)))
            depends[name.value] = set(parameters)
            scope.add_condition(name.value, full)
        used = set().union(*depends.values())
        check_parameters_are_used(scene, used, self._found.truth, self._diagnostics)

    def _names_of_truth(self, variable: str) -> list[str]:
        """Return the names that included scenes have for the truth of a variable, or else the variable."""
        return [name for name in self._found.truth if name.partition("(")[0] == variable] or [variable]

    def _seal(self, seal: declared.Seal, scope: SceneScope) -> Seal | None:
        joint, when = self._part(seal.joint, "joint"), scope.condition(seal.when)
        if joint is None or when is None:
            return None
        return Seal(joint, self._numbers.joint_friction(seal.friction, self._kind(joint)), when)

    def _kind(self, joint: BodyPart) -> str:
        shape = self._found.bodies[joint.body].shape
        return shape.joints[joint.part or ""] if isinstance(shape, UrdfModel) else "revolute"

    def _press(self, press: declared.Press) -> Press | None:
        number = self._numbers
        lid, folds = self._part(press.lid, "joint"), self._part(press.folds, "joint")
        handle = self._part(press.handle.link, "link")
        resolve_name(press.filling, self._found.bodies, "a body of this scene", self._diagnostics)
        resolve_name(press.inside, self._found.regions, "a region of this scene", self._diagnostics)
        resolve_name(press.seal, self._found.seals, "a seal of this scene", self._diagnostics)
        if lid is None or folds is None or handle is None:
            return None
        (radius,) = number.lengths((press.handle.radius,))
        low, high = (number.angle(text) for text in press.range)
        return Press(
            lid,
            handle,
            radius,
            number.pair(press.handle.size),
            (low, high),
            folds,
            number.point(press.hinge),
            number.point(press.at),
            number.distance(press.within),
            number.distance(press.gap),
            press.filling.value,
            press.inside.value,
            press.seal.value,
        )


def _looks_along(eye: Sequence[float], target: Sequence[float], up: Sequence[float]) -> bool:
    """Return True if a camera looks nowhere, or along the direction that is up in its picture."""
    (x, y, z), (right, ahead, above) = (b - a for a, b in zip(eye, target, strict=True)), up
    across = hypot(y * above - z * ahead, z * right - x * above, x * ahead - y * right)
    return across <= _LEAST_SINE * hypot(x, y, z) * hypot(*up)


def _full_name(variable: str, scene: declared.Scene) -> str:
    """Return the full name of a variable that stands under `truth`."""
    return variable if scene.module is None or "." in variable else f"{scene.module.value}.{variable}"


def _each(declared_things: MappingField[_T], elaborate: Callable[[_T], object]) -> dict[str, object]:
    return {name.value: elaborate(thing) for name, thing in declared_things}
