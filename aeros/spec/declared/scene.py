"""Schema of a scene file, unresolved: a robot's surroundings in a simulator, and the truth of its goals.

Quantities are still text; `aeros.spec.scenes` gives them meaning.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from typing import Annotated, Literal

from aeros.spec.declared.field_types import ByVariable, Identifier, Named
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.text.fields import (
    BooleanField,
    ChoiceField,
    ExpressionField,
    IntegerField,
    LengthBounds,
    MappingField,
    NumberField,
    Pattern,
    TextField,
    ValueBounds,
)

Share = Annotated[NumberField, ValueBounds(0, 1)]
Colour = Annotated[tuple[Share, ...], LengthBounds(3, 3)]
Pair = Annotated[tuple[TextField, ...], LengthBounds(2, 2)]
Triple = Annotated[tuple[TextField, ...], LengthBounds(3, 3)]
Reference = Annotated[TextField, Pattern("dotted")]
"""A body, `can`, or one of its links or joints, `press.handle`."""
Friction = Annotated[NumberField, ValueBounds(0, 10)]
Factors = Annotated[
    tuple[Annotated[NumberField, ValueBounds(Fraction(1, 100), 100)], ...], LengthBounds(2, 2)
]


@dataclass(frozen=True)
class Robot:
    """Mount and place of the robot.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    mount: ChoiceField[Literal["bench", "carriage"]] = field(
        metadata={"doc": "fixed to a `bench`, or on a `carriage` that drives along x and y of W"}
    )
    at: Triple | None = field(
        default=None, metadata={"doc": "the arm's base in W at the start; the origin of W if absent"}
    )


@dataclass(frozen=True)
class Camera:
    """A pinhole camera.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    eye: Triple = field(metadata={"doc": "its position, in the frame that `on` names"})
    target: Triple = field(metadata={"doc": "the point that it looks at, in the same frame"})
    on: ChoiceField[Literal["cell", "base", "hand"]] | None = field(
        default=None,
        metadata={
            "doc": "its frame: W (`cell`, the default), the arm's `base` with axes parallel to W, or the tool"
            " point with x along the `hand`'s heading and z up, as in `on: base`"
        },
    )
    up: Annotated[tuple[NumberField, ...], LengthBounds(3, 3)] | None = field(
        default=None, metadata={"doc": "the direction that is up in the picture; `[0, 0, 1]` if absent"}
    )
    field_of_view: TextField | None = field(
        default=None, metadata={"doc": "vertical angle of view; 50 deg if absent"}
    )
    size: Annotated[tuple[Annotated[IntegerField, ValueBounds(1, 4096)], ...], LengthBounds(2, 2)] | None = (
        field(default=None, metadata={"doc": "width and height in pixels; 320 by 240 if absent"})
    )
    at_start: BooleanField | None = field(
        default=None, metadata={"doc": "`true` if it has taken a picture when the clock starts"}
    )


@dataclass(frozen=True)
class AlternativePlace:
    """A second position, which is taken where it is farther from something.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    at: Triple = field(metadata={"doc": "the second position, in the frame of the first"})
    farther_from: Identifier = field(
        metadata={"doc": "the body or place that the chosen one is farther from"}
    )


@dataclass(frozen=True)
class Place:
    """A surveyed point: the cell measures it exactly, as the state variable of its name.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    at: Triple = field(metadata={"doc": "x, y and z, in W or in the frame that `from` names"})
    from_: Identifier | None = field(
        default=None, metadata={"doc": "a place above, in whose frame `at` counts; W if absent"}
    )
    yaw: TextField | None = field(default=None, metadata={"doc": "rotation about z of W; 0 deg if absent"})
    spread: Triple | None = field(
        default=None, metadata={"doc": "greatest random offset along x, y and z of W; none if absent"}
    )
    yaw_spread: TextField | None = field(
        default=None, metadata={"doc": "greatest random rotation about z; none if absent"}
    )
    stream: Identifier | None = field(
        default=None,
        metadata={
            "doc": "name of its random numbers; things that share one move alike; its own name if absent"
        },
    )


@dataclass(frozen=True)
class Grip:
    """The part of a body that fingers close on; without physics, it is all that they can hold.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    low: Triple = field(metadata={"doc": "lowest corner of that part, in the body's frame"})
    high: Triple = field(metadata={"doc": "highest corner of that part, in the body's frame"})


@dataclass(frozen=True)
class Surface:
    """A horizontal rectangle on which things can lie.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    at: Triple = field(metadata={"doc": "its middle, in the body's frame"})
    size: Pair = field(metadata={"doc": "length and width"})


@dataclass(frozen=True)
class Part:
    """One part of a compound: exactly one of `box`, `cylinder` and `sphere`.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    at: Triple = field(metadata={"doc": "its middle, in the body's frame"})
    box: Triple | None = field(default=None, metadata={"doc": "full lengths of its edges"})
    cylinder: Pair | None = field(default=None, metadata={"doc": "radius and height about z"})
    sphere: TextField | None = field(default=None, metadata={"doc": "radius"})
    colour: Colour | None = field(default=None, metadata={"doc": "as of a body; that of the body if absent"})


@dataclass(frozen=True)
class LookPart:
    """One part of a look: exactly one of `box`, `ellipsoid`, `capsule`, `cylinder` and `sphere`.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    at: Triple | None = field(
        default=None,
        metadata={"doc": "its middle, in the frame of the body or of `link`; the origin if absent"},
    )
    tilt: Triple | None = field(
        default=None, metadata={"doc": "rotation about x, then y, then z of that frame; none if absent"}
    )
    link: Identifier | None = field(
        default=None, metadata={"doc": "the link of a `urdf` that it moves with; its base if absent"}
    )
    box: Triple | None = field(default=None, metadata={"doc": "full lengths of its edges"})
    ellipsoid: Triple | None = field(default=None, metadata={"doc": "full lengths of its axes"})
    capsule: Pair | None = field(
        default=None, metadata={"doc": "radius, and length of the straight part along z"}
    )
    cylinder: Pair | None = field(default=None, metadata={"doc": "radius and height about z"})
    sphere: TextField | None = field(default=None, metadata={"doc": "radius"})
    colour: Colour | None = field(default=None, metadata={"doc": "as of a body; grey if absent"})
    opacity: Share | None = field(default=None, metadata={"doc": "1 if absent, less of what is translucent"})
    joint: Identifier | None = field(
        default=None, metadata={"doc": "a joint of a `urdf`, without whose `range` it is not shown"}
    )
    range: Pair | None = field(
        default=None, metadata={"doc": "least and greatest position of `joint` in which it is shown"}
    )


@dataclass(frozen=True)
class Look:
    """Parts that people see in films in place of a body; robots' cameras see the body itself.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    parts: Annotated[tuple[LookPart, ...], LengthBounds(1, 64)] = field(metadata={"doc": "the parts"})


@dataclass(frozen=True)
class Joint:
    """A joint of a model; fields that are absent are as the model's file has them.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    friction: TextField | None = field(
        default=None, metadata={"doc": "dry friction, as in `friction: 5 mN*m`; 0 N*m if absent"}
    )
    range: Pair | None = field(default=None, metadata={"doc": "least and greatest position"})


@dataclass(frozen=True)
class BodyRanges:
    """Ranges of one body, from which `aeros run --randomise` draws; a `urdf` has neither mass nor colour.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    mass: Factors | None = field(default=None, metadata={"doc": "least and greatest factor on its mass"})
    friction: Factors | None = field(
        default=None, metadata={"doc": "least and greatest factor on its friction and its links'"}
    )
    colour: Share | None = field(default=None, metadata={"doc": "greatest change of its red, green and blue"})
    spread: Triple | None = field(
        default=None, metadata={"doc": "added to its `spread`: a wider range of places"}
    )
    yaw_spread: TextField | None = field(default=None, metadata={"doc": "added to its `yaw_spread`"})


@dataclass(frozen=True)
class SceneRanges:
    """Ranges of the whole scene, from which `aeros run --randomise` draws.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    light: Factors | None = field(
        default=None,
        metadata={"doc": "least and greatest factor on the colours of all bodies, as of dim or bright light"},
    )
    sensors: Factors | None = field(
        default=None,
        metadata={
            "doc": "least and greatest factor on noise, bias and drift of the site's sensors, but for those"
            " that measure how far people are"
        },
    )


@dataclass(frozen=True)
class SceneBody:
    """One body: exactly one of `box`, `cylinder`, `sphere`, `basin`, `compound` and `urdf`.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    at: Triple = field(
        metadata={"doc": "x, y and z of its middle, of the frame of its `urdf`, or of its `anchor`"}
    )
    box: Triple | None = field(
        default=None, metadata={"doc": "full lengths of its edges along its own x, y and z"}
    )
    cylinder: Pair | None = field(
        default=None, metadata={"doc": "radius and height about its own z, as in `cylinder: [40 mm, 12 cm]`"}
    )
    sphere: TextField | None = field(default=None, metadata={"doc": "radius, as in `sphere: 3 cm`"})
    basin: Triple | None = field(
        default=None,
        metadata={
            "doc": "inner length, width and depth of a box without a lid, whose walls are 5 mm thick; its"
            " frame is the middle of its floor's top"
        },
    )
    compound: Annotated[tuple[Part, ...], LengthBounds(1, 32)] | None = field(
        default=None, metadata={"doc": "parts that are one rigid body; its frame is its centre of mass"}
    )
    urdf: TextField | None = field(
        default=None,
        metadata={"doc": "a URDF file, from this file's folder, as in `urdf: models/vase.urdf`"},
    )
    from_: Identifier | None = field(
        default=None, metadata={"doc": "a place or body above, in whose frame `at` counts; W if absent"}
    )
    anchor: Triple | None = field(
        default=None,
        metadata={
            "doc": "the point of the body, in its own frame, that is put at `at`; its origin if absent"
        },
    )
    yaw: TextField | None = field(
        default=None,
        metadata={"doc": "rotation about z of the frame; 0 deg if absent, as in `yaw: 30 deg`"},
    )
    spread: Triple | None = field(
        default=None, metadata={"doc": "greatest random offset along x, y and z of W; none if absent"}
    )
    yaw_spread: TextField | None = field(
        default=None, metadata={"doc": "greatest random rotation about z; none if absent"}
    )
    stream: Identifier | None = field(
        default=None,
        metadata={
            "doc": "name of its random numbers; things that share one move alike; its own name if absent"
        },
    )
    alternative: AlternativePlace | None = field(
        default=None,
        metadata={"doc": "a second position instead of `at`, where that is farther from a thing"},
    )
    mass: TextField | None = field(
        default=None, metadata={"doc": "mass of a body that is no `urdf`; fixed to W if absent"}
    )
    loose: BooleanField | None = field(
        default=None,
        metadata={
            "doc": "with `urdf`: `true` if its base can move; fixed to W if absent, as in `loose: true`"
        },
    )
    friction: Friction | None = field(
        default=None, metadata={"doc": "its Coulomb coefficient; 0.6 if absent, as in `friction: 0.3`"}
    )
    spinning: Friction | None = field(
        default=None,
        metadata={
            "doc": "coefficient of friction about the normal of a contact, m; 0.02 if absent, without which"
            " gripped cylinders turn in the fingers"
        },
    )
    rolling_resistance: TextField | None = field(
        default=None,
        metadata={
            "doc": "lever of the braking torque as it rolls: its coefficient times its radius; none if absent"
        },
    )
    colour: Colour | None = field(
        default=None, metadata={"doc": "red, green and blue, each from 0 to 1; grey if absent"}
    )
    randomise: BodyRanges | None = field(
        default=None, metadata={"doc": "ranges of its properties; with `aeros run --randomise` alone"}
    )
    grip: Grip | None = field(
        default=None,
        metadata={
            "doc": "the part to hold it by; all of a movable body if absent; a `urdf` needs it to be held"
        },
    )
    surfaces: tuple[Surface, ...] = field(
        default=(),
        metadata={"doc": "where things can lie on a `urdf`; needed by the plant without physics alone"},
    )
    underside: TextField | None = field(
        default=None,
        metadata={
            "doc": "depth of the lowest point of a `urdf` below its frame, for the plant without physics"
        },
    )
    links: Annotated[MappingField[Friction], Pattern("identifier")] = field(
        default=MappingField(),
        metadata={"doc": "Coulomb coefficients of links of a `urdf` that differ, by name"},
    )
    joints: Named[Joint] = field(
        default=MappingField(), metadata={"doc": "joints of a `urdf` that differ from its file, by name"}
    )
    look: Identifier | None = field(
        default=None, metadata={"doc": "one of `looks`, by which films show it; its own shape if absent"}
    )


@dataclass(frozen=True)
class Instrument:
    """A measurement of bodies: exactly one of `load`, `position`, `joint` and `force`.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    load: Reference | None = field(
        default=None,
        metadata={
            "doc": "load cell under a body or link, tared: the downward force of all that touches it, as in "
            "`load: press`"
        },
    )
    force: Annotated[tuple[Reference, ...], LengthBounds(2, 2)] | None = field(
        default=None,
        metadata={
            "doc": "sum of the normal forces between two bodies or links; for conditions alone, as no sensor "
            "can tell which body presses on another"
        },
    )
    position: Reference | None = field(default=None, metadata={"doc": "position in W of a body or link"})
    joint: Reference | None = field(default=None, metadata={"doc": "position of a joint"})


@dataclass(frozen=True)
class Region:
    """A box in the frame of a body or place; a condition asks for `can.position in REGION`.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    low: Triple = field(metadata={"doc": "corner with the least coordinates"})
    high: Triple = field(metadata={"doc": "corner with the greatest coordinates"})
    of: Identifier | None = field(
        default=None, metadata={"doc": "the body or place in whose frame the corners count; W if absent"}
    )


@dataclass(frozen=True)
class Coating:
    """A layer on a horizontal rectangle that a body wipes off, in square cells; cameras see it.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    low: Pair = field(metadata={"doc": "corner with the least x and y in W"})
    high: Pair = field(metadata={"doc": "corner with the greatest x and y in W"})
    on: Identifier = field(metadata={"doc": "the body that is coated, whose top is at z = 0 of W"})
    wiped_by: Identifier = field(metadata={"doc": "the body that wipes"})
    face: Triple = field(
        metadata={"doc": "full lengths of the box, around the wiping body's frame, whose underside wipes"}
    )
    force: TextField = field(metadata={"doc": "a cell is wiped by a body that presses with more than this"})
    gap: TextField = field(metadata={"doc": "and whose underside is nearer than this"})
    cell: TextField = field(metadata={"doc": "edge of a cell"})
    colour: Colour = field(metadata={"doc": "its colour"})
    under: Colour = field(metadata={"doc": "the colour of what it covers"})


@dataclass(frozen=True)
class Seal:
    """A joint that becomes stiff for good once a condition holds.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    joint: Reference = field(metadata={"doc": "the joint, `BODY.JOINT`"})
    friction: TextField = field(metadata={"doc": "its dry friction once it is sealed"})
    when: ExpressionField = field(metadata={"doc": "the condition, judged at every control tick"})


@dataclass(frozen=True)
class Timer:
    """A time for which a condition has held: `NAME` until now, and `NAME.longest` at a stretch so far.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    while_: ExpressionField = field(metadata={"doc": "the condition, judged at every control tick"})


@dataclass(frozen=True)
class Handle:
    """The bar on a lid that fingers move on a circle about the lid's joint.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    link: Reference = field(metadata={"doc": "the link, `BODY.LINK`"})
    radius: TextField = field(metadata={"doc": "distance of its axis from the joint's axis"})
    size: Pair = field(metadata={"doc": "radius and length of the bar, along the joint's axis"})


@dataclass(frozen=True)
class Press:
    """A lid that folds what lies on it, for the plant without physics, which moves it by its handle alone.

    The lid's joint has its axis along y of W and is open, at 0, towards -x.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    lid: Reference = field(metadata={"doc": "the lid's joint, `BODY.JOINT`"})
    handle: Handle = field(metadata={"doc": "what fingers move it by"})
    range: Pair = field(metadata={"doc": "least and greatest angle of the empty press"})
    folds: Reference = field(metadata={"doc": "the joint that the lid turns, `BODY.JOINT`"})
    hinge: Triple = field(metadata={"doc": "the axis of that joint, in its body's frame"})
    at: Triple = field(metadata={"doc": "where in W that axis belongs"})
    within: TextField = field(
        metadata={"doc": "greatest distance from there, along each axis, at which it is folded"}
    )
    gap: TextField = field(metadata={"doc": "gap inside what is folded by half a turn"})
    filling: Identifier = field(metadata={"doc": "the body inside that the lid meets"})
    inside: Identifier = field(metadata={"doc": "the region in which it does"})
    seal: Identifier = field(metadata={"doc": "the seal without which the fold opens again"})


@dataclass(frozen=True)
class Include:
    """Another scene file, all of whose things are in this scene, too.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    scene: TextField = field(metadata={"doc": "a file, from this file's folder, or the name of a scene"})
    prefix: Identifier | None = field(
        default=None, metadata={"doc": "put before each of its names; none if absent, as in `prefix: left_`"}
    )
    at: Triple | None = field(
        default=None, metadata={"doc": "where the origin of its W is in this scene's W; the origin if absent"}
    )


@dataclass(frozen=True)
class Scene:
    """A whole scene file.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    schema: Literal["aeros/scene/2"] = field(metadata={"doc": "`schema: aeros/scene/2`"})
    description: TextField = field(metadata={"doc": "the scene's purpose, for people"})
    include: Annotated[tuple[Include, ...], LengthBounds(0, 16)] = field(
        default=(), metadata={"doc": "scenes that this one is put together from"}
    )
    module: Identifier | None = field(
        default=None,
        metadata={
            "doc": "the module whose variables its places, instruments and `truth` are, and whose names "
            "of cameras it uses; the site's if "
            "absent, as in `module: kettle`"
        },
    )
    robot: Robot | None = field(
        default=None,
        metadata={
            "doc": "how the robot is put up; a scene without it only adds to others, as with `--scene`"
        },
    )
    view: Camera | None = field(
        default=None, metadata={"doc": "the camera of films and windows, from which the whole scene is seen"}
    )
    places: Named[Place] = field(default=MappingField(), metadata={"doc": "surveyed points, by name"})
    randomise: SceneRanges | None = field(
        default=None, metadata={"doc": "ranges of light and sensors; with `aeros run --randomise` alone"}
    )
    looks: Named[Look] = field(
        default=MappingField(), metadata={"doc": "shapes by which films show bodies, by name"}
    )
    bodies: Annotated[Named[SceneBody], LengthBounds(0, 100)] = field(
        default=MappingField(), metadata={"doc": "the bodies, by name"}
    )
    cameras: Named[Camera] = field(default=MappingField(), metadata={"doc": "the robot's cameras, by name"})
    instruments: Named[Instrument] = field(
        default=MappingField(),
        metadata={"doc": "measurements of bodies, each the state variable of its name"},
    )
    regions: Named[Region] = field(
        default=MappingField(),
        metadata={"doc": "boxes that conditions speak of; the inside of a basin is one"},
    )
    coatings: Named[Coating] = field(default=MappingField(), metadata={"doc": "layers that can be wiped off"})
    conditions: Named[ExpressionField] = field(
        default=MappingField(), metadata={"doc": "names for conditions, for use in those below"}
    )
    seals: Named[Seal] = field(default=MappingField(), metadata={"doc": "joints that become stiff"})
    timers: Named[Timer] = field(
        default=MappingField(), metadata={"doc": "times for which conditions have held"}
    )
    presses: Named[Press] = field(
        default=MappingField(), metadata={"doc": "lids with a handle, for the plant without physics"}
    )
    parameters: Named[Annotated[MappingField[Reference], Pattern("identifier")]] = field(
        default=MappingField(),
        metadata={
            "doc": "for each parameter of a task that `truth` speaks of, the thing of this scene that each "
            "of its values is, as in `parameters: {object: {red_can: can, blue_block: block}}`"
        },
    )
    truth: ByVariable[ExpressionField] = field(
        default=MappingField(),
        metadata={
            "doc": "for each state variable of a goal, the condition under which it is true in the simulator,"
            " or its number, by `if … then 1 else 0`; only the referee reads it. The full name of a variable "
            "of another module, as `kettle.water_hot`, replaces what an included scene says of it"
        },
    )
