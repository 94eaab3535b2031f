"""Read a scene file: check it, report every problem with its place, and convert units."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Final

from aeros.sim.bullet.bodies import GREY, Box, Cylinder, SceneBody, UrdfModel
from aeros.sim.robot.urdf import check_urdf
from aeros.sim.shipped_files import find_file, shipped_files
from aeros.spec.declared import scene as declared
from aeros.spec.declared.decode import decode
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.elaborate.expressions import elaborate_quantity
from aeros.spec.expr.units import ANGLE, LENGTH, MASS, Dimension
from aeros.spec.text.fields import TextField
from aeros.spec.text.files import read_source
from aeros.spec.text.yaml_reader import read_yaml

_MAX_COORDINATE: Final = 10
"""Greatest coordinate in W, m; positions in a site file have the same bound."""

_MAX_LENGTH: Final = 20
_MIN_LENGTH: Final = Fraction(1, 1000)
"""Lengths of a body, m: thinner ones fall through others within a tick."""

_MAX_MASS: Final = 1000
_MIN_MASS: Final = Fraction(1, 1000)
"""Mass of a movable body, kg: contacts with lighter bodies are no longer solved."""

_MAX_ANGLE: Final = 7
"""Greatest absolute angle, rad: one turn either way."""

_DEFAULT_FRICTION: Final = 0.6

_SHAPES: Final = ("box", "cylinder", "urdf")


def shipped_scenes() -> dict[str, Path]:
    """List the scene files that come with AEROS.

    Returns:
        Their paths by name.
    """
    return shipped_files("scenes")


def read_bodies(name_or_path: str) -> tuple[SceneBody, ...]:
    """Read a scene file.

    Args:
        name_or_path: a path, or the name of a shipped file.

    Returns:
        The bodies, in the order of the file.

    Raises:
        UserError: there is no such file, or it has problems.
    """
    path = Path(find_file(name_or_path, shipped_scenes(), "scene file"))
    diagnostics = Diagnostics()
    node = read_yaml(read_source(path), diagnostics)
    file = None if node is None else decode(node, declared.Scene, diagnostics)
    bodies = (
        []
        if file is None
        else [_body(name.value, declaration, path.parent, diagnostics) for name, declaration in file.bodies]
    )
    diagnostics.raise_if_errors()
    return tuple(body for body in bodies if body is not None)


def _body(
    name: str, declaration: declared.SceneBody, folder: Path, diagnostics: Diagnostics
) -> SceneBody | None:
    """Convert a declared body; None if it has a problem, which is reported."""
    x, y, z = (
        _bounded_quantity(part, LENGTH, -_MAX_COORDINATE, _MAX_COORDINATE, diagnostics)
        for part in declaration.at
    )
    yaw = (
        0.0
        if declaration.yaw is None
        else _bounded_quantity(declaration.yaw, ANGLE, -_MAX_ANGLE, _MAX_ANGLE, diagnostics)
    )
    mass = (
        0.0
        if declaration.mass is None
        else _bounded_quantity(declaration.mass, MASS, _MIN_MASS, _MAX_MASS, diagnostics)
    )
    friction = _DEFAULT_FRICTION if declaration.friction is None else float(declaration.friction.value)
    shape = _shape(name, declaration, folder, diagnostics)
    if shape is None:
        return None
    if isinstance(shape, UrdfModel):
        if declaration.mass is not None:
            _report(
                "the model's file sets its mass",
                declaration.mass.span,
                diagnostics,
                "write `loose: true`",
            )
        mass = float(declaration.loose is not None and declaration.loose.value)
    elif declaration.loose is not None:
        _report(
            "`loose` is only valid with `urdf`",
            declaration.loose.span,
            diagnostics,
            "give it a `mass` to make it movable",
        )
    colour = GREY
    if declaration.colour is not None:
        red, green, blue = (float(part.value) for part in declaration.colour)
        colour = (red, green, blue, 1.0)
    return SceneBody(
        name,
        shape,
        (x, y, z),
        yaw,
        mass,
        friction,
        colour,
        declaration.at[0].span.merge(declaration.at[2].span),
    )


def _shape(
    name: str, declaration: declared.SceneBody, folder: Path, diagnostics: Diagnostics
) -> Box | Cylinder | UrdfModel | None:
    present = [word for word in _SHAPES if getattr(declaration, word) is not None]
    if len(present) != 1:
        listed = " and ".join(f"`{word}`" for word in present) or "none"
        _report(
            f"`{name}` needs exactly one of `box`, `cylinder`, `urdf`; it has {listed}",
            declaration.span,
            diagnostics,
        )
        return None
    if declaration.box is not None:
        length, width, height = (
            _bounded_quantity(part, LENGTH, _MIN_LENGTH, _MAX_LENGTH, diagnostics) for part in declaration.box
        )
        return Box((length, width, height))
    if declaration.cylinder is not None:
        radius, height = (
            _bounded_quantity(part, LENGTH, _MIN_LENGTH, _MAX_LENGTH, diagnostics)
            for part in declaration.cylinder
        )
        return Cylinder(radius, height)
    assert declaration.urdf is not None  # noqa: S101  for the type checker
    return _model(name, declaration.urdf, folder, diagnostics)


def _model(name: str, path_text: TextField, folder: Path, diagnostics: Diagnostics) -> UrdfModel | None:
    path = folder / path_text.value
    if not path.is_file():
        diagnostics.error(
            "AE002",
            f"there is no file `{path}`, the model of `{name}`",
            path_text.span,
            help=("put it there; `urdf` counts from the scene file's own folder",),
        )
        return None
    check_urdf(path, diagnostics)
    return UrdfModel(str(path))


def _bounded_quantity(
    text: TextField, dimension: Dimension, low: int | Fraction, high: int, diagnostics: Diagnostics
) -> float:
    """Convert a quantity to SI; 1 if it has a problem, which is reported."""
    value = elaborate_quantity(text, dimension, diagnostics)
    if value is None:
        return 1.0
    if low <= value <= high:
        return float(value)
    help_ = f"write a value from {float(low):g} to {high} {dimension}"
    diagnostics.error("AE111", f"`{text.value}` is outside its bounds", text.span, help=(help_,))
    return 1.0


def _report(headline: str, span: SourceSpan, diagnostics: Diagnostics, *help_: str) -> None:
    diagnostics.error("AE208", headline, span, help=help_)
