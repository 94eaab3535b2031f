"""Ports of the runtime: the only interfaces that agent and simulators share with it.

Agent and simulators import this module and nothing else of the runtime. So the agent can propose but not act,
and a plant can act but not decide.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from math import inf
from typing import Any, Final, NamedTuple, NewType, Protocol

from aeros.kinematic_chain import Row
from aeros.skill import Action
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.model.cause import Cause
from aeros.spec.model.ecm import ActionCondition, Ecm
from aeros.spec.model.site import Site
from aeros.spec.verification.certificate import Certificate


class Reading(NamedTuple):
    """One measured value and the time of its measurement.

    Attributes:
        value: SI; bool, float, enum member as str, 3-tuple of float, or tuple of float for a family (in the
            order of the vocabulary's index set).
        time: seconds on the plant's clock.
    """

    value: Any
    time: float


Readings = Mapping[str, Reading]
"""Readings by vocabulary name. A missing name means that the value is unknown."""


class ColumnNames:
    """Names of the variables that are measured together, in alphabetical order.

    Attributes:
        names: the variables' names.
        places: the position of each name in `names`.
    """

    __slots__ = ("names", "places")

    def __init__(self, names: Iterable[str]) -> None:
        self.names = tuple(sorted(names))
        if not all(type(name) is str for name in self.names):
            raise MisuseError("the name of a measured variable is not a str")
        self.places = {name: place for place, name in enumerate(self.names)}


class Snapshot(Mapping[str, Reading]):
    """Readings that were all measured at one time, with their values in one tuple. Immutable.

    Attributes:
        order: the names of the variables.
        column: the value of each variable, in that order.
        time: seconds on the plant's clock.

    Consecutive snapshots may share the tuple, or most of the objects in it. A reader that has processed the
    previous snapshot then needs to look only at what differs.
    """

    __slots__ = ("column", "order", "time")

    def __init__(self, order: ColumnNames, column: tuple[Any, ...], time: float) -> None:
        if type(order) is not ColumnNames:
            raise MisuseError("a snapshot needs the names of its values as `ColumnNames`")
        if type(column) is not tuple or len(column) != len(order.names):
            raise MisuseError(
                f"a snapshot needs a tuple of {len(order.names)} values in the order of its `ColumnNames`"
            )
        self.order = order
        self.column = column
        self.time = time

    def __getitem__(self, name: str) -> Reading:
        return Reading(self.column[self.order.places[name]], self.time)

    def __contains__(self, name: object) -> bool:
        return name in self.order.places

    def __iter__(self) -> Iterator[str]:
        return iter(self.order.names)

    def __len__(self) -> int:
        return len(self.order.names)


Monitor = Callable[[float, Mapping[str, Any]], str | None]
"""Callback that checks the measurements of one control tick.

Called with the plant time (s) and the values by vocabulary name (SI); a value that was measured earlier is a
`Reading`. Returns None, or the id of the violated rule; the plant then makes a protective stop in that tick.
"""


def announce_stop(monitor: Monitor, reason: str, now: float) -> None:
    """Tell a monitor that the plant begins to stop the robot by itself, for example as something blocks it.

    A monitor that records stops has the method `begin_stop`; any other callable is not told.

    Args:
        monitor: as given to `Plant.advance`.
        reason: the reason that ended motions will have.
        now: plant time, s.
    """
    begin_stop = getattr(monitor, "begin_stop", None)
    if begin_stop is not None:
        begin_stop(reason, now)


class ObservedMonitor:
    """A monitor whose calls somebody observes, without a say in its answers.

    Args:
        monitor: gives the answers.
        observer: called after it with plant time, values and answer.
    """

    def __init__(
        self, monitor: Monitor, observer: Callable[[float, Mapping[str, Any], str | None], None]
    ) -> None:
        self._monitor = monitor
        self._observer = observer

    def __call__(self, now: float, measured: Mapping[str, Any]) -> str | None:
        """Ask the monitor, and pass its answer to the observer."""
        answer = self._monitor(now, measured)
        self._observer(now, measured, answer)
        return answer

    def begin_stop(self, reason: str, now: float) -> None:
        """Pass on that the plant begins to stop the robot by itself.

        Args:
            reason: as given to `announce_stop`.
            now: plant time, s.
        """
        announce_stop(self._monitor, reason, now)


BACK_OFF: Final = "back off"
"""Answer of a monitor during a protective stop: the robot may move back from what it touches. No rule has
this name, as names of rules have no blanks."""


@dataclass(frozen=True, slots=True)
class MotionCompletion:
    """End of one action on the plant.

    Attributes:
        completed: the plant did all of it.
        reason: None if completed; otherwise `monitor:RULE`, or the plant's own words (for example
            `unreachable: …`).
    """

    completed: bool
    reason: str | None = None


Vec3 = tuple[float, float, float]


class Ball(NamedTuple):
    """A ball that moves with a robot's link; together the balls of a link enclose it.

    Attributes:
        link: the name of the link.
        joint: number of joints that move the ball: 0 for the base, k if the first k joints carry it.
        centre: in the frame of joint `joint`, or of the base if `joint` is 0; m.
        radius: m.
    """

    link: str
    joint: int
    centre: Vec3
    radius: float


class Hull(NamedTuple):
    """All points within `radius` of the convex hull of some corners, which enclose a link closely.

    Attributes:
        link: the name of the link.
        joint: number of joints that move it, as of a `Ball`.
        corners: in the frame of joint `joint`, or of the base if `joint` is 0; m.
        radius: greatest distance of the link's points from the convex hull, m.
    """

    link: str
    joint: int
    corners: tuple[Vec3, ...]
    radius: float


@dataclass(frozen=True, slots=True)
class RobotBody:
    """A robot's chain of revolute and prismatic joints, and the balls and hulls that enclose its links.

    Attributes:
        dh_rows: a (m), alpha (rad) and d (m) of each joint: modified (Craig) Denavit–Hartenberg parameters.
            A fourth number is theta at the joint's position 0, rad. A fifth, 1.0, says that the joint is
            prismatic: its position adds to d, not to theta.
        tool_offset: the tool point in the frame of the last joint, m.
        balls: of all links; barriers are checked with them.
        hulls: one of each link; distances between links are checked with them. Empty if they are not known.
        exempt_pairs: names of two links each that need no check: a joint joins them, or they can never meet.
    """

    dh_rows: tuple[Row, ...]
    tool_offset: Vec3
    balls: tuple[Ball, ...]
    hulls: tuple[Hull, ...] = ()
    exempt_pairs: tuple[tuple[str, str], ...] = ()


class ColouredMesh(NamedTuple):
    """Triangles of one colour.

    Attributes:
        corners: positions, m.
        triangles: numbers of the corners of each triangle, counterclockwise from outside.
        colour: red, green and blue in [0, 1].
    """

    corners: Sequence[Vec3]
    triangles: Sequence[tuple[int, int, int]]
    colour: Vec3


class LinkModel(NamedTuple):
    """A link of a robot as viewers draw it; no decision depends on it.

    Attributes:
        surfaces: what is seen of it, in the frame of its hull.
        origin: file that the surfaces are of, and its licence.
    """

    surfaces: tuple[ColouredMesh, ...]
    origin: str


class PersonFigure(NamedTuple):
    """A simulated person where they are.

    Attributes:
        x, y: of the axis of their capsule in W, m.
        floor: height in W of the floor that they stand on, m.
        height: of the capsule, m.
        radius: of the capsule, m.
    """

    x: float
    y: float
    floor: float
    height: float
    radius: float


JointVector = tuple[float, ...]
"""One number for each joint; if they are positions, rad, and m of prismatic joints."""

JointPath = tuple[tuple[JointVector, JointVector, JointVector, JointVector], ...]
"""Pieces of equal length in s from 0 to 1, each a cubic given by its four Bézier control points (rad)."""


@dataclass(frozen=True, slots=True)
class ServoBounds:
    """Bounds within which the plant keeps a motion under feedback control.

    Attributes:
        joint_tolerance: greatest distance of each joint from the nearest path, rad.
        speed, acceleration, jerk: of each joint; rad/s, rad/s², rad/s³.
        tool_speed, tool_acceleration, tool_jerk: of the set point that the tool follows; m/s, m/s², m/s³.
    """

    joint_tolerance: JointVector
    speed: JointVector
    acceleration: JointVector
    jerk: JointVector
    tool_speed: float
    tool_acceleration: float
    tool_jerk: float


@dataclass(frozen=True, slots=True)
class Trajectory:
    """A whole motion, before it starts: q(s(t/duration)) with s(u) = 10u³ − 15u⁴ + 6u⁵.

    Attributes:
        body: the robot's chain and the balls that enclose its links.
        joint_paths: one path; under feedback (`servo`) several, which the motion stays near, in an order
            that the plant chooses.
        base: position of the body's base frame in W at the start, m.
        base_path: displacement of the base over the motion, in W, m.
        duration: s; under feedback an estimate.
        servo: bounds of a motion under feedback; None if the motion follows its path exactly.
    """

    body: RobotBody
    joint_paths: tuple[JointPath, ...]
    base: Vec3
    base_path: Vec3
    duration: float
    servo: ServoBounds | None = None


@dataclass(frozen=True, slots=True)
class NoMotion:
    """The plant's statement that an action moves neither joints nor base.

    Attributes:
        reason: text of the reason why nothing moves.
    """

    reason: str


class CameraView(NamedTuple):
    """Place of a camera as the robot believes it to be, in W.

    Attributes:
        eye: its position, m.
        target: the point that it looks at, m.
        up: the direction that is up in the picture.
        field_of_view: vertical, degrees.
    """

    eye: Vec3
    target: Vec3
    up: Vec3
    field_of_view: float


@dataclass(frozen=True, slots=True)
class CameraPicture:
    """A picture of one camera, row by row from the upper left corner.

    The pixel in row i and column j shows what the ray through its lower left corner meets.

    Attributes:
        camera: the camera's name.
        time: plant time at which it was taken, s.
        width: number of columns, pixels.
        height: number of rows, pixels.
        rgb: red, green and blue of each pixel, a byte each.
        depth: distance of each pixel along the optical axis, m, as float32 in the machine's byte order; None
            if the camera measures none.
        view: the place of the camera.
    """

    camera: str
    time: float
    width: int
    height: int
    rgb: bytes
    depth: bytes | None
    view: CameraView

    def __post_init__(self) -> None:
        """Check that the picture is whole.

        Raises:
            MisuseError: colours or depth have not as many bytes as the picture has pixels.
        """
        pixels = self.width * self.height
        if len(self.rgb) != 3 * pixels or (self.depth is not None and len(self.depth) != 4 * pixels):
            raise MisuseError(f"the picture of `{self.camera}` has not {self.width} × {self.height} pixels")


PlannedMotion = Trajectory | NoMotion | MotionCompletion
"""The plant's plan for an action; a `MotionCompletion` says why the plant cannot do it."""


MotionHandle = NewType("MotionHandle", int)
"""Number of one action under way on a plant, assigned by the plant."""


class PlantLostError(ConnectionError):
    """The plant can no longer be reached; the message says why."""


class Plant(Protocol):
    """Executor of allowed actions: a simulator, an in-memory fake or a robot.

    A plant never decides. It refuses actions that it cannot do (`MotionCompletion` with a reason, before any
    motion) and does not raise for them, and it stops when `monitor` names a rule. Several actions may be
    under way at a time; the caller makes sure that they share no actuator.

    A plant that does not wait for the monitor, as a robot, has an attribute `runs_in_real_time` that is True.
    The runtime then counts ticks that come late, and bounds them as the site says.

    A plant with an attribute `action_kinds`, the names of the action kinds that it can do, gets each action
    under the name that the site says it means. The runtime refuses to start if modules need other kinds.

    A plant that is out of reach ends the motions under way, and from then on raises `PlantLostError`.

    A plant that has cameras has a method `pictures() -> Mapping[str, CameraPicture]`; see `newest_pictures`.

    Example:
        >>> from aeros.sim.kinematic.plant import make_plant
        >>> from aeros.spec.scenes.load import load_scene
        >>> plant: aeros.Plant = make_plant(load_scene("bare"), 0)
        >>> motion = plant.begin(aeros.act("wait", duration=0.5))
        >>> ended = plant.advance(lambda time, values: None, until=1.0)
        >>> ended[motion].completed
        True
        >>> plant.close()
    """

    def now(self) -> float:
        """Read the plant's clock, which never goes back.

        Returns:
            Seconds.
        """

    def observe(self) -> Readings:
        """Measure every state variable now.

        The monitor may call it from inside `advance`.

        Returns:
            The readings (SI), each with its own time.
        """

    def plan(self, action: Action) -> PlannedMotion:
        """Plan the motion for an action from the robot's current state; moves nothing.

        Args:
            action: the action, parameters in SI.

        Returns:
            The motion, or the reason why the plant cannot do it.
        """

    def begin(self, action: Action, decided: PlannedMotion | None = None) -> MotionHandle | MotionCompletion:
        """Begin an action in addition to those under way; nothing moves before `advance`.

        Args:
            action: an action that the gate allowed.
            decided: the result of `plan` for this action, if it was decided; the plant then executes exactly
                that motion.

        Returns:
            A handle of the action, or its end if the plant refuses it.
        """

    def advance(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        """Continue everything under way until some of it ends.

        Args:
            monitor: called before the first control tick and after every tick. If it names a rule, the plant
                brings everything to rest, and all actions under way have ended. It is called after every
                tick of the stop, too. If it answers `BACK_OFF` when the robot has braked, the plant moves
                back slowly along the way that it came, for as long as that remains the answer. A plant that
                stops the robot by itself calls `announce_stop` first, and then calls the monitor likewise.
            until: plant time at which to return at the latest, s; no tick goes beyond it. It is reached if
                nothing is under way, too.

        Returns:
            The actions that have ended, with their ends; empty if `until` came first.
        """

    def halt(self, motion: MotionHandle) -> None:
        """Bring one motion to rest within its limits while others continue; `advance` reports its end.

        The monitor may call it from inside `advance`.

        Args:
            motion: the action to halt.
        """

    def stop(self) -> None:
        """Make a protective stop: bring every actuator to rest within its limits and hold.

        All motions are over after it.
        """

    def skill_began(self, skill: str) -> None:
        """Note that a skill starts: fault injection and the symbolic plant depend on it.

        Args:
            skill: `MODULE.SKILL`.
        """

    def skill_ended(self, skill: str, *, finished: bool) -> None:
        """Note that a skill has ended.

        Args:
            skill: `MODULE.SKILL`.
            finished: True if the skill ran to its own end, False if it was halted.
        """

    def close(self) -> None:
        """Release the plant's resources; safe to call twice."""


def newest_pictures(plant: Plant) -> Mapping[str, CameraPicture]:
    """Return the newest picture of each camera of a plant, by the camera's name.

    A picture counts from the moment at which its detections would be observable: after exposure and read-out.
    A camera that has taken none is absent.

    Args:
        plant: the plant.

    Returns:
        The pictures; empty if the plant has no method `pictures`.
    """
    pictures: Callable[[], Mapping[str, CameraPicture]] | None = getattr(plant, "pictures", None)
    return {} if pictures is None else pictures()


class Obstacle(NamedTuple):
    """Something that pictures show, and neither the robot nor a module explains.

    Attributes:
        name: stays the same while it is seen at the same place, as in `unknown-object-1`.
        lower: corner with the least coordinates in W, m; with the uncertainty of the pictures.
        upper: corner with the greatest coordinates, m.
        seen: plant time of the latest picture that shows it, s.
        camera: camera that took it.
        volume: volume of the site that it is in.
    """

    name: str
    lower: Vec3
    upper: Vec3
    seen: float
    camera: str
    volume: str

    def __str__(self) -> str:
        """As in `unknown-object-1 at (0.45, -0.10) m in bench_area, 60 x 80 x 120 mm`."""
        x, y, _ = ((a + b) / 2.0 for a, b in zip(self.lower, self.upper, strict=True))
        edges = [round(1000.0 * (b - a)) for a, b in zip(self.lower, self.upper, strict=True)]
        return f"{self.name} at ({x:.2f}, {y:.2f}) m in {self.volume}, {' x '.join(map(str, edges))} mm"


def known_action_kinds(plant: Plant) -> frozenset[str] | None:
    """Return the action kinds that a plant can do.

    Args:
        plant: the plant.

    Returns:
        Their names; None if it does not say, as a plant that has the site's own words.
    """
    kinds: Iterable[str] | None = getattr(plant, "action_kinds", None)
    return None if kinds is None else frozenset(kinds)


def known_obstacles(plant: Plant) -> tuple[Obstacle, ...]:
    """Return the obstacles that the pictures of a plant have shown.

    Args:
        plant: the plant.

    Returns:
        The obstacles, oldest first; empty if the plant has no method `obstacles`.
    """
    obstacles: Callable[[], tuple[Obstacle, ...]] | None = getattr(plant, "obstacles", None)
    return () if obstacles is None else obstacles()


def stated_body(plant: Plant) -> RobotBody | None:
    """Return the robot's body as a plant states it before its first plan, for viewers.

    Args:
        plant: the plant.

    Returns:
        The body; None if the plant has no attribute `body`.
    """
    body: RobotBody | None = getattr(plant, "body", None)
    return body


def simulated_people(plant: Plant) -> tuple[PersonFigure, ...]:
    """Return where the simulated people of a plant are, for viewers; nothing that acts may call it.

    Args:
        plant: the plant.

    Returns:
        The people; empty if the plant has no method `people`.
    """
    people: Callable[[], tuple[PersonFigure, ...]] | None = getattr(plant, "people", None)
    return () if people is None else people()


def plan_sequence(plant: Plant, actions: Sequence[Action]) -> Sequence[PlannedMotion] | None:
    """Plan actions that follow each other, each from where the one before it ends; moves nothing.

    Args:
        plant: the plant.
        actions: the actions, parameters in SI.

    Returns:
        A plan for each action, up to the first that cannot be made; None if the plant cannot plan ahead: it
        has no method `plan_sequence`.
    """
    plan: Callable[[Sequence[Action]], Sequence[PlannedMotion] | None] | None
    plan = getattr(plant, "plan_sequence", None)
    return None if plan is None else plan(actions)


def announce_parameters(plant: Plant, values: Mapping[str, Any]) -> None:
    """Say the parameters of the task to a plant that has use for them, as the symbolic one.

    Args:
        plant: the plant.
        values: values (SI) of parameters of tasks, by full name; the others have their defaults.
    """
    announce: Callable[[Mapping[str, Any]], None] | None = getattr(plant, "set_parameters", None)
    if announce is not None:
        announce(values)


@dataclass(frozen=True, slots=True)
class StepRequest:
    """One skill invocation that the agent proposes.

    Attributes:
        module: the name of the module.
        skill: the name of one of its skills.
        inputs: by name, SI; inputs that have a default may be left out.
        held: conditions of the parts of a plan around it: once one is not measured as true, it is cancelled.
    """

    module: str
    skill: str
    inputs: Mapping[str, Any]
    held: tuple[ActionCondition, ...] = ()


class StepStatus(Enum):
    """End of a skill invocation as the runtime sees it; the agent's supervisor determines the outcome."""

    FINISHED = "finished"  # the skill ran to its end
    REFUSED = "refused"  # never started: unknown, inactive, or its inputs do not match its declaration
    DENIED = "denied"  # the gate denied an action; the skill was halted
    STOPPED = "stopped"  # the plant or the monitor stopped a motion; the skill was halted
    TIMED_OUT = "timed_out"  # the skill was halted at its timeout
    RAISED = "raised"  # the skill's code failed; it was halted
    HALTED = "halted"  # the operator stopped everything; nothing begins any more
    HOLD_LOST = "unheld"  # the skill's hold-condition was not measured to hold; it was halted
    CANCELLED = "cancelled"  # cancelled by the caller: halted, or never begun


@dataclass(frozen=True, slots=True)
class StepResult:
    """Result of a step.

    Attributes:
        status: the kind of end.
        reason: the same in words.
        allowed, attenuated, denied: number of the step's actions that the gate decided so.
        outputs: the skill's outputs, by name.
        is_transient: the step was denied only because of measured values, so it may be allowed later.
        causes: the reason as data, if there is any; of a skill that finished, why actions of it were denied.
        lost_hold: position in `StepRequest.held` of the condition that cancelled it; None if none did.
        denials: number of actions that did not begin, that no other way made up for and that ended the step.
    """

    status: StepStatus
    reason: str
    allowed: int = 0
    attenuated: int = 0
    denied: int = 0
    outputs: Mapping[str, Any] = field(default_factory=dict)
    is_transient: bool = False
    causes: tuple[Cause, ...] = ()
    lost_hold: int | None = None
    denials: int = 0


StepHandle = NewType("StepHandle", int)
"""Number of a step that was started, assigned by the runtime."""


class EndedStep(NamedTuple):
    """A step that has ended, with its result.

    Attributes:
        step: handle of the step.
        result: its result.
    """

    step: StepHandle
    result: StepResult


class LogHead(NamedTuple):
    """End of the audit record.

    Attributes:
        records: number of its records.
        hash: hash of the last record.
    """

    records: int
    hash: str


EMPTY_LOG_HEAD: Final = LogHead(0, "")
"""End of a record without entries."""


class AuditEvent(NamedTuple):
    """An event that the runtime itself recorded.

    Attributes:
        sequence: the number of its record.
        event: the kind of event.
        details: the event's data, by name.
    """

    sequence: int
    event: str
    details: Mapping[str, Any]


class Runtime(Protocol):
    """The runtime as the agent sees it: it observes, proposes steps, leaves notes and reads the record."""

    @property
    def site(self) -> Site:
        """The site whose policy governs."""

    @property
    def is_stopped(self) -> bool:
        """True if the operator has stopped everything; nothing begins any more."""

    def active_modules(self) -> Mapping[str, Ecm]:
        """Return the certified, active modules.

        Returns:
            The modules by name.
        """

    def certificate(self, module: str) -> Certificate | None:
        """Return the certificate of an active module.

        Args:
            module: the module's name.

        Returns:
            Its certificate, or None if it has none.
        """

    def now(self) -> float:
        """Read the plant's clock.

        Returns:
            Seconds.
        """

    def attend(self, modules: frozenset[str] | None) -> None:
        """Say whose values matter, so that no other perceiver has to run.

        Values that only other modules provide become unknown.

        Args:
            modules: ids of modules; those that they need are added. None for all.
        """

    def set_parameters(self, values: Mapping[str, Any]) -> None:
        """Set the parameters of the task that is pursued.

        Values that depend on a parameter that changes are unknown until they are measured anew.

        Args:
            values: values (SI) of parameters of tasks, by full name; the others have their defaults.
        """

    def set_memories(self, memories: Mapping[str, Mapping[str, Any]]) -> None:
        """Set the memories that perceivers get which ask for them. Nothing else reads them.

        Args:
            memories: a table for each module by its id, of JSON values, as `aeros.agent.memory.recall` makes.
        """

    def observe(self) -> Readings:
        """Measure every state variable now.

        Returns:
            The readings (SI), each with its own time.
        """

    def obstacles(self) -> Sequence[Obstacle]:
        """Return what pictures show in the cell, and neither the robot nor a module explains.

        Returns:
            The obstacles as of the latest `observe`, oldest first.
        """

    def start(self, request: StepRequest) -> StepHandle | StepResult:
        """Start one skill in addition to those under way.

        The step waits while others hold what it needs. It makes progress only inside `wait`.

        Args:
            request: the skill and its inputs.

        Returns:
            A handle of the step, or its result if it is refused at once.
        """

    def wait(self, until: float = inf) -> EndedStep | None:
        """Run all steps until one of them has ended; the gate decides every action.

        Args:
            until: plant time at which to return at the latest, s.

        Returns:
            The step that ended; None if `until` came first, as it does if no step was started.

        Raises:
            MisuseError: no step was started and `until` is not given.
        """

    def cancel(self, step: StepHandle, reason: str) -> None:
        """Halt a step, with the same clean-up as any other, unless it has ended; `wait` reports its end.

        Args:
            step: the step to halt.
            reason: the reason to record, in words.
        """

    def note(self, event: str, details: Mapping[str, Any]) -> None:
        """Write an event of the agent (a plan, an outcome, a transition) into the audit record.

        Args:
            event: the kind of event.
            details: the event's data, by name.
        """

    def log_head(self) -> LogHead:
        """Return the current end of the audit record.

        Returns:
            Number of records and hash of the last.
        """

    def events_since(self, head: LogHead) -> Sequence[AuditEvent] | None:
        """Return the events that the runtime itself has recorded since `head`, without notes.

        Args:
            head: an earlier end of the record.

        Returns:
            The events in order, or None if the record never ended at `head`.
        """
