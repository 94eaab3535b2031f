"""Schema of the motion section of a site file, unresolved and closed."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

from aeros.spec.declared.field_types import Identifier, Named, Slug
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.text.fields import (
    ChoiceField,
    IntegerField,
    TextField,
    ValueBounds,
)


@dataclass(frozen=True)
class HeldContact:
    """A surface that a held object may touch: barriers around its volumes apply there to links alone.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    volumes: tuple[Identifier, ...] = field(metadata={"doc": "volumes of the site, as in `[bench]`"})
    speed: Identifier = field(
        metadata={"doc": "the constant with the tool's greatest speed there, on its way to the target"}
    )
    within: TextField | None = field(
        default=None,
        metadata={
            "doc": "greatest distance of the tool from the motion's start or target there, as in `120 mm`; "
            "without it only motions under force control touch the surface"
        },
    )


@dataclass(frozen=True)
class MotionKind:
    """Meaning of an action kind's parameters for its motion.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    tool_ends_at: Identifier | None = field(
        default=None, metadata={"doc": "the parameter with the tool's final position in W"}
    )
    joints_end_at: tuple[Identifier, ...] | None = field(
        default=None,
        metadata={"doc": "the parameters with the final joint positions, in order, as in `[q1, q2]`"},
    )
    base_ends_at: tuple[Identifier, ...] | None = field(
        default=None, metadata={"doc": "the parameters with the base's final position in W, as in `[x, y]`"}
    )
    peak_speed: Identifier | None = field(
        default=None,
        metadata={
            "doc": "the parameter that bounds the tool's speed in W; the base's, if only the base moves"
        },
    )
    held_touches: HeldContact | None = field(
        default=None, metadata={"doc": "the surface that these actions may bring a held object into"}
    )


@dataclass(frozen=True)
class JointLimits:
    """Names of constants with the limits of the joints, one value for each joint.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    lowest: Identifier = field(metadata={"doc": "lowest positions"})
    highest: Identifier = field(metadata={"doc": "highest positions"})
    speed: Identifier = field(metadata={"doc": "greatest speeds"})
    acceleration: Identifier = field(metadata={"doc": "greatest accelerations"})
    jerk: Identifier = field(metadata={"doc": "greatest jerks"})


@dataclass(frozen=True)
class ToolLimits:
    """Names of constants with the limits of the tool point.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    speed: Identifier = field(metadata={"doc": "greatest speed"})
    acceleration: Identifier = field(metadata={"doc": "greatest acceleration"})
    jerk: Identifier = field(metadata={"doc": "greatest jerk"})
    turning_speed: Identifier = field(metadata={"doc": "greatest rotational speed"})
    turning_acceleration: Identifier = field(metadata={"doc": "greatest rotational acceleration"})
    turning_jerk: Identifier = field(metadata={"doc": "greatest rotational jerk"})


@dataclass(frozen=True)
class BaseLimits:
    """Names of constants with the limits of the base.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    speed: Identifier = field(metadata={"doc": "greatest speed"})
    acceleration: Identifier = field(metadata={"doc": "greatest acceleration"})
    measured_by: Identifier = field(
        metadata={"doc": "the state variable that measures the base's position in W"}
    )


@dataclass(frozen=True)
class Barrier:
    """A volume that links must stay out of, or inside, during every motion.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    id: Slug = field(metadata={"doc": "a short name, as in `id: into-the-bench`"})
    volume: Identifier = field(metadata={"doc": "a volume of the site"})
    keep: ChoiceField[Literal["out", "in"]] = field(
        metadata={"doc": "`out`: links stay outside; `in`: they stay inside"}
    )
    rationale: TextField = field(metadata={"doc": "the reason for the barrier"})
    frame: ChoiceField[Literal["world", "base"]] | None = field(
        default=None, metadata={"doc": "the frame of the volume's corners; `world` if absent"}
    )
    links: tuple[Identifier, ...] | None = field(
        default=None,
        metadata={"doc": "the links that it applies to, `held` for what is held; all if absent"},
    )


@dataclass(frozen=True)
class HeldObject:
    """Space that a held object may take up; it moves with the tool like a link named `held`.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    unless_false: Identifier | None = field(
        default=None,
        metadata={"doc": "the state variable that tells if something is held; if unknown, something is"},
    )
    volume: Identifier | None = field(
        default=None,
        metadata={
            "doc": "a volume of the site that encloses the largest object; its corners are relative to the "
            "tool point, along the axes of the last joint"
        },
    )
    gripped_by: tuple[Identifier, ...] = field(
        default=(),
        metadata={"doc": "the action kinds that grip or release; nothing else moves meanwhile"},
    )
    nothing: TextField | None = field(
        default=None,
        metadata={"doc": "instead of all others: the reason why this robot never holds anything"},
    )


@dataclass(frozen=True)
class Tracking:
    """Bound on the distance of the robot from where it is commanded.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    measured_by: Identifier = field(
        metadata={"doc": "the state variable with the greatest distance of a link from its commanded place"}
    )
    within: TextField = field(
        metadata={
            "doc": "its bound, as in `10 mm`: a rule on each moving kind requires it of `measured_by`, and "
            "the monitor compares measured joints and base with the decided motion"
        }
    )
    levers: Identifier = field(
        metadata={"doc": "constants: greatest distance of any link from the axis of each joint"}
    )


@dataclass(frozen=True)
class DrivingContact:
    """Speed limit of a base that drives where a person may be touched, with the mass of all that drives.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    measured_by: Identifier = field(metadata={"doc": "the state variable with the speed of the base"})
    speed: Identifier = field(
        metadata={"doc": "constant: greatest speed there, which the rules on each moving kind must keep"}
    )
    mass: Identifier = field(metadata={"doc": "constant: mass m of the base and all that it carries"})


@dataclass(frozen=True)
class ContactLimits:
    """Limits of a contact with a person: v <= F/√(m·k) for every region of the body.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    distance: Identifier = field(
        metadata={"doc": "the state variable with the distance of the nearest person"}
    )
    within: Identifier = field(metadata={"doc": "constant: where a person is nearer, a contact may happen"})
    measured_by: Identifier = field(
        metadata={"doc": "the state variable with the speed of the fastest link, also while the robot brakes"}
    )
    speed: Identifier = field(
        metadata={"doc": "constant: greatest speed there, which the rules on each moving kind must keep"}
    )
    transient_force: Identifier = field(
        metadata={"doc": "constants: greatest force F on each region of the body in the first 0.5 s"}
    )
    stiffness: Identifier = field(metadata={"doc": "constants: stiffness k of each region"})
    mass: Identifier = field(metadata={"doc": "constant: effective mass m of the robot"})
    base: DrivingContact | None = field(
        default=None, metadata={"doc": "the same for a base that drives; required if the site has one"}
    )


@dataclass(frozen=True)
class LateTicks:
    """Limits of control ticks that come late, on plants that run in real time.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    period: TextField = field(
        metadata={"doc": "a tick is late if more time has passed since the one before, as in `20 ms`"}
    )
    in_a_row: Annotated[IntegerField, ValueBounds(0, 1000)] = field(
        metadata={"doc": "late ticks in a row, at most; one more stops the robot"}
    )
    longest: TextField = field(
        metadata={"doc": "longest time between two ticks; a longer one stops the robot, as in `100 ms`"}
    )


@dataclass(frozen=True)
class WatchedVolume:
    """A volume in which pictures with depth show what nobody declared.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    surface: TextField = field(metadata={"doc": "height in W on which things stand there, as in `0 mm`"})
    least_height: TextField = field(
        metadata={"doc": "what is lower over the surface is no obstacle: the objects of tasks, as in `70 mm`"}
    )
    greatest_height: TextField | None = field(
        default=None,
        metadata={
            "doc": "what is higher over the surface is no obstacle, as scanners see it, as in `24 cm`; "
            "no bound if absent"
        },
    )
    explained_within: TextField | None = field(
        default=None,
        metadata={
            "doc": "distance as of all volumes, where cameras are farther off, as in `120 mm`; that of all "
            "if absent"
        },
    )


@dataclass(frozen=True)
class Obstacles:
    """Obstacles: what the pictures of the site's cameras show, and neither robot nor module explains.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    within: Named[WatchedVolume] = field(
        metadata={"doc": "volumes of the site that cameras see, with the surface in each"}
    )
    margin: TextField = field(
        metadata={"doc": "uncertainty of the pictures: every obstacle is larger by it, as in `15 mm`"}
    )
    explained_within: TextField = field(
        metadata={
            "doc": "distance from the robot, or from an object that a module measures, within which points "
            "belong to it, as in `30 mm`"
        }
    )
    largest_explained: tuple[TextField, ...] = field(
        metadata={
            "doc": "greatest edges of the space that a module may explain, as in `[40 cm, 60 cm, 50 cm]`"
        }
    )
    base: Identifier | None = field(
        default=None,
        metadata={
            "doc": "the volume that the base itself takes up, in its own frame: it keeps clear of obstacles "
            "where it drives; only the links do if absent"
        },
    )


@dataclass(frozen=True)
class MotionPolicy:
    """Limits that the gate checks on the whole trajectory of an action before it starts.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    on: Named[MotionKind] = field(metadata={"doc": "the action kinds that move the robot"})
    starts_at: Identifier = field(metadata={"doc": "the state variable that measures the joints"})
    starts_within: TextField = field(
        metadata={"doc": "greatest distance from the measured joints to a motion's start, as in `50 mrad`"}
    )
    ends_within: TextField = field(
        metadata={"doc": "greatest distance from the target to a motion's end, as in `1 mm`"}
    )
    joints: JointLimits = field(metadata={"doc": "limits of the joints"})
    tool: ToolLimits = field(metadata={"doc": "limits of the tool point"})
    clearance: TextField = field(metadata={"doc": "the distance of links from every barrier, as in `20 mm`"})
    link_clearance: TextField = field(metadata={"doc": "the distance of links from each other, as in `5 mm`"})
    held: HeldObject = field(metadata={"doc": "the space of a held object"})
    tracking: Tracking = field(metadata={"doc": "bound on the distance of the robot from its commands"})
    base: BaseLimits | None = field(default=None, metadata={"doc": "limits of a base that drives"})
    barriers: tuple[Barrier, ...] = field(default=(), metadata={"doc": "keep-out and keep-in volumes"})
    back_off: Identifier | None = field(
        default=None,
        metadata={
            "doc": "the action kind whose rules allow the robot to back off from a contact, the way it came"
        },
    )
    contact: ContactLimits | None = field(
        default=None, metadata={"doc": "limits of a contact with a person; not checked if absent"}
    )
    late_ticks: LateTicks | None = field(
        default=None, metadata={"doc": "limits of late ticks; plants that run in real time need them"}
    )
    obstacles: Obstacles | None = field(
        default=None, metadata={"doc": "obstacles in pictures; none are looked for if absent"}
    )
