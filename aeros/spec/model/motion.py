"""Motion policy of a site: limits and barriers by which whole trajectories are decided. SI."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

from aeros.spec.expr.scope import AxisAlignedBox


@dataclass(frozen=True)
class TouchedSurface:
    """Volumes that a held object may touch in motions of one kind, and the limits of it.

    Attributes:
        volumes: names of the site's volumes.
        speed: greatest speed of the tool on its way to a target there, m/s.
        distance: greatest distance of the tool from the motion's start or target, m; None if unlimited.
    """

    volumes: frozenset[str]
    speed: Fraction
    distance: Fraction | None = None


@dataclass(frozen=True)
class MotionKind:
    """Meaning of an action kind's parameters for its motion.

    Attributes:
        tool_target: parameter with the tool's target, a vector in W.
        base_target: parameters with x and y of the base's target in W.
        peak_speed: parameter that bounds the speed of the motion.
        joint_target: parameter with the target of each joint, in order.
        surface: the volumes that a held object may touch; None if it may touch none.
    """

    tool_target: str | None
    base_target: tuple[str, str] | None
    peak_speed: str | None
    joint_target: tuple[str, ...] | None = None
    surface: TouchedSurface | None = None


@dataclass(frozen=True)
class Barrier:
    """Volume that links keep out of, or stay inside, in every motion.

    Attributes:
        id: name of the barrier.
        volume: name of the site's volume.
        box: corners of the volume, m.
        keep_inside: True if links must stay inside, False if they must stay outside.
        is_in_base_frame: the corners of `box` are in the robot's base frame, not in W.
        links: names of the links that it applies to; None for all.
        rationale: the reason for the barrier.
    """

    id: str
    volume: str
    box: AxisAlignedBox
    keep_inside: bool
    is_in_base_frame: bool
    links: frozenset[str] | None
    rationale: str


@dataclass(frozen=True)
class ToolLimits:
    """Limits of the tool point in W.

    Attributes:
        translation: greatest speed (m/s), acceleration (m/s²) and jerk (m/s³).
        rotation: greatest speed (rad/s), acceleration (rad/s²) and jerk (rad/s³).
    """

    translation: tuple[Fraction, Fraction, Fraction]
    rotation: tuple[Fraction, Fraction, Fraction]


@dataclass(frozen=True)
class HeldObject:
    """Space that a held object may take up.

    Attributes:
        variable: name of the state variable that tells if something is held; only if it is false, nothing is.
        box: relative to the tool point, along the axes of the last joint's frame.
        gripped_by: action kinds that grip or release; no motion is under way meanwhile.
    """

    variable: str
    box: AxisAlignedBox
    gripped_by: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Tracking:
    """Bound on the distance of the robot from where it is commanded.

    Attributes:
        variable: state variable that measures the distance, m.
        bound: greatest distance, m.
        levers: greatest distance of any link from the axis of each joint, m; of a prismatic joint at least 1
            m/m.
    """

    variable: str
    bound: Fraction
    levers: tuple[Fraction, ...]


@dataclass(frozen=True)
class DrivingContact:
    """Greatest speed of a base that drives where it may touch a person.

    Attributes:
        variable: state variable with the speed of the base.
        speed: its greatest value there, which the transient force of every region permits, m/s.
    """

    variable: str
    speed: Fraction


@dataclass(frozen=True)
class ContactLimits:
    """Greatest speed of the robot where it may touch a person.

    Attributes:
        distance: state variable with the distance of the nearest person.
        within: distance below which a contact may happen, m.
        variable: state variable with the speed of the fastest link.
        speed: its greatest value there, which the transient force of every region permits, m/s.
        base: of a base that drives; None if the robot has none.
    """

    distance: str
    within: Fraction
    variable: str
    speed: Fraction
    base: DrivingContact | None = None


@dataclass(frozen=True)
class LateTicks:
    """Limits of control ticks that come late, on plants that run in real time.

    Attributes:
        period: longest time between two ticks that are not late, s.
        in_a_row: greatest number of late ticks in a row.
        longest: longest time between two ticks, s.
    """

    period: Fraction
    in_a_row: int
    longest: Fraction


@dataclass(frozen=True)
class WatchedVolume:
    """Volume in which pictures with depth show what nobody declared.

    Attributes:
        name: name of the site's volume.
        box: corners of the volume in W, m.
        surface: height in W on which things stand there, m.
        least_height: height over the surface below which things are no obstacles, m.
        greatest_height: height over the surface above which things are no obstacles, m; None if there is no
            bound.
        explained_within: distance within which points belong to the robot or a measured object there, m; None
            if it is that of all volumes.
    """

    name: str
    box: AxisAlignedBox
    surface: Fraction
    least_height: Fraction
    greatest_height: Fraction | None = None
    explained_within: Fraction | None = None


@dataclass(frozen=True)
class ObstaclePolicy:
    """Obstacles: what pictures show, and neither the robot nor what a module measures explains.

    Attributes:
        volumes: the volumes to look in.
        margin: uncertainty of the pictures, by which every obstacle is enlarged on each side, m.
        explained_within: distance from the robot, or from a measured object, within which points belong to
            it, m.
        largest_explained: greatest edges of a space that a module may explain, m.
        base: corners of what drives, in the frame of the base, m; None if it is not compared with obstacles.
    """

    volumes: tuple[WatchedVolume, ...]
    margin: Fraction
    explained_within: Fraction
    largest_explained: tuple[Fraction, Fraction, Fraction]
    base: AxisAlignedBox | None = None


@dataclass(frozen=True)
class MotionPolicy:
    """Limits by which the whole trajectory of an action is decided, in SI.

    Attributes:
        kinds: meaning of the parameters of each action kind that moves the robot, by kind.
        start_variable: state variable, a family, that measures the joints.
        start_tolerance: greatest distance of a motion's start from the measured joints.
        end_tolerance: greatest distance of a motion's end from the requested target.
        is_mixed: True if positions of joints are in jpos, as some joints may be prismatic; False if all are
            in rad.
        lowest: lowest position of each joint.
        highest: highest position of each joint.
        joint_limits: speeds, accelerations and jerks, one of each per joint.
        tool_limits: limits of the tool point.
        clearance: least distance of links from barriers: room for deviations from the path, as tracking
            error.
        barriers: keep-out and keep-in volumes.
        base_limits: speed and acceleration of a mobile base.
        base_variable: state variable that measures the base's position in W; None if the base is fixed.
        link_clearance: least distance of links from each other; None if that is not checked.
        held: the space of a held object, which moves like a link named `held`; None if nothing is ever held.
        tracking: bound on the distance of the robot from its commands; None if the site has none.
        back_off: action kind whose rules govern a robot that backs off from a contact after a stop.
        contact: limits of a contact with a person; None if the site has none.
        late_ticks: limits of ticks that come late; None if the site has none.
        obstacles: obstacles to look for in pictures; None if the site looks for none.
    """

    kinds: Mapping[str, MotionKind]
    start_variable: str
    start_tolerance: Fraction
    end_tolerance: Fraction
    lowest: tuple[Fraction, ...]
    highest: tuple[Fraction, ...]
    joint_limits: tuple[tuple[Fraction, ...], tuple[Fraction, ...], tuple[Fraction, ...]]
    tool_limits: ToolLimits
    clearance: Fraction
    barriers: tuple[Barrier, ...]
    base_limits: tuple[Fraction, Fraction] | None = None
    base_variable: str | None = None
    link_clearance: Fraction | None = None
    held: HeldObject | None = None
    back_off: str | None = None
    tracking: Tracking | None = None
    contact: ContactLimits | None = None
    late_ticks: LateTicks | None = None
    obstacles: ObstaclePolicy | None = None
    is_mixed: bool = False
