"""Schema of the objects of a site: what people may ask for, and how perceivers recognize it."""

from __future__ import annotations

from dataclasses import dataclass, field

from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.text.fields import NumberField, TextField


@dataclass(frozen=True)
class ObjectKind:
    """Kind of object that the robot may be asked for.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    words: tuple[TextField, ...] = field(
        metadata={"doc": "the phrases for it, in the singular, as in `words: [cup, small cup]`"}
    )
    box: tuple[TextField, ...] | None = field(
        default=None,
        metadata={"doc": "its size along x, y and z as it stands, as in `box: [4 cm, 4 cm, 5 cm]`"},
    )
    cylinder: tuple[TextField, ...] | None = field(
        default=None, metadata={"doc": "its radius and height, as in `cylinder: [22 mm, 8 cm]`"}
    )
    colour: tuple[NumberField, ...] | None = field(
        default=None, metadata={"doc": "red, green and blue, from 0 to 1, as in `colour: [0.8, 0.1, 0.08]`"}
    )
    description: TextField | None = field(default=None, metadata={"doc": "its meaning, for people"})
