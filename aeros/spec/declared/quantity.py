"""Schema of a quantity, which sites and modules declare alike: type, unit and bounds."""

from __future__ import annotations

from dataclasses import dataclass, field

from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.text.fields import NumberField, TextField


@dataclass(frozen=True)
class Quantity:
    """A typed variable: its type, unit and bounds.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    type: TextField = field(
        metadata={"doc": "`bool`, `int`, `real`, `vec3` or the name of an enum, as in `type: real`"}
    )
    unit: TextField | None = field(default=None, metadata={"doc": "the unit of `range`, as in `unit: mm/s`"})
    range: tuple[NumberField, ...] | None = field(
        default=None, metadata={"doc": "lowest and highest value, as in `range: [0, 3]`"}
    )
    description: TextField | None = field(default=None, metadata={"doc": "its meaning, for people"})
