"""Schema of a scene file, unresolved: bodies that stand and lie about besides a task's own things.

Lengths, angles and masses are still text; `aeros.sim.bullet.scene_file` gives them meaning.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

from aeros.spec.declared.field_types import Named
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.text.fields import BooleanField, LengthBounds, NumberField, TextField, ValueBounds

Share = Annotated[NumberField, ValueBounds(0, 1)]


@dataclass(frozen=True)
class SceneBody:
    """One body: exactly one of `box`, `cylinder` and `urdf`.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    at: Annotated[tuple[TextField, ...], LengthBounds(3, 3)] = field(
        metadata={"doc": "x, y and z in W of its centre, or of the frame of its `urdf`"}
    )
    box: Annotated[tuple[TextField, ...], LengthBounds(3, 3)] | None = field(
        default=None, metadata={"doc": "full lengths of its edges along its own x, y and z"}
    )
    cylinder: Annotated[tuple[TextField, ...], LengthBounds(2, 2)] | None = field(
        default=None, metadata={"doc": "radius and height about its own z, as in `cylinder: [40 mm, 12 cm]`"}
    )
    urdf: TextField | None = field(
        default=None,
        metadata={"doc": "a URDF file, from this file's folder, as in `urdf: models/vase.urdf`"},
    )
    yaw: TextField | None = field(
        default=None,
        metadata={"doc": "rotation about z of W; 0 deg if absent, as in `yaw: 30 deg`"},
    )
    mass: TextField | None = field(
        default=None, metadata={"doc": "mass of a box or cylinder; fixed to W if absent"}
    )
    loose: BooleanField | None = field(
        default=None,
        metadata={
            "doc": "with `urdf`: `true` if its base can move; fixed to W if absent, as in `loose: true`"
        },
    )
    friction: Annotated[NumberField, ValueBounds(0, 10)] | None = field(
        default=None, metadata={"doc": "its Coulomb coefficient; 0.6 if absent, as in `friction: 0.3`"}
    )
    colour: Annotated[tuple[Share, ...], LengthBounds(3, 3)] | None = field(
        default=None, metadata={"doc": "red, green and blue, each from 0 to 1; grey if absent"}
    )


@dataclass(frozen=True)
class Scene:
    """A whole scene file.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    schema: Literal["aeros/scene/1"] = field(metadata={"doc": "`schema: aeros/scene/1`"})
    description: TextField = field(metadata={"doc": "the scene's purpose, for people"})
    bodies: Annotated[Named[SceneBody], LengthBounds(1, 100)] = field(metadata={"doc": "the bodies, by name"})
