"""Scenes: a robot's surroundings in a simulator, and the truth of its goals. SI units, positions in m.

Only `aeros.spec.scenes` builds them; simulators and the referee read them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Final, Literal, NamedTuple

from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.expr import terms as t

Vector = tuple[float, float, float]
Pair = tuple[float, float]
Colour = tuple[float, float, float]

GREY: Final[Colour] = (0.7, 0.7, 0.7)

BASIN_WALL: Final = 0.005
"""Thickness of the walls and of the floor of a basin, m."""


class RobotMount(NamedTuple):
    """Mount and place of the robot.

    Attributes:
        carriage: True if it drives along x and y of W, else it is fixed.
        base: position of the arm's base in W at the start.
    """

    carriage: bool
    base: Vector


class SceneCamera(NamedTuple):
    """A pinhole camera.

    Attributes:
        frame: frame of `eye`, `target` and `up`: W (`cell`); the arm's base, parallel to W; or the tool point
            with x along the hand's heading and z up.
        eye: its position.
        target: the point that it looks at.
        up: the direction that is up in the picture.
        field_of_view: vertical, degrees.
        width: of the picture, pixels.
        height: of the picture, pixels.
        at_start: True if it has taken a picture when the clock starts.
    """

    frame: Literal["cell", "base", "hand"]
    eye: Vector
    target: Vector
    up: Vector
    field_of_view: float
    width: int
    height: int
    at_start: bool


class AlternativePlace(NamedTuple):
    """A second position.

    Attributes:
        position: in the frame of the first.
        farther_from: name of the body or place that the chosen one is farther from.
    """

    position: Vector
    farther_from: str


class Placement(NamedTuple):
    """Pose of a place or body at the start, with its random part.

    Attributes:
        frame: name of the place or body whose frame it is in; None for W.
        position: of the anchor, in that frame.
        yaw: about z of the frame, rad.
        spread: greatest random offset along x, y and z of W.
        yaw_spread: greatest random rotation, rad.
        stream: name of its random numbers.
        anchor: the point of the body, in its own frame, that is put at `position`.
        alternative: a second position; None if there is none.
    """

    frame: str | None
    position: Vector
    yaw: float
    spread: Vector
    yaw_spread: float
    stream: str
    anchor: Vector = (0.0, 0.0, 0.0)
    alternative: AlternativePlace | None = None


class Box(NamedTuple):
    """A box.

    Attributes:
        edges: full lengths of its edges along its own x, y and z.
    """

    edges: Vector


class Cylinder(NamedTuple):
    """A cylinder about its own z axis.

    Attributes:
        radius: its radius.
        height: full height.
    """

    radius: float
    height: float


class Sphere(NamedTuple):
    """A sphere.

    Attributes:
        radius: its radius.
    """

    radius: float


class Basin(NamedTuple):
    """A box without a lid; its frame is the middle of its floor's top.

    Attributes:
        inner: inner length, width and depth.
    """

    inner: Vector


class Part(NamedTuple):
    """A part of a compound.

    Attributes:
        shape: its shape.
        position: its middle in the body's frame.
        colour: red, green and blue in [0, 1].
    """

    shape: Box | Cylinder | Sphere
    position: Vector
    colour: Colour


class Compound(NamedTuple):
    """Parts that are one rigid body.

    Attributes:
        parts: the parts.
    """

    parts: tuple[Part, ...]


class Joint(NamedTuple):
    """Settings of a joint of a model.

    Attributes:
        friction: dry friction, N·m or N.
        range: least and greatest position, rad or m; None as the model has it.
    """

    friction: float
    range: Pair | None


class UrdfModel(NamedTuple):
    """A URDF file that has been checked.

    Attributes:
        path: path of the file.
        links: names of its links, the base first.
        joints: type of each movable joint, as in URDF, by its name.
        link_friction: Coulomb coefficients of links that differ from the body's.
        joint_settings: settings of joints.
        underside: depth of its lowest point below its frame.
        surfaces: middle, length and width of rectangles on which things can lie, in its frame.
    """

    path: str
    links: tuple[str, ...]
    joints: Mapping[str, str]
    link_friction: Mapping[str, float] = {}
    joint_settings: Mapping[str, Joint] = {}
    underside: float = 0.0
    surfaces: tuple[tuple[Vector, Pair], ...] = ()


Shape = Box | Cylinder | Sphere | Basin | Compound | UrdfModel


class Grip(NamedTuple):
    """The part of a body that fingers close on, in the body's frame.

    Attributes:
        low: lowest corner.
        high: highest corner.
    """

    low: Vector
    high: Vector


class LookPart(NamedTuple):
    """A part of what films show of a body.

    Attributes:
        kind: its shape.
        size: full lengths of a box or ellipsoid; radius and height of a cylinder, then 0; radius and length
            of the straight part of a capsule, then 0; radius of a sphere, then 0, 0.
        colour: red, green and blue in [0, 1].
        opacity: 1 of what is opaque.
        position: its middle in the frame of its link.
        tilt: rotation about x, then y, then z of that frame, rad.
        link: the link that it moves with; None for the base.
        joint: the joint that decides if it is shown; None if it always is.
        range: least and greatest position of `joint` in which it is shown, rad or m.
    """

    kind: Literal["box", "ellipsoid", "capsule", "cylinder", "sphere"]
    size: Vector
    colour: Colour
    opacity: float = 1.0
    position: Vector = (0.0, 0.0, 0.0)
    tilt: Vector = (0.0, 0.0, 0.0)
    link: str | None = None
    joint: str | None = None
    range: Pair = (0.0, 0.0)


class BodyVariation(NamedTuple):
    """Ranges from which properties of a body are drawn if a run is randomised.

    Attributes:
        mass: least and greatest factor on its mass.
        friction: least and greatest factor on its friction and its links'.
        colour: greatest change of each of its red, green and blue.
        spread: added to the spread of its placement.
        yaw_spread: likewise, rad.
    """

    mass: Pair = (1.0, 1.0)
    friction: Pair = (1.0, 1.0)
    colour: float = 0.0
    spread: Vector = (0.0, 0.0, 0.0)
    yaw_spread: float = 0.0


class SceneVariation(NamedTuple):
    """Ranges from which properties of a whole scene are drawn if a run is randomised.

    Attributes:
        light: least and greatest factor on the colours of all bodies.
        sensors: least and greatest factor on the errors of sensors.
    """

    light: Pair = (1.0, 1.0)
    sensors: Pair = (1.0, 1.0)


@dataclass(frozen=True, slots=True)
class SceneBody:
    """A body.

    Attributes:
        name: its name.
        shape: its shape.
        placement: where it is at the start.
        mass: kg; 0 fixes it to W. A URDF model has the masses in its file, unless this is 0.
        friction: Coulomb coefficient.
        spinning: friction about the normal of a contact, m.
        rolling_resistance: lever of the braking torque as it rolls, m.
        colour: red, green and blue in [0, 1].
        grip: the part to hold it by; None if it cannot be held.
        span: where it is declared.
        look: what films show in place of its shape; empty for the shape itself.
        variation: ranges for runs that are randomised; None for none.
    """

    name: str
    shape: Shape
    placement: Placement
    mass: float
    friction: float
    spinning: float
    rolling_resistance: float
    colour: Colour
    grip: Grip | None
    span: SourceSpan
    look: tuple[LookPart, ...] = ()
    variation: BodyVariation | None = None

    @property
    def is_movable(self) -> bool:
        """True if its base moves freely."""
        return self.mass > 0.0


class BodyPart(NamedTuple):
    """A body, or one of its links or joints.

    Attributes:
        body: name of the body.
        part: name of the link or joint; None for the body itself.
    """

    body: str
    part: str | None = None


@dataclass(frozen=True, slots=True)
class ForceInstrument:
    """Sum of the normal forces between two bodies or links, N; for conditions alone.

    No sensor measures it: none can tell which body presses on another.

    Attributes:
        first: one of them.
        second: the other.
    """

    first: BodyPart
    second: BodyPart


@dataclass(frozen=True, slots=True)
class LoadInstrument:
    """Load cell under a body or link: the downward part of the normal forces of all that touches it, N.

    Attributes:
        of: the body or link; its own weight does not count.
    """

    of: BodyPart


@dataclass(frozen=True, slots=True)
class PositionInstrument:
    """Position in W of a body or link, m.

    Attributes:
        of: the body or link.
    """

    of: BodyPart


@dataclass(frozen=True, slots=True)
class JointInstrument:
    """Position of a joint, rad or m.

    Attributes:
        joint: the joint.
    """

    joint: BodyPart


Instrument = ForceInstrument | LoadInstrument | PositionInstrument | JointInstrument


class Region(NamedTuple):
    """A box in the frame of a body or place.

    Attributes:
        of: name of the body or place; None for W.
        low: corner with the least coordinates.
        high: corner with the greatest coordinates.
    """

    of: str | None
    low: Vector
    high: Vector


class Coating(NamedTuple):
    """A layer on a rectangle at z = 0 of W that a body wipes off, in square cells.

    Attributes:
        low: corner with the least x and y in W.
        high: corner with the greatest x and y in W.
        on: name of the coated body.
        wiped_by: name of the body that wipes.
        face: full lengths of the box around its frame whose underside wipes.
        force: force above which it wipes, N.
        gap: distance of the underside below which it wipes.
        cell: edge of a cell.
        colour: red, green and blue in [0, 1].
        under: the colour of what it covers.
    """

    low: Pair
    high: Pair
    on: str
    wiped_by: str
    face: Vector
    force: float
    gap: float
    cell: float
    colour: Colour
    under: Colour


@dataclass(frozen=True, slots=True)
class SceneCondition:
    """A condition on what is true in a simulator, or a number of what is.

    Attributes:
        term: the condition.
        text: its source text.
        span: its place in the file.
        is_number: True if it is a whole number.
    """

    term: t.Term
    text: str
    span: SourceSpan
    is_number: bool = False


class Seal(NamedTuple):
    """A joint that becomes stiff for good.

    Attributes:
        joint: the joint.
        friction: its dry friction from then on, N·m or N.
        when: the condition under which it does.
    """

    joint: BodyPart
    friction: float
    when: SceneCondition


class Press(NamedTuple):
    """A lid that folds what lies on it, for simulators without physics.

    The lid's joint has its axis along y of W and is open, at 0, towards -x.

    Attributes:
        lid: the lid's joint.
        handle: the link that fingers move it by.
        handle_radius: distance of the handle's axis from the joint's.
        handle_size: radius and length of the handle.
        range: least and greatest angle of the empty press, rad.
        folds: the joint that the lid turns.
        hinge: axis of that joint, in its body's frame.
        place: where in W that axis belongs.
        tolerance: greatest distance from there along each axis.
        gap: gap inside what is folded by half a turn.
        filling: name of the body inside that the lid meets.
        inside: name of the region in which it does.
        seal: name of the seal without which the fold opens again.
    """

    lid: BodyPart
    handle: BodyPart
    handle_radius: float
    handle_size: Pair
    range: Pair
    folds: BodyPart
    hinge: Vector
    place: Vector
    tolerance: float
    gap: float
    filling: str
    inside: str
    seal: str


class ScenePart(NamedTuple):
    """A scene file that a scene is made of.

    Attributes:
        name: name of the file without suffix.
        prefix: put before each of its names.
        digest: SHA-256 of its text, in hexadecimal.
        offset: where the origin of its W is in that of the scene, m.
    """

    name: str
    prefix: str
    digest: str
    offset: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Scene:
    """A whole scene.

    Attributes:
        name: name of its file without suffix.
        description: its purpose, for people.
        robot: how the robot is put up; None if it only adds to other scenes.
        view: the camera of films and windows; None if it only adds to other scenes.
        places: surveyed points by name; a thing is after those whose frame it is in.
        bodies: bodies by name, likewise.
        cameras: the robot's cameras by name.
        instruments: measurements of bodies by name.
        regions: boxes by name.
        coatings: layers by name.
        conditions: named conditions; each may use those before it.
        seals: joints that become stiff, by name.
        timers: conditions whose time is measured, by name.
        presses: lids with a handle, by name.
        truth: condition under which each state variable of a goal is true; a module's by its full name.
        variables: name of the state variable of each place and instrument that is not called as it is, by the
            thing's name.
        parts: the files that it is made of, its own first.
        module: the module that its file names; None for none.
        variation: ranges for runs that are randomised; None for none.
        sensor_factor: factor on the errors of sensors; 1 unless the run is randomised.
    """

    name: str
    description: str
    robot: RobotMount | None
    view: SceneCamera | None
    places: Mapping[str, Placement]
    bodies: Mapping[str, SceneBody]
    cameras: Mapping[str, SceneCamera]
    instruments: Mapping[str, Instrument]
    regions: Mapping[str, Region]
    coatings: Mapping[str, Coating]
    conditions: Mapping[str, SceneCondition]
    seals: Mapping[str, Seal]
    timers: Mapping[str, SceneCondition]
    presses: Mapping[str, Press]
    truth: Mapping[str, SceneCondition]
    parts: tuple[ScenePart, ...] = field(default=())
    variables: Mapping[str, str] = field(default_factory=dict)
    module: str | None = None
    variation: SceneVariation | None = None
    sensor_factor: float = 1.0

    def measured(self) -> Iterator[tuple[str, str]]:
        """Yield what is surveyed and what instruments measure.

        Yields:
            Name of the state variable, and of the place or instrument that gives its value.
        """
        for name in (*self.places, *self.instruments):
            if not isinstance(self.instruments.get(name), ForceInstrument):
                yield self.variables.get(name, name), name

    def unmeasured(self, variables: Iterable[str]) -> list[str]:
        """List the variables that nothing in the scene gives a value, so that they stay unknown in it.

        Args:
            variables: full names of state variables that sensors of the site measure.

        Returns:
            Those for which there is neither a place nor an instrument.
        """
        given = {self.variables.get(name, name) for name in (*self.places, *self.instruments)}
        return [name for name in variables if name not in given]

    def placements(self) -> Iterator[tuple[str, Placement]]:
        """Yield the placement of each place and body.

        Yields:
            Name and placement; a thing comes after those whose frame it is in.
        """
        yield from self.places.items()
        yield from ((name, body.placement) for name, body in self.bodies.items())

    @property
    def movable(self) -> tuple[str, ...]:
        """Names of the bodies whose base moves freely."""
        return tuple(name for name, body in self.bodies.items() if body.is_movable)
