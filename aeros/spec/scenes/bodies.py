"""Elaboration of the bodies of a scene: shapes, placements, friction and grips."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Final

from aeros.spec.declared import scene as declared
from aeros.spec.diagnostics.codes import did_you_mean
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.model.scene import (
    GREY,
    AlternativePlace,
    Basin,
    BodyVariation,
    Box,
    Colour,
    Compound,
    Cylinder,
    Grip,
    Joint,
    Part,
    Placement,
    SceneBody,
    Shape,
    Sphere,
    UrdfModel,
)
from aeros.spec.scenes.looks import LookElaborator, is_known
from aeros.spec.scenes.quantities import Quantities
from aeros.spec.scenes.urdf import check_urdf
from aeros.spec.text.fields import NumberField, TextField

_DEFAULT_FRICTION: Final = 0.6

_DEFAULT_SPINNING: Final = 0.02
"""Friction about a contact's normal, m: without it, gripped cylinders turn in fingers (47 of 100 picks)."""

_PRIMITIVES: Final = ("box", "cylinder", "sphere")
_SHAPES: Final = (*_PRIMITIVES, "basin", "compound", "urdf")
_OF_URDF: Final = ("loose", "surfaces", "underside", "links", "joints")


class BodyElaborator:
    """Elaborates places and bodies of one file.

    Args:
        quantities: elaborates numbers.
        folder: folder of the file, from which `urdf` counts.

    Attributes:
        looks: elaborates looks; the scene's, once they are declared.
    """

    def __init__(self, quantities: Quantities, folder: Path) -> None:
        self._numbers = quantities
        self._folder = folder
        self.looks = LookElaborator(quantities, {})

    def placement(
        self, name: str, place: declared.Place | declared.SceneBody, known: Collection[str]
    ) -> Placement:
        """Elaborate where a place or body is.

        Args:
            name: its name.
            place: the declaration.
            known: names of the places and bodies above it.

        Returns:
            The placement; what is malformed is reported.
        """
        number = self._numbers
        frame = None if place.from_ is None else self._known(place.from_, known)
        anchor, alternative = (0.0, 0.0, 0.0), None
        if isinstance(place, declared.SceneBody):
            anchor = number.point(place.anchor)
            if place.alternative is not None:
                away = self._known(place.alternative.farther_from, known)
                alternative = AlternativePlace(number.point(place.alternative.at), away)
        return Placement(
            frame,
            number.point(place.at),
            number.angle(place.yaw),
            number.spread(place.spread),
            number.angle(place.yaw_spread),
            name if place.stream is None else place.stream.value,
            anchor,
            alternative,
        )

    def body(self, name: str, body: declared.SceneBody, known: Collection[str]) -> SceneBody | None:
        """Elaborate a body.

        Args:
            name: its name.
            body: the declaration.
            known: names of the places and bodies above it.

        Returns:
            The body; None after reporting that its shape is malformed.
        """
        placement = self.placement(name, body, known)
        mass = self._numbers.mass(body.mass)
        colour = _colour(body.colour, GREY)
        shape = self._shape(name, body, colour)
        if shape is None:
            return None
        if isinstance(shape, UrdfModel):
            if body.mass is not None:
                self._numbers.report("the model's file sets its mass", body.mass.span, "write `loose: true`")
            mass = float(body.loose is not None and body.loose.value)
        else:
            self._reject_fields_of_urdf(body)
        return SceneBody(
            name,
            shape,
            placement,
            mass,
            _number(body.friction, _DEFAULT_FRICTION),
            _number(body.spinning, _DEFAULT_SPINNING),
            self._numbers.distance(body.rolling_resistance),
            colour,
            self._grip(body, shape) if mass > 0.0 else None,
            body.at[0].span.merge(body.at[2].span),
            self.looks.look(body.look, shape),
            None if body.randomise is None else self._variation(body.randomise, shape, mass),
        )

    def _variation(self, ranges: declared.BodyRanges, shape: Shape, mass: float) -> BodyVariation:
        """Elaborate the ranges of a body; those of what its model's file sets are reported."""
        numbers = self._numbers
        if isinstance(shape, UrdfModel) and (ranges.mass is not None or ranges.colour is not None):
            numbers.report(
                "the model's file sets its mass and colours", ranges.span, "vary friction or place"
            )
        elif ranges.mass is not None and mass == 0.0:
            numbers.report("a body that is fixed to W has no mass to vary", ranges.span, "give it a `mass`")
        return BodyVariation(
            numbers.factors(ranges.mass),
            numbers.factors(ranges.friction),
            _number(ranges.colour, 0.0),
            numbers.spread(ranges.spread),
            numbers.angle(ranges.yaw_spread),
        )

    def _known(self, name: TextField, known: Collection[str]) -> str:
        if name.value not in known:
            near = did_you_mean(name.value, known)
            self._numbers.diagnostics.error(
                "AE122",
                f"no place or body `{name.value}` is declared above",
                name.span,
                help=(f"did you mean `{near}`?" if near else "declare it first",),
            )
        return name.value

    def _reject_fields_of_urdf(self, body: declared.SceneBody) -> None:
        for field, value in ((word, getattr(body, word)) for word in _OF_URDF):
            if value is not None and not (hasattr(value, "__len__") and len(value) == 0):
                help_ = "give it a `mass` to make it movable" if field == "loose" else "remove it"
                self._numbers.report(
                    f"`{field}` is only valid with `urdf`", _span_of(value, body.span), help_
                )

    def _grip(self, body: declared.SceneBody, shape: Shape) -> Grip | None:
        if body.grip is not None:
            return Grip(self._numbers.point(body.grip.low), self._numbers.point(body.grip.high))
        match shape:
            case Box((x, y, z)):
                return _centred(x, y, z)
            case Cylinder(radius, height):
                return _centred(2.0 * radius, 2.0 * radius, height)
            case Sphere(radius):
                return _centred(2.0 * radius, 2.0 * radius, 2.0 * radius)
        return None

    def _shape(self, name: str, body: declared.SceneBody, colour: Colour) -> Shape | None:
        if not self._has_one(name, body, _SHAPES):
            return None
        if body.basin is not None:
            return Basin(self._numbers.edges(body.basin))
        if body.compound is not None:
            parts = [self._part(name, part, colour) for part in body.compound]
            return Compound(tuple(part for part in parts if part is not None))
        if body.urdf is not None:
            return self._model(name, body, body.urdf)
        return self._primitive(body)

    def _part(self, name: str, part: declared.Part, colour: Colour) -> Part | None:
        if not self._has_one(f"a part of {name}", part, _PRIMITIVES):
            return None
        return Part(self._primitive(part), self._numbers.point(part.at), _colour(part.colour, colour))

    def _primitive(self, of: declared.SceneBody | declared.Part) -> Box | Cylinder | Sphere:
        if of.box is not None:
            return Box(self._numbers.edges(of.box))
        if of.cylinder is not None:
            return Cylinder(*self._numbers.pair(of.cylinder))
        assert of.sphere is not None  # noqa: S101  for the type checker
        (radius,) = self._numbers.lengths((of.sphere,))
        return Sphere(radius)

    def _has_one(self, name: str, of: declared.SceneBody | declared.Part, words: tuple[str, ...]) -> bool:
        present = [word for word in words if getattr(of, word) is not None]
        if len(present) == 1:
            return True
        listed = " and ".join(f"`{word}`" for word in present) or "none"
        options = ", ".join(f"`{word}`" for word in words)
        self._numbers.report(f"`{name}` needs exactly one of {options}; it has {listed}", of.span)
        return False

    def _model(self, name: str, body: declared.SceneBody, path_text: TextField) -> UrdfModel | None:
        path = self._folder / path_text.value
        if not path.is_file():
            self._numbers.diagnostics.error(
                "AE002",
                f"there is no file `{path}`, the model of `{name}`",
                path_text.span,
                help=("put it there; `urdf` counts from the scene file's own folder",),
            )
            return None
        names = check_urdf(path, self._numbers.diagnostics)
        for link, _ in body.links:
            self._require(link, names.links, "link")
        settings = {}
        for joint, declaration in body.joints:
            if self._require(joint, names.joints, "movable joint"):
                settings[joint.value] = self._joint(declaration, names.joints[joint.value])
        return UrdfModel(
            str(path),
            names.links,
            names.joints,
            {link.value: float(friction.value) for link, friction in body.links},
            settings,
            self._numbers.distance(body.underside),
            tuple(
                (self._numbers.point(surface.at), self._numbers.pair(surface.size))
                for surface in body.surfaces
            ),
        )

    def _require(self, name: TextField, among: Collection[str], what: str) -> bool:
        headline = f"the model has no {what} `{name.value}`"
        return is_known(name, among, self._numbers.diagnostics, headline, "it has")

    def _joint(self, joint: declared.Joint, kind: str) -> Joint:
        number = self._numbers
        limits = None
        if joint.range is not None:
            low, high = (number.joint_position(text, kind) for text in joint.range)
            limits = (low, high)
            if low >= high:
                number.report("the range of a joint ends above its start", joint.range[0].span)
        return Joint(number.joint_friction(joint.friction, kind), limits)


def _centred(x: float, y: float, z: float) -> Grip:
    return Grip((-x / 2, -y / 2, -z / 2), (x / 2, y / 2, z / 2))


def _colour(shares: tuple[NumberField, ...] | None, default: Colour) -> Colour:
    if shares is None:
        return default
    red, green, blue = (float(share.value) for share in shares)
    return (red, green, blue)


def _number(field: NumberField | None, default: float) -> float:
    return default if field is None else float(field.value)


def _span_of(value: object, default: SourceSpan) -> SourceSpan:
    first = value[0] if isinstance(value, tuple) else value
    span = getattr(first, "span", None)
    return span if isinstance(span, SourceSpan) else default
