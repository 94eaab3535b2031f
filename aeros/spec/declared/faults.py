"""Schema of the faults file: what goes wrong in simulation, when and how often.

Each kind of fault is defined once, as simulators use it: in SI, durations in control ticks. The type of each
field carries a mark that says how a file writes it. `written_form` derives the schema of the file from the
marks, and `aeros.sim.faults.faults_file` reads the values.
"""

from __future__ import annotations

from dataclasses import MISSING, dataclass, field, fields, make_dataclass
from functools import cache
from typing import Annotated, Any, ClassVar, Final, Generic, Literal, TypeVar, get_type_hints

from aeros.spec.declared.people import Person
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.expr.units import ANGLE, FORCE, LENGTH, MASS, TIME, Dimension
from aeros.spec.text.fields import (
    ChoiceField,
    IntegerField,
    LengthBounds,
    MappingField,
    NumberField,
    Pattern,
    TextField,
    ValueBounds,
)
from aeros.spec.text.schema_hints import admitted_forms, split_annotated

Identifier = Annotated[TextField, Pattern("identifier")]
_T = TypeVar("_T")
Probability = Annotated[NumberField, ValueBounds(0, 1)]

LONGEST: Final = 3600
"""Longest time that a faults file may speak of, s: more than any task takes."""

MAX_COORDINATE: Final = 100
"""Greatest coordinate of a place, m."""

_MOST_TURN: Final = 4
"""Greatest angle that a thing is turned by, rad: half a turn is the most that differs."""

_STRONGEST: Final = 10
"""Largest impulse (N·s), grip force (tens of N) and offset (m) that mean anything on a table."""

LEAST_EDGE, MOST_EDGE = 0.01, 2.0
"""Least and greatest edge of a box that somebody puts down, m."""

_HEAVIEST: Final = 50
"""Greatest mass of such a box, kg."""


# How a file writes a value.


@dataclass(frozen=True)
class _Mark:
    """Mark of a field of a fault; `form` is the type that the file's decoder gives the written value."""

    doc: str
    form: ClassVar[Any] = TextField


@dataclass(frozen=True)
class Known(_Mark):
    """Name of a known object.

    Attributes:
        among: the field of `FaultContext` that lists the known names.
        noun: noun for such an object in messages.
    """

    among: Literal["things", "bodies", "measured", "scanners"]
    noun: str
    form = Annotated[TextField, Pattern("dotted")]


@dataclass(frozen=True)
class Amount(_Mark):
    """Number with a unit, at least 0.

    Attributes:
        dimension: dimension that the unit must have.
        most: greatest value, SI.
    """

    dimension: Dimension
    most: int


class Deviation(_Mark):
    """Number with the unit of the quantity that the fault concerns."""


class Duration(_Mark):
    """Time with a unit, rounded to control ticks."""


class Share(_Mark):
    """Number from 0 to 1."""

    form = Probability


class Direction(_Mark):
    """Three numbers, of which the direction counts and the length does not."""

    form = Annotated[tuple[NumberField, ...], LengthBounds(3, 3)]


class Place(_Mark):
    """Three lengths with units, each at most `MAX_COORDINATE` to either side."""

    form = Annotated[tuple[TextField, ...], LengthBounds(3, 3)]


class Edges(_Mark):
    """Three lengths with units, each from `LEAST_EDGE` to `MOST_EDGE`."""

    form = Annotated[tuple[TextField, ...], LengthBounds(3, 3)]


Mark = Known | Amount | Deviation | Duration | Share | Direction | Place | Edges


def marks_of(kind: type) -> dict[str, Mark]:
    """Return how a file writes each field of a kind of fault.

    Args:
        kind: dataclass of the kind, one of `KINDS`.

    Returns:
        The mark of each field, by its name.
    """
    hints = get_type_hints(kind, include_extras=True)
    return {one.name: split_annotated(admitted_forms(hints[one.name])[0])[1][0] for one in fields(kind)}


@cache
def written_form(kind: type) -> type:
    """Derive the schema that a file declares a kind of fault by; fields with a default are optional.

    Args:
        kind: dataclass of the kind, with a mark on each field.

    Returns:
        A dataclass of the same name with a field `span`; cached.
    """
    declared: list[tuple[str, Any, Any]] = []
    for one, mark in zip(fields(kind), marks_of(kind).values(), strict=True):
        if one.default is MISSING:
            declared.append((one.name, mark.form, field(metadata={"doc": mark.doc})))
        else:
            declared.append((one.name, mark.form | None, field(default=None, metadata={"doc": mark.doc})))
    namespace = {"__doc__": kind.__doc__, "__module__": kind.__module__}
    return make_dataclass(kind.__name__, [("span", SourceSpan), *declared], frozen=True, namespace=namespace)


class Written(Generic[_T]):
    """`Written[Kind]` is the schema of a kind of fault as a file declares it, before its values are known."""

    def __class_getitem__(cls, kind: type) -> type:
        return written_form(kind)


# Kinds of faults.

_UnitVector = tuple[float, float, float]
_WAY: Final = Direction("direction in W; a random horizontal one if absent, as in `direction: [0, 1, 0]`")


@dataclass(frozen=True, slots=True)
class ImpulseFault:
    """A push: an impulse on an object, in one direction.

    Attributes:
        thing: name of the scene object.
        impulse: N·s.
        over: duration of the push in ticks.
        direction: unit vector in W; None for a random horizontal one.
    """

    thing: Annotated[
        str, Known("the object that is pushed, as in `thing: wrapper`", "things", "scene object")
    ]
    impulse: Annotated[float, Amount("the impulse, as in `impulse: 0.04 N*s`", FORCE * TIME, _STRONGEST)]
    over: Annotated[int, Duration("duration of the push; 50 ms if absent, as in `over: 100 ms`")] = 12
    direction: Annotated[_UnitVector, _WAY] | None = None


_NOWHERE: Final = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class CarryFault:
    """Somebody takes an object, lifts it, turns it, carries it elsewhere and lets go.

    Attributes:
        thing: name of the scene object.
        to: place at which it is let go, m: in W, or from the middle of the body `of`.
        of: name of a scene body; empty for W.
        spread: greatest random offset from that place along each axis, m.
        turn: angle by which it is turned, rad.
        about: axis of that turn in W, a unit vector; None for a random horizontal one.
        inside: name of another scene object, which lies in it and is carried along; empty for none.
        over: duration in ticks.
    """

    thing: Annotated[str, Known("the object that is carried, as in `thing: can`", "things", "scene object")]
    to: Annotated[_UnitVector, Place("the place at which it is let go, as in `to: [40 cm, 0 m, 10 cm]`")]
    of: Annotated[
        str, Known("the body from which that place counts, as in `of: stand`", "bodies", "body of the scene")
    ] = ""
    spread: Annotated[
        _UnitVector, Place("the greatest random offset along each axis, as in `spread: [3 cm, 3 cm, 0 m]`")
    ] = _NOWHERE
    turn: Annotated[
        float, Amount("the angle that it is turned by, as in `turn: 90 deg`", ANGLE, _MOST_TURN)
    ] = 0.0
    about: (
        Annotated[
            _UnitVector,
            Direction("axis of the turn; a random horizontal one if absent, as in `about: [1, 0, 0]`"),
        ]
        | None
    ) = None
    inside: Annotated[
        str,
        Known(
            "an object that lies in it and is carried along, as in `inside: filling`",
            "things",
            "scene object",
        ),
    ] = ""
    over: Annotated[int, Duration("duration; 2 s if absent, as in `over: 1 s`")] = 480


@dataclass(frozen=True, slots=True)
class BoxFault:
    """Somebody brings a box that was not in the scene, sets it down from above and leaves it.

    Attributes:
        box: lengths of its edges, m.
        to: place of the middle of its underside, m: in W, or from the middle of the body `of`.
        of: name of a scene body; empty for W.
        spread: greatest random offset from that place along each axis, m.
        mass: kg.
        over: duration in ticks; with a robot at that place it begins when the robot is away.
    """

    box: Annotated[_UnitVector, Edges("lengths of the box's edges, as in `box: [8 cm, 8 cm, 25 cm]`")]
    to: Annotated[
        _UnitVector,
        Place("the place of the middle of its underside, as in `to: [40 cm, -10 cm, 0 m]`"),
    ]
    of: Annotated[
        str, Known("the body from which that place counts, as in `of: stand`", "bodies", "body of the scene")
    ] = ""
    spread: Annotated[
        _UnitVector, Place("the greatest random offset along each axis, as in `spread: [3 cm, 3 cm, 0 m]`")
    ] = _NOWHERE
    mass: Annotated[float, Amount("its mass; 2 kg if absent, as in `mass: 5 kg`", MASS, _HEAVIEST)] = 2.0
    over: Annotated[int, Duration("duration; 2 s if absent, as in `over: 1 s`")] = 480


@dataclass(frozen=True, slots=True)
class PadFrictionFault:
    """The finger pads are slippery for a while.

    Attributes:
        friction: the pads' friction meanwhile, as a share of what it is otherwise.
        lasts: duration in ticks.
    """

    friction: Annotated[float, Share("the pads' friction meanwhile (otherwise 1), as in `friction: 0.1`")]
    lasts: Annotated[int, Duration("duration of the fault, as in `lasts: 500 ms`")]


@dataclass(frozen=True, slots=True)
class GripForceFault:
    """The fingers grip with less force for a while.

    Attributes:
        force: greatest grip force meanwhile, N.
        lasts: duration in ticks.
    """

    force: Annotated[
        float, Amount("the greatest grip force meanwhile, as in `force: 0 N`", FORCE, 10 * _STRONGEST)
    ]
    lasts: Annotated[int, Duration("duration of the fault, as in `lasts: 300 ms`")]


@dataclass(frozen=True, slots=True)
class TorqueFault:
    """The arm's motors have less torque for a while.

    Attributes:
        torque: share of the torque that remains, in [0, 1].
        lasts: duration in ticks.
    """

    torque: Annotated[float, Share("the remaining share of the torque, as in `torque: 0.2`")]
    lasts: Annotated[int, Duration("duration of the fault, as in `lasts: 2 s`")]


@dataclass(frozen=True, slots=True)
class CommandDelayFault:
    """The arm's motors follow commands late for a while.

    Attributes:
        by: delay in ticks.
        lasts: duration in ticks.
    """

    by: Annotated[int, Duration("the delay, as in `by: 100 ms`")]
    lasts: Annotated[int, Duration("duration of the fault, as in `lasts: 2 s`")]


@dataclass(frozen=True, slots=True)
class MissedPictureFault:
    """A camera is dazzled: its picture is white and shows nothing near."""


@dataclass(frozen=True, slots=True)
class MisplacedPictureFault:
    """A camera says that it took a picture elsewhere, so that all that it shows is displaced alike.

    Attributes:
        by: length of the displacement, m.
        direction: unit vector in W; None for a random horizontal one.
    """

    by: Annotated[float, Amount("the error of the position, as in `by: 60 mm`", LENGTH, _STRONGEST)]
    direction: Annotated[_UnitVector, _WAY] | None = None


@dataclass(frozen=True, slots=True)
class SensorFault:
    """One measured quantity, or the depth of a camera, is noisy, late or interrupted for a while.

    Attributes:
        of: name of the measured quantity or of the camera.
        lasts: duration in ticks.
        noise: standard deviation of each of its numbers, SI.
        latency: additional latency, s.
        dropout: share of ticks without a reading, in [0, 1].
    """

    of: Annotated[
        str,
        Known("the affected quantity or camera, as in `of: tool_position`", "measured", "quantity or camera"),
    ]
    lasts: Annotated[int, Duration("duration of the fault, as in `lasts: 2 s`")]
    noise: Annotated[float, Deviation("standard deviation of each number, as in `noise: 5 mm`")] = 0.0
    latency: Annotated[float, Amount("the latency, as in `latency: 50 ms`", TIME, LONGEST)] = 0.0
    dropout: Annotated[float, Share("the share of ticks without a reading, as in `dropout: 0.2`")] = 0.0


_SCANNER: Final = Known(
    "the safety laser scanner, as in `scanner: fence_west`", "scanners", "safety laser scanner"
)


@dataclass(frozen=True, slots=True)
class CoveredScannerFault:
    """The window of a safety laser scanner is dirty or covered for a while.

    Attributes:
        scanner: its name.
        lasts: duration in ticks.
        share: share of its window, from the middle, in [0, 1].
    """

    scanner: Annotated[str, _SCANNER]
    lasts: Annotated[int, Duration("duration of the fault, as in `lasts: 2 s`")]
    share: Annotated[float, Share("share of the window; all of it if absent, as in `share: 0.1`")] = 1.0


@dataclass(frozen=True, slots=True)
class SilentScannerFault:
    """A safety laser scanner sends nothing for a while.

    Attributes:
        scanner: its name.
        lasts: duration in ticks.
    """

    scanner: Annotated[str, _SCANNER]
    lasts: Annotated[int, Duration("duration of the fault, as in `lasts: 2 s`")]


KINDS: Final[dict[str, type[Any]]] = {
    "bump": ImpulseFault,
    "carry": CarryFault,
    "put": BoxFault,
    "slip": PadFrictionFault,
    "loosen": GripForceFault,
    "weaken": TorqueFault,
    "delay": CommandDelayFault,
    "misread": SensorFault,
    "cover": CoveredScannerFault,
    "silence": SilentScannerFault,
    "enter": Person,
    "miss": MissedPictureFault,
    "misplace": MisplacedPictureFault,
}
"""The kinds by the field of `Fault` that declares them; who enters is declared as in a people file."""


# The file around them.


@dataclass(frozen=True)
class FaultTrigger:
    """Opportunities of a fault: exactly one of `skill`, `look` and `every`.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    skill: Annotated[TextField, Pattern("dotted")] | None = field(
        default=None, metadata={"doc": "each time that this skill begins, as in `skill: make_dumplings.wrap`"}
    )
    look: Identifier | None = field(
        default=None, metadata={"doc": "each picture that this camera takes, as in `look: mast`"}
    )
    during: Annotated[TextField, Pattern("dotted")] | None = field(
        default=None,
        metadata={"doc": "with `look`: while this skill runs, as in `during: fetch_object.detect`"},
    )
    every: TextField | None = field(
        default=None,
        metadata={"doc": "each interval of this length on the plant's clock, as in `every: 1 s`"},
    )
    once: ChoiceField[Literal["holding"]] | None = field(
        default=None,
        metadata={"doc": "with `skill`: from when the hand first holds something, as in `once: holding`"},
    )
    after: TextField | None = field(
        default=None, metadata={"doc": "with `skill`: after this further delay, as in `after: 500 ms`"}
    )


@dataclass(frozen=True)
class Bursts:
    """Bursts of faults, by a Markov chain with two states (Gilbert–Elliott).

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    mean_length: Annotated[NumberField, ValueBounds(1, 1_000_000)] = field(
        metadata={"doc": "the mean number of opportunities in the bad state, as in `mean_length: 4`"}
    )
    within: Probability | None = field(
        default=None, metadata={"doc": "the rate in the bad state; 1 if absent, as in `within: 0.9`"}
    )
    between: Probability | None = field(
        default=None, metadata={"doc": "the rate in the good state; 0 if absent, as in `between: 0.01`"}
    )


@dataclass(frozen=True)
class Fault:
    """One fault: its opportunities, its rate, and exactly one kind of effect.

    Attributes:
        span: its place in the file.
        key_span: place of its name.
    """

    span: SourceSpan
    key_span: SourceSpan
    at: FaultTrigger = field(
        metadata={
            "doc": "the opportunities that the rate refers to",
            "example": "{skill: make_dumplings.wrap}",
        }
    )
    rate: Probability = field(
        metadata={"doc": "the share of opportunities at which it happens, as in `rate: 0.3`"}
    )
    description: TextField | None = field(default=None, metadata={"doc": "the fault's meaning, for people"})
    at_most: Annotated[IntegerField, ValueBounds(1, 1_000_000)] | None = field(
        default=None,
        metadata={"doc": "the greatest number in one run; unlimited if absent, as in `at_most: 1`"},
    )
    bursts: Bursts | None = field(
        default=None, metadata={"doc": "clustering of occurrences; independent if absent"}
    )
    bump: Written[ImpulseFault] | None = field(default=None, metadata={"doc": "an object is pushed"})
    carry: Written[CarryFault] | None = field(
        default=None, metadata={"doc": "somebody moves an object elsewhere"}
    )
    put: Written[BoxFault] | None = field(
        default=None, metadata={"doc": "somebody puts a box somewhere and leaves it there"}
    )
    slip: Written[PadFrictionFault] | None = field(
        default=None, metadata={"doc": "the finger pads are slippery"}
    )
    loosen: Written[GripForceFault] | None = field(default=None, metadata={"doc": "the fingers grip less"})
    weaken: Written[TorqueFault] | None = field(default=None, metadata={"doc": "the arm has less torque"})
    delay: Written[CommandDelayFault] | None = field(
        default=None, metadata={"doc": "the arm follows commands late"}
    )
    misread: Written[SensorFault] | None = field(
        default=None, metadata={"doc": "a sensor is noisy, late or interrupted"}
    )
    cover: Written[CoveredScannerFault] | None = field(
        default=None, metadata={"doc": "the window of a safety laser scanner is dirty or covered"}
    )
    silence: Written[SilentScannerFault] | None = field(
        default=None, metadata={"doc": "a safety laser scanner sends nothing"}
    )
    enter: Person | None = field(
        default=None, metadata={"doc": "a person comes, declared as in a people file"}
    )
    miss: Written[MissedPictureFault] | None = field(
        default=None, metadata={"doc": "with `look`: the camera is dazzled, and shows nothing"}
    )
    misplace: Written[MisplacedPictureFault] | None = field(
        default=None, metadata={"doc": "with `look`: all that the picture shows is elsewhere"}
    )


@dataclass(frozen=True)
class Faults:
    """A whole faults file.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    schema: Literal["aeros/faults/1"] = field(metadata={"doc": "`schema: aeros/faults/1`"})
    faults: Annotated[MappingField[Fault], Pattern("identifier"), LengthBounds(1, 1000)] = field(
        metadata={"doc": "the faults, by name"}
    )
    description: TextField | None = field(default=None, metadata={"doc": "the file's purpose, for people"})
