"""Schema of perception: variables and perceivers of modules, cameras of sites, and shared variables."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from aeros.spec.declared.field_types import Identifier, Named
from aeros.spec.declared.models import UsedModels
from aeros.spec.declared.quantity import Quantity
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.text.fields import (
    BooleanField,
    ExpressionField,
    IntegerField,
    MappingField,
    NumberField,
    Pattern,
    TextField,
    ValueBounds,
)

Pixels = Annotated[IntegerField, ValueBounds(1, 4096)]
"""Number of columns or rows of a picture."""


@dataclass(frozen=True)
class ModuleVariable(Quantity):
    """A variable that a module measures itself; the name of the module leads to it from outside."""

    max_age: TextField = field(
        kw_only=True, metadata={"doc": "older values are unknown, as in `max_age: 10 s`"}
    )
    uncertainty: TextField | None = field(
        default=None,
        metadata={
            "doc": "the greatest standard uncertainty of a value; a less certain one is unknown, as in "
            "`uncertainty: 5 mm`"
        },
    )


@dataclass(frozen=True)
class OccupiedSpace:
    """Space that an object takes up around its measured position, along the axes of W.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    lower: tuple[TextField, ...] = field(
        metadata={"doc": "lower corner from the position, as in `lower: [-3 cm, -3 cm, -5 cm]`"}
    )
    upper: tuple[TextField, ...] = field(
        metadata={"doc": "upper corner from the position, as in `upper: [3 cm, 3 cm, 5 cm]`"}
    )


@dataclass(frozen=True)
class OwnVariable(ModuleVariable):
    """A variable as its module declares it.

    A perceiver measures it, a sensor of the site does, or a definition says when it is true.
    """

    definition: ExpressionField | None = field(
        default=None,
        metadata={
            "doc": "the condition under which a `bool` is true, in place of a perceiver, as in "
            "`definition: block_position.y >= 390 mm`"
        },
    )
    margin: Annotated[NumberField, ValueBounds(0, 10)] | None = field(
        default=None,
        metadata={
            "doc": "of a definition: the number of standard uncertainties by which what it reads may be off; "
            "where that could change its value, it is unknown, as in `margin: 2`"
        },
    )
    sensor: Identifier | None = field(
        default=None,
        metadata={
            "doc": "the sensor of the site that measures it, in place of a perceiver, as in "
            "`sensor: load_cell`"
        },
    )
    occupies: OccupiedSpace | None = field(
        default=None,
        metadata={
            "doc": "of a position: the space that the thing there takes up, which is then no obstacle, as in "
            "`occupies: {lower: [-3 cm, -3 cm, -5 cm], upper: [3 cm, 3 cm, 5 cm]}`"
        },
    )
    public: BooleanField | None = field(
        default=None,
        metadata={
            "doc": "`true` if modules that require this one may read it, where the site allows that, as in "
            "`public: true`"
        },
    )


@dataclass(frozen=True)
class Thing:
    """A thing that the module perceives: its kind, the variables that describe it, and where it is.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    kind: Identifier = field(
        metadata={
            "doc": "its kind, as in `kind: sponge`; if it is the name of a task parameter, the kind that the "
            "task asks for"
        }
    )
    position: Identifier | None = field(
        default=None,
        metadata={"doc": "the variable with its position, as in `position: sponge_position`"},
    )
    count: Identifier | None = field(
        default=None,
        metadata={"doc": "the variable that has the number of such things, as in `count: dumplings_cooked`"},
    )
    held: ExpressionField | None = field(
        default=None, metadata={"doc": "the condition under which the robot holds it, as in `held: holding`"}
    )
    on: Named[ExpressionField] = field(
        default=MappingField(),
        metadata={"doc": "the condition for each place that it may be on, as in `on: {tray: at_tray}`"},
    )
    in_: Named[ExpressionField] = field(
        default=MappingField(),
        metadata={"doc": "the condition for each place that it may be in, as in `in: {pot: in_pot}`"},
    )
    recall: TextField | None = field(
        default=None,
        metadata={
            "doc": "the age up to which perceivers that list `memory` under `readings` are given the places "
            "where it was seen, as in `recall: 720 h`; they are given none if absent"
        },
    )


@dataclass(frozen=True)
class SharedVariable(ModuleVariable):
    """A module's variable that others may read, as the module must declare it."""

    in_invariants: BooleanField | None = field(
        default=None, metadata={"doc": "`true` if the invariants Φ may read it, too"}
    )


@dataclass(frozen=True)
class Camera:
    """A camera of the site.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    sensor: Identifier = field(
        metadata={"doc": "the sensor that a module needs for its pictures, as in `sensor: overhead_camera`"}
    )
    width: Pixels = field(
        metadata={"doc": "the most columns that a perceiver may ask for, as in `width: 640`"}
    )
    height: Pixels = field(
        metadata={"doc": "the most rows that a perceiver may ask for, as in `height: 480`"}
    )
    sees: tuple[Identifier, ...] = field(
        default=(), metadata={"doc": "the volumes that its pictures show, as in `sees: [table_area]`"}
    )
    offers: tuple[Identifier, ...] = field(
        default=(),
        metadata={"doc": "uses that modules may make of it, as in `offers: [surface]`"},
    )


@dataclass(frozen=True)
class PictureRequest:
    """The picture of a camera that a perceiver gets.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    width: Pixels = field(metadata={"doc": "number of columns, as in `width: 320`"})
    height: Pixels = field(metadata={"doc": "number of rows, as in `height: 240`"})
    depth: BooleanField | None = field(
        default=None, metadata={"doc": "`true` to get the distance of each pixel, too"}
    )
    optional: BooleanField | None = field(
        default=None,
        metadata={
            "doc": "`true` if the perceiver is called without this picture, too, as long as the camera has "
            "taken none"
        },
    )


@dataclass(frozen=True)
class Perceiver:
    """A passive function that computes values of the module's variables from pictures and readings.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    description: TextField = field(metadata={"doc": "its purpose, for people"})
    entry: Annotated[TextField, Pattern("entry")] = field(
        metadata={"doc": "the generator function, as in `entry: perceivers:see_kettle`"}
    )
    provides: tuple[Identifier, ...] = field(
        metadata={"doc": "the module's variables that only this perceiver measures"}
    )
    timeout: TextField = field(
        metadata={"doc": "the real time that one call may take, as in `timeout: 200 ms`"}
    )
    memory: TextField = field(metadata={"doc": "the memory of its process, as in `memory: 256 MiB`"})
    processor: TextField | None = field(
        default=None,
        metadata={
            "doc": "the share of one core that its process needs at most, as in `processor: 20 %`; that of "
            "the site if absent"
        },
    )
    pictures: Named[PictureRequest] = field(
        default=MappingField(), metadata={"doc": "the pictures that it gets, by camera"}
    )
    readings: tuple[Annotated[TextField, Pattern("dotted")], ...] = field(
        default=(),
        metadata={
            "doc": "the state variables and parameters that it gets with the pictures; `memory` is a table "
            "of the places where the module's things were seen before"
        },
    )
    rate: TextField | None = field(
        default=None,
        metadata={"doc": "how often readings are sampled between two calls, too, as in `rate: 10 Hz`"},
    )
    models: UsedModels = field(
        default=(),
        metadata={"doc": "models that it gets as a second argument, as in `models: [detector]`"},
    )


@dataclass(frozen=True)
class PerceptionPolicy:
    """Rights of perceivers, and of everybody to what they measure.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    shared: Annotated[MappingField[SharedVariable], Pattern("full name")] = field(
        default=MappingField(),
        metadata={
            "doc": "the variables of modules that other modules may read, as in "
            "`shared: {kettle.water_hot: {type: bool, max_age: 10 s}}`"
        },
    )
    public: BooleanField | None = field(
        default=None,
        metadata={
            "doc": "`true` if modules may read what the modules that they require declare as `public`; "
            "`false` if absent"
        },
    )
    timeout: TextField | None = field(
        default=None, metadata={"doc": "the longest timeout of a perceiver; 1 s if absent"}
    )
    memory: TextField | None = field(
        default=None, metadata={"doc": "the most memory of a perceiver; 1 GiB if absent"}
    )
    processor: TextField | None = field(
        default=None,
        metadata={
            "doc": "the largest share of one core for a perceiver, as in `processor: 50 %`; 100 % if absent"
        },
    )
    rate: TextField | None = field(
        default=None,
        metadata={"doc": "the highest rate of a perceiver, as in `rate: 50 Hz`; 1000 Hz if absent"},
    )
