"""Elaboration of bounded quantities to plain numbers in SI units."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Final

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.elaborate.expressions import elaborate_quantity
from aeros.spec.expr.units import ANGLE, FORCE, LENGTH, MASS, Dimension
from aeros.spec.model.scene import Pair, Vector
from aeros.spec.text.fields import NumberField, TextField

MAX_COORDINATE: Final = 10
"""Greatest coordinate in W, m; positions in a site file have the same bound."""

_MAX_LENGTH: Final = 20
_MIN_LENGTH: Final = Fraction(1, 1000)
"""Lengths of a body, m: thinner ones fall through others within a tick."""

_MAX_MASS: Final = 1000
_MIN_MASS: Final = Fraction(1, 1000)
"""Mass of a movable body, kg: contacts with lighter bodies are no longer solved."""

_MAX_ANGLE: Final = 7
"""Greatest absolute angle, rad: one turn either way."""

_MAX_FORCE: Final = 1000


class Quantities:
    """Elaborates quantities of one file; a malformed one is reported and counts as 1.

    Args:
        diagnostics: receives the faults.
    """

    def __init__(self, diagnostics: Diagnostics) -> None:
        self.diagnostics = diagnostics

    def bounded(self, text: TextField, dimension: Dimension, low: int | Fraction, high: int) -> float:
        """Elaborate a quantity within bounds.

        Args:
            text: the field.
            dimension: dimension that it must have.
            low: least value, SI.
            high: greatest value, SI.

        Returns:
            The value, SI.
        """
        value = elaborate_quantity(text, dimension, self.diagnostics)
        if value is None:
            return 1.0
        if low <= value <= high:
            return float(value)
        help_ = f"write a value from {float(low):g} to {high} {dimension}"
        self.diagnostics.error("AE111", f"`{text.value}` is outside its bounds", text.span, help=(help_,))
        return 1.0

    def point(self, texts: Sequence[TextField] | None) -> Vector:
        """Elaborate coordinates.

        Args:
            texts: x, y and z; None for the origin.

        Returns:
            The point, m.
        """
        if texts is None:
            return (0.0, 0.0, 0.0)
        x, y, z = (self.coordinate(text) for text in texts)
        return (x, y, z)

    def coordinate(self, text: TextField) -> float:
        """Elaborate a coordinate.

        Args:
            text: the field.

        Returns:
            The coordinate, m.
        """
        return self.bounded(text, LENGTH, -MAX_COORDINATE, MAX_COORDINATE)

    def lengths(self, texts: Sequence[TextField]) -> tuple[float, ...]:
        """Elaborate lengths of a body.

        Args:
            texts: the fields.

        Returns:
            The lengths, m.
        """
        return tuple(self.bounded(text, LENGTH, _MIN_LENGTH, _MAX_LENGTH) for text in texts)

    def edges(self, texts: Sequence[TextField]) -> Vector:
        """Elaborate three edges of a body.

        Args:
            texts: the fields.

        Returns:
            The lengths, m.
        """
        x, y, z = self.lengths(texts)
        return (x, y, z)

    def pair(self, texts: Sequence[TextField]) -> tuple[float, float]:
        """Elaborate two lengths of a body.

        Args:
            texts: the fields.

        Returns:
            The lengths, m.
        """
        first, second = self.lengths(texts)
        return (first, second)

    def distance(self, text: TextField | None) -> float:
        """Elaborate a length that may be 0.

        Args:
            text: the field; None for 0.

        Returns:
            The length, m.
        """
        return 0.0 if text is None else self.bounded(text, LENGTH, 0, _MAX_LENGTH)

    def spread(self, texts: Sequence[TextField] | None) -> Vector:
        """Elaborate greatest random offsets.

        Args:
            texts: along x, y and z; None for none.

        Returns:
            The offsets, m.
        """
        if texts is None:
            return (0.0, 0.0, 0.0)
        x, y, z = (self.distance(text) for text in texts)
        return (x, y, z)

    def angle(self, text: TextField | None) -> float:
        """Elaborate an angle.

        Args:
            text: the field; None for 0.

        Returns:
            The angle, rad.
        """
        return 0.0 if text is None else self.bounded(text, ANGLE, -_MAX_ANGLE, _MAX_ANGLE)

    def mass(self, text: TextField | None) -> float:
        """Elaborate a mass.

        Args:
            text: the field; None for 0.

        Returns:
            The mass, kg.
        """
        return 0.0 if text is None else self.bounded(text, MASS, _MIN_MASS, _MAX_MASS)

    def force(self, text: TextField) -> float:
        """Elaborate a force.

        Args:
            text: the field.

        Returns:
            The force, N.
        """
        return self.bounded(text, FORCE, 0, _MAX_FORCE)

    def joint_friction(self, text: TextField | None, kind: str) -> float:
        """Elaborate the dry friction of a joint.

        Args:
            text: the field; None for 0.
            kind: type of the joint, as in URDF.

        Returns:
            The friction, N·m or, of a prismatic joint, N.
        """
        dimension = FORCE if kind == "prismatic" else FORCE * LENGTH
        return 0.0 if text is None else self.bounded(text, dimension, 0, _MAX_FORCE)

    def joint_position(self, text: TextField, kind: str) -> float:
        """Elaborate a position of a joint.

        Args:
            text: the field.
            kind: type of the joint, as in URDF.

        Returns:
            The position, rad or, of a prismatic joint, m.
        """
        return self.coordinate(text) if kind == "prismatic" else self.angle(text)

    def report(self, headline: str, span: SourceSpan, *help_: str) -> None:
        """Report an inconsistent declaration.

        Args:
            headline: the fault.
            span: its place.
            *help_: what to do.
        """
        self.diagnostics.error("AE208", headline, span, help=help_)

    def factors(self, pair: tuple[NumberField, ...] | None) -> Pair:
        """Elaborate the least and the greatest factor of a range.

        Args:
            pair: the two numbers; None for a range that holds 1 alone.

        Returns:
            Both.
        """
        if pair is None:
            return (1.0, 1.0)
        low, high = (float(one.value) for one in pair)
        if low > high:
            self.report("the first factor is at most the second", pair[0].span.merge(pair[1].span))
        return (low, high)
