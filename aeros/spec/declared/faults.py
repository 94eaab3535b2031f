"""What a faults file says, unresolved: what goes wrong in simulation, when and how often.

Names and quantities are still text; `aeros.sim.faults.reading` gives them meaning.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal, TypeVar

from aeros.spec.declared.people import Person
from aeros.spec.located import Bounds, Choice, Entries, Integer, Length, Number, Pattern, Text
from aeros.spec.source import Span

Identifier = Annotated[Text, Pattern("identifier")]
_T = TypeVar("_T")
Named = Annotated[Entries[_T], Pattern("identifier")]
"""A mapping whose keys are identifiers."""
Probability = Annotated[Number, Bounds(0, 1)]
Direction = Annotated[tuple[Number, ...], Length(3, 3)]


@dataclass(frozen=True)
class At:
    """What a fault's rate is per: exactly one of `skill`, `look` and `every`."""

    span: Span
    skill: Annotated[Text, Pattern("dotted")] | None = field(
        default=None, metadata={"doc": "each time that this skill begins, as in `skill: make_dumplings.wrap`"}
    )
    look: Identifier | None = field(
        default=None, metadata={"doc": "each picture that this camera takes, as in `look: mast`"}
    )
    during: Annotated[Text, Pattern("dotted")] | None = field(
        default=None,
        metadata={"doc": "with `look`: while this skill runs, as in `during: fetch_object.detect`"},
    )
    every: Text | None = field(
        default=None, metadata={"doc": "each such span of time on the plant's clock, as in `every: 1 s`"}
    )
    once: Choice[Literal["holding"]] | None = field(
        default=None,
        metadata={"doc": "with `skill`: from the first hold, as in `once: holding`"},
    )
    after: Text | None = field(
        default=None, metadata={"doc": "with `skill`: and then so long, as in `after: 500 ms`"}
    )


@dataclass(frozen=True)
class Bursts:
    """Faults that come in bursts, by a chain of two states (Gilbert–Elliott)."""

    span: Span
    mean_length: Annotated[Number, Bounds(1, 1_000_000)] = field(
        metadata={"doc": "how many opportunities the bad state lasts on average, as in `mean_length: 4`"}
    )
    within: Probability | None = field(
        default=None, metadata={"doc": "the rate in the bad state; 1 if absent, as in `within: 0.9`"}
    )
    between: Probability | None = field(
        default=None, metadata={"doc": "the rate in the good state; 0 if absent, as in `between: 0.01`"}
    )


@dataclass(frozen=True)
class Bump:
    """A thing is pushed: an impulse on it, in one direction."""

    span: Span
    thing: Identifier = field(metadata={"doc": "what is pushed, as in `thing: wrapper`"})
    impulse: Text = field(metadata={"doc": "how hard, as in `impulse: 0.04 N*s`"})
    over: Text | None = field(
        default=None, metadata={"doc": "how long the push lasts; 50 ms if absent, as in `over: 100 ms`"}
    )
    direction: Direction | None = field(
        default=None,
        metadata={"doc": "which way, in W; any level way if absent, as in `direction: [0, 1, 0]`"},
    )


@dataclass(frozen=True)
class Slip:
    """The finger pads are slippery for a while."""

    span: Span
    friction: Probability = field(metadata={"doc": "the pads' friction then (1 else), as in `friction: 0.1`"})
    lasts: Text = field(metadata={"doc": "for how long, as in `lasts: 500 ms`"})


@dataclass(frozen=True)
class Loosen:
    """The fingers grip with less force for a while."""

    span: Span
    force: Text = field(metadata={"doc": "the most that they grip with then, as in `force: 0 N`"})
    lasts: Text = field(metadata={"doc": "for how long, as in `lasts: 300 ms`"})


@dataclass(frozen=True)
class Weaken:
    """The arm's motors have less torque for a while."""

    span: Span
    torque: Probability = field(metadata={"doc": "the share of it that is left, as in `torque: 0.2`"})
    lasts: Text = field(metadata={"doc": "for how long, as in `lasts: 2 s`"})


@dataclass(frozen=True)
class Delay:
    """The arm's motors follow commands late for a while."""

    span: Span
    by: Text = field(metadata={"doc": "how late, as in `by: 100 ms`"})
    lasts: Text = field(metadata={"doc": "for how long, as in `lasts: 2 s`"})


@dataclass(frozen=True)
class Miss:
    """A picture is evaluated as if what is looked for were not on it."""

    span: Span


@dataclass(frozen=True)
class Misplace:
    """A picture's evaluation is off: what is looked for seems to be elsewhere."""

    span: Span
    by: Text = field(metadata={"doc": "how far, as in `by: 60 mm`"})
    direction: Direction | None = field(
        default=None,
        metadata={"doc": "which way, in W; any level way if absent, as in `direction: [0, 1, 0]`"},
    )


@dataclass(frozen=True)
class Misread:
    """One measured quantity is noisy, late or interrupted for a while."""

    span: Span
    of: Identifier = field(metadata={"doc": "which quantity of the site, as in `of: tool_position`"})
    lasts: Text = field(metadata={"doc": "for how long, as in `lasts: 2 s`"})
    noise: Text | None = field(
        default=None, metadata={"doc": "standard deviation of each number, as in `noise: 5 mm`"}
    )
    latency: Text | None = field(default=None, metadata={"doc": "how late, as in `latency: 50 ms`"})
    dropout: Probability | None = field(
        default=None, metadata={"doc": "in which share of ticks nothing is read, as in `dropout: 0.2`"}
    )


@dataclass(frozen=True)
class Fault:
    """One fault: when it can happen, how often it does, and exactly one kind of what happens."""

    span: Span
    key_span: Span
    at: At = field(metadata={"doc": "what the rate is per", "example": "{skill: make_dumplings.wrap}"})
    rate: Probability = field(metadata={"doc": "in which share of these it happens, as in `rate: 0.3`"})
    description: Text | None = field(default=None, metadata={"doc": "what it stands for, for people"})
    at_most: Annotated[Integer, Bounds(1, 1_000_000)] | None = field(
        default=None, metadata={"doc": "how often in one run; without end if absent, as in `at_most: 1`"}
    )
    bursts: Bursts | None = field(
        default=None, metadata={"doc": "how those that happen come together; independent if absent"}
    )
    bump: Bump | None = field(default=None, metadata={"doc": "a thing is pushed"})
    slip: Slip | None = field(default=None, metadata={"doc": "the finger pads are slippery"})
    loosen: Loosen | None = field(default=None, metadata={"doc": "the fingers grip less"})
    weaken: Weaken | None = field(default=None, metadata={"doc": "the arm is weak"})
    delay: Delay | None = field(default=None, metadata={"doc": "the arm is late"})
    misread: Misread | None = field(default=None, metadata={"doc": "a sensor reads badly"})
    enter: Person | None = field(
        default=None, metadata={"doc": "somebody comes, who is declared as in a people file"}
    )
    miss: Miss | None = field(default=None, metadata={"doc": "with `look`: nothing is detected"})
    misplace: Misplace | None = field(default=None, metadata={"doc": "with `look`: what is detected is off"})


@dataclass(frozen=True)
class Faults:
    """A whole faults file."""

    span: Span
    schema: Literal["aeros/faults/1"] = field(metadata={"doc": "`schema: aeros/faults/1`"})
    faults: Annotated[Entries[Fault], Pattern("identifier"), Length(1, 1000)] = field(
        metadata={"doc": "the faults, by name"}
    )
    description: Text | None = field(default=None, metadata={"doc": "what is tried, for people"})
