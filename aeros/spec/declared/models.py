"""Schema of the `models:` of a module: files with an interface, and bounds of their outputs."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

from aeros.spec.declared.field_types import Identifier, Named, Slug
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.text.fields import (
    BooleanField,
    ChoiceField,
    IntegerField,
    LengthBounds,
    MappingField,
    NumberField,
    TextField,
    ValueBounds,
)


@dataclass(frozen=True)
class ModelValue:
    """An input or output of a model.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    range: Annotated[tuple[NumberField, ...], LengthBounds(2, 2)] = field(
        metadata={"doc": "lowest and highest value of each number, as in `range: [-0.3, 0.3]`"}
    )
    unit: TextField | None = field(
        default=None, metadata={"doc": "the unit of the numbers in the file and of `range`, as in `unit: mm`"}
    )
    shape: Annotated[tuple[Annotated[IntegerField, ValueBounds(1, 1_000_000)], ...], LengthBounds(0, 4)] = (
        field(default=(), metadata={"doc": "its dimensions, as in `shape: [3]`; without it, one number"})
    )
    description: TextField | None = field(default=None, metadata={"doc": "its meaning, for people"})


@dataclass(frozen=True)
class ModelBox:
    """A box of values: one number holds for every component, or there is one for each.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    lower: tuple[NumberField, ...] | None = field(
        default=None, metadata={"doc": "the lowest values, as in `lower: [0, -0.3, -0.3]`; else the range's"}
    )
    upper: tuple[NumberField, ...] | None = field(
        default=None, metadata={"doc": "the highest values, as in `upper: [0.25]`; else the range's"}
    )


@dataclass(frozen=True)
class ModelBound:
    """Outputs that a model has for every input in a box.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    id: Slug = field(metadata={"doc": "its name, as in `slow-everywhere`"})
    then: Named[ModelBox] = field(
        metadata={"doc": "a box for each output, as in `then: {velocity: {upper: [0.25]}}`"}
    )
    given: Named[ModelBox] = field(
        default=MappingField(), metadata={"doc": "a box for inputs; others have their whole range"}
    )
    runtime_checked: BooleanField | None = field(
        default=None,
        metadata={"doc": "`true` to check the bound at each call where it cannot be proved"},
    )


@dataclass(frozen=True)
class Model:
    """A file that skills and perceivers evaluate or read, with its interface.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    description: TextField = field(metadata={"doc": "its purpose, for people"})
    kind: ChoiceField[Literal["onnx", "table", "file"]] = field(
        metadata={"doc": "`onnx` (a network), `table` (CSV, JSON or npz) or `file` (bytes)"}
    )
    file: TextField | None = field(default=None, metadata={"doc": "the file of this module that contains it"})
    inputs: Named[ModelValue] = field(default=MappingField(), metadata={"doc": "its inputs by name"})
    outputs: Named[ModelValue] = field(default=MappingField(), metadata={"doc": "its outputs by name"})
    bounds: tuple[ModelBound, ...] = field(
        default=(), metadata={"doc": "bounds of outputs over boxes of inputs, each to be proved"}
    )


UsedModels = tuple[Identifier, ...]
"""Names of the models that a skill or a perceiver uses."""
