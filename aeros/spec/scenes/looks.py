"""Elaboration of looks: the parts by which films show a body."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Final, Literal, get_args

from aeros.spec.declared import scene as declared
from aeros.spec.diagnostics.codes import Diagnostics, did_you_mean
from aeros.spec.model.scene import GREY, Colour, LookPart, Shape, UrdfModel, Vector
from aeros.spec.scenes.quantities import Quantities
from aeros.spec.text.fields import TextField

_Kind = Literal["box", "ellipsoid", "capsule", "cylinder", "sphere"]
_KINDS: Final[tuple[_Kind, ...]] = get_args(_Kind)


class LookElaborator:
    """Elaborates the looks of one file.

    Args:
        quantities: elaborates numbers.
        looks: the declared looks by name.
    """

    def __init__(self, quantities: Quantities, looks: Mapping[str, declared.Look]) -> None:
        self._numbers = quantities
        self._looks = looks

    def look(self, name: TextField | None, shape: Shape) -> tuple[LookPart, ...]:
        """Elaborate what films show of a body.

        Args:
            name: name of its look; None for none.
            shape: shape of the body.

        Returns:
            The parts; empty without a look. What is malformed is reported.
        """
        if name is None or not self._is_known(name, self._looks, "look"):
            return ()
        parts = (self._part(part, shape) for part in self._looks[name.value].parts)
        return tuple(part for part in parts if part is not None)

    def _part(self, part: declared.LookPart, shape: Shape) -> LookPart | None:
        number = self._numbers
        kinds = [kind for kind in _KINDS if getattr(part, kind) is not None]
        if len(kinds) != 1:
            number.report(
                "a part of a look has exactly one shape", part.span, f"write one of {', '.join(_KINDS)}"
            )
            return None
        (kind,) = kinds
        links, joints = (shape.links, shape.joints) if isinstance(shape, UrdfModel) else ((), {})
        if part.link is not None and not self._is_known(part.link, links, "link"):
            return None
        shown = (0.0, 0.0)
        if part.joint is not None:
            if part.range is None:
                number.report("`joint` needs a `range`", part.joint.span)
                return None
            if not self._is_known(part.joint, joints, "movable joint"):
                return None
            low, high = (number.joint_position(text, joints[part.joint.value]) for text in part.range)
            shown = (low, high)
        return LookPart(
            kind,
            self._size(part, kind),
            _colour(part),
            1.0 if part.opacity is None else float(part.opacity.value),
            number.point(part.at),
            self._tilt(part),
            None if part.link is None else part.link.value,
            None if part.joint is None else part.joint.value,
            shown,
        )

    def _size(self, part: declared.LookPart, kind: _Kind) -> Vector:
        value = getattr(part, kind)
        match kind:
            case "box" | "ellipsoid":
                return self._numbers.edges(value)
            case "capsule" | "cylinder":
                return (*self._numbers.pair(value), 0.0)
            case "sphere":
                (radius,) = self._numbers.lengths((value,))
                return (radius, 0.0, 0.0)

    def _tilt(self, part: declared.LookPart) -> Vector:
        if part.tilt is None:
            return (0.0, 0.0, 0.0)
        x, y, z = (self._numbers.angle(text) for text in part.tilt)
        return (x, y, z)

    def _is_known(self, name: TextField, among: Collection[str], sort: str) -> bool:
        headline = f"there is no {sort} `{name.value}` for this body"
        return is_known(name, among, self._numbers.diagnostics, headline, "there is")


def is_known(
    name: TextField, among: Collection[str], diagnostics: Diagnostics, headline: str, listing: str
) -> bool:
    """Check if a name is one of some, and report an error if it is not.

    Args:
        name: as it is written.
        among: the names that there are.
        diagnostics: gets the error.
        headline: of the error.
        listing: words before the list of names, which is the cure if none is near.

    Returns:
        True if it is.
    """
    if name.value in among:
        return True
    near = did_you_mean(name.value, among)
    listed = ", ".join(f"`{one}`" for one in among) or "none"
    cure = f"did you mean `{near}`?" if near else f"{listing} {listed}"
    diagnostics.error("AE122", headline, name.span, help=(cure,))
    return False


def _colour(part: declared.LookPart) -> Colour:
    if part.colour is None:
        return GREY
    red, green, blue = (float(share.value) for share in part.colour)
    return (red, green, blue)
