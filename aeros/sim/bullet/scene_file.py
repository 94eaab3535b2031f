"""A scene file → bodies, each fault reported at its place."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Final

from aeros.sim.bullet.bodies import GREY, Body, Box, Cylinder, Model
from aeros.sim.robot.urdf import check_urdf
from aeros.sim.shipped_files import find_file, shipped_files
from aeros.spec.declared import scene as declared
from aeros.spec.declared.decode import decode
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.source import Span
from aeros.spec.elaborate.expressions import elaborate_quantity
from aeros.spec.expr.units import ANGLE, LENGTH, MASS, Dimension
from aeros.spec.text.fields import Text
from aeros.spec.text.files import read_source
from aeros.spec.text.yaml_reader import read_yaml

_FARTHEST: Final = 10
"""How far from W's origin anything is, m: what a site says of places ends there too."""

_LONGEST: Final = 20
_SHORTEST: Final = Fraction(1, 1000)
"""Lengths of a body, m: thinner ones fall through others within a tick."""

_HEAVIEST: Final = 1000
_LIGHTEST: Final = Fraction(1, 1000)
"""What a body that can move weighs, kg: contacts with lighter ones are no longer solved."""

_TURN: Final = 7
"""rad: once round, whichever way."""

_FRICTION: Final = 0.6

_SHAPES: Final = ("box", "cylinder", "urdf")


def shipped_scenes() -> dict[str, Path]:
    """Return the scene files that come with AEROS, by name."""
    return shipped_files("scenes")


def read_bodies(name_or_path: str) -> tuple[Body, ...]:
    """Those of a file, or of a shipped one by its name.  Raises UserError, which says what is wrong."""
    path = Path(find_file(name_or_path, shipped_scenes(), "scene file", "no scene file of that name comes"))
    sink = Diagnostics()
    node = read_yaml(read_source(path), sink)
    found = None if node is None else decode(node, declared.Scene, sink)
    bodies = (
        [] if found is None else [_body(name.value, one, path.parent, sink) for name, one in found.bodies]
    )
    sink.raise_if_errors()
    return tuple(body for body in bodies if body is not None)


def _body(name: str, one: declared.Body, folder: Path, sink: Diagnostics) -> Body | None:
    """As declared; None, and reported, where that is no body."""
    x, y, z = (_within(part, LENGTH, -_FARTHEST, _FARTHEST, sink) for part in one.at)
    yaw = 0.0 if one.yaw is None else _within(one.yaw, ANGLE, -_TURN, _TURN, sink)
    mass = 0.0 if one.mass is None else _within(one.mass, MASS, _LIGHTEST, _HEAVIEST, sink)
    friction = _FRICTION if one.friction is None else float(one.friction.value)
    shape = _shape(name, one, folder, sink)
    if shape is None:
        return None
    if isinstance(shape, Model):
        if one.mass is not None:
            _wrong("a model's mass is what its file says", one.mass.span, sink, "write `loose: true`")
        mass = float(one.loose is not None and one.loose.value)
    elif one.loose is not None:
        _wrong("`loose` goes with `urdf` alone", one.loose.span, sink, "give it a `mass`, and it can move")
    colour = GREY
    if one.colour is not None:
        red, green, blue = (float(part.value) for part in one.colour)
        colour = (red, green, blue, 1.0)
    return Body(name, shape, (x, y, z), yaw, mass, friction, colour, one.at[0].span.cover(one.at[2].span))


def _shape(name: str, one: declared.Body, folder: Path, sink: Diagnostics) -> Box | Cylinder | Model | None:
    there = [word for word in _SHAPES if getattr(one, word) is not None]
    if len(there) != 1:
        said = " and ".join(f"`{word}`" for word in there) or "none"
        _wrong(f"`{name}` needs exactly one of `box`, `cylinder`, `urdf`; it has {said}", one.span, sink)
        return None
    if one.box is not None:
        length, width, height = (_within(part, LENGTH, _SHORTEST, _LONGEST, sink) for part in one.box)
        return Box((length, width, height))
    if one.cylinder is not None:
        radius, height = (_within(part, LENGTH, _SHORTEST, _LONGEST, sink) for part in one.cylinder)
        return Cylinder(radius, height)
    assert one.urdf is not None  # noqa: S101  for the type checker
    return _model(name, one.urdf, folder, sink)


def _model(name: str, written: Text, folder: Path, sink: Diagnostics) -> Model | None:
    path = folder / written.value
    if not path.is_file():
        sink.error(
            "AE002",
            f"there is no file `{path}`, the model of `{name}`",
            written.span,
            help=("put it there; `urdf` counts from the scene file's own folder",),
        )
        return None
    check_urdf(path, sink)
    return Model(str(path))


def _within(text: Text, dimension: Dimension, low: int | Fraction, high: int, sink: Diagnostics) -> float:
    """A quantity in SI; 1 where something is wrong with it, which is reported."""
    value = elaborate_quantity(text, dimension, sink)
    if value is None:
        return 1.0
    if low <= value <= high:
        return float(value)
    help_ = f"write a value from {float(low):g} to {high} {dimension}"
    sink.error("AE111", f"`{text.value}` is outside its bounds", text.span, help=(help_,))
    return 1.0


def _wrong(headline: str, span: Span, sink: Diagnostics, *help_: str) -> None:
    sink.error("AE208", headline, span, help=help_)
