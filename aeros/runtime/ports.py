"""The runtime's ports: everything agent and plant may know of each other.

Agent and sim import this module and nothing else of the runtime, so the agent can propose and
cannot act, and a plant can act and cannot decide.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from math import inf
from typing import Any, Final, NamedTuple, NewType, Protocol

from aeros.skill import Action
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.model.cause import Cause
from aeros.spec.model.model import Ecm, Site
from aeros.spec.verification.certificate import Certificate


class Reading(NamedTuple):
    """One measured value and when it was measured.

    value: SI; bool, float, enum member as str, 3-tuple of float, or tuple of float for a family
        (in the order of the vocabulary's index set).
    time: seconds on the plant's clock.
    """

    value: Any
    time: float


Readings = Mapping[str, Reading]
"""Readings by vocabulary name.  A name that is absent is unknown."""


class ColumnNames:
    """Names of what is measured together, in their order, and the place of each."""

    __slots__ = ("names", "places")

    def __init__(self, names: Iterable[str]) -> None:
        self.names = tuple(sorted(names))
        if not all(type(name) is str for name in self.names):
            raise MisuseError("a name of what is measured is no text")
        self.places = {name: place for place, name in enumerate(self.names)}


class Snapshot(Mapping[str, Reading]):
    """Readings that were all taken at one time, their values in a column.  Nothing of it ever changes.

    Where a column is the one of the moment before, or most values in it are the same objects, whoever has
    looked at that one needs to look at what differs only.
    """

    __slots__ = ("column", "order", "time")

    def __init__(self, order: ColumnNames, column: tuple[Any, ...], time: float) -> None:
        if type(order) is not ColumnNames or type(column) is not tuple or len(column) != len(order.names):
            raise MisuseError(f"a column of {len(order.names)} values is not what was given")
        self.order = order
        self.column = column
        self.time = time

    def __getitem__(self, name: str) -> Reading:
        return Reading(self.column[self.order.places[name]], self.time)

    def __iter__(self) -> Iterator[str]:
        return iter(self.order.names)

    def __len__(self) -> int:
        return len(self.order.names)


Monitor = Callable[[float, Mapping[str, Any]], str | None]
"""Checks what is measured at one control tick, given its time (plant seconds) and the values by
vocabulary name (SI), or a `Reading` of what was measured before: None, or the id of the violated rule,
upon which the plant makes a protective stop within that tick."""


@dataclass(frozen=True, slots=True)
class MotionCompletion:
    """How one action ended on the plant.

    completed: the plant did all of it.
    reason: None when completed; else `monitor:RULE`, or the plant's own words (for example
        `unreachable: …`).
    """

    completed: bool
    reason: str | None = None


Vec3 = tuple[float, float, float]


class Ball(NamedTuple):
    """A ball that moves with a robot's link; all balls of a link together enclose it.

    joint: how many joints move it: 0 for the base, k for what is carried by the first k joints.
    centre: in the frame of that joint, m; of the base where it is 0.
    radius: m.
    """

    link: str
    joint: int
    centre: Vec3
    radius: float


@dataclass(frozen=True, slots=True)
class RobotBody:
    """A robot's chain of revolute joints and the balls that enclose its links.

    rows: a, alpha and d of each joint, m and rad: modified (Craig) Denavit–Hartenberg parameters.
    tool: the tool point in the frame of the last joint, m.
    """

    dh_rows: tuple[tuple[float, float, float], ...]
    tool_offset: Vec3
    balls: tuple[Ball, ...]


JointVector = tuple[float, ...]
"""A value for each joint, rad for positions."""

JointPath = tuple[tuple[JointVector, JointVector, JointVector, JointVector], ...]
"""Pieces of equal length in s from 0 to 1, each a cubic by its four Bézier control points."""


@dataclass(frozen=True, slots=True)
class ServoBounds:
    """How far and how fast a motion under feedback may leave its paths; the plant holds itself to it.

    slack: distance of each joint from the nearest path, rad.
    speed, acceleration, jerk: of each joint, SI.
    tool_speed, tool_acceleration, tool_jerk: of the set point that is followed, SI.
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
    """A whole motion, before it starts: q(s(t/duration)), with s(u) = 10u³ − 15u⁴ + 6u⁵.

    paths: one; under feedback (`servo`) several, near which the motion stays, in an order it chooses.
    base, way: where the body's base frame is at the start, in W, and how far it travels, m.
    duration: s; under feedback an estimate.
    """

    body: RobotBody
    joint_paths: tuple[JointPath, ...]
    base: Vec3
    base_path: Vec3
    duration: float
    servo: ServoBounds | None = None


@dataclass(frozen=True, slots=True)
class NoMotion:
    """The plant's statement that an action moves no joint and no base, and why."""

    reason: str


PlannedMotion = Trajectory | NoMotion | MotionCompletion
"""What the plant would do for an action; a `MotionCompletion` says why it cannot do it."""


MotionHandle = NewType("MotionHandle", int)
"""One action under way on a plant, by the number that the plant gave it."""


class Plant(Protocol):
    """What executes allowed actions: a simulator, an in-memory fake, a robot.

    A plant never decides.  It refuses what it cannot do (`MotionCompletion` with a reason, before any
    motion), never raises for it, and stops when `monitor` names a rule.  Several actions may be under
    way; that they do not share an actuator is for others to see to.

    Example:
        >>> from aeros.sim.kinematic.plant import make_plant
        >>> plant: aeros.Plant = make_plant("bare", 0)
        >>> motion = plant.begin(aeros.act("wait", duration=0.5))
        >>> ended = plant.advance(lambda time, values: None, until=1.0)
        >>> ended[motion].completed
        True
        >>> plant.close()
    """

    def now(self) -> float:
        """Seconds on the plant's clock; never goes back."""

    def observe(self) -> Readings:
        """Everything that is measured now, each value with its own time.

        The monitor may call it, from inside `advance`.
        """

    def plan(self, action: Action) -> PlannedMotion:
        """The motion that `action` is, from where the robot is now; moves nothing."""

    def begin(self, action: Action, decided: PlannedMotion | None = None) -> MotionHandle | MotionCompletion:
        """Begin `action`, beside what is under way; nothing moves before `advance`.

        decided: what `plan` said of this action, decided since: that motion and no other is made.
        """

    def advance(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        """Go on with everything under way until some of it ends; which, and how.

        monitor: called before the first control tick and after every one.  Where it names a rule,
            everything is brought to rest, and all that was under way has ended.
        until: plant seconds; nothing has ended where the next tick would pass them.  They come where
            nothing is under way, too.
        """

    def halt(self, motion: MotionHandle) -> None:
        """Let `motion` come to rest within limits while others go on; `advance` says when it has.

        The monitor may call it, from inside `advance`.
        """

    def stop(self) -> None:
        """Protective stop: bring every actuator to rest within its limits and hold; all motions are over."""

    def skill_began(self, skill: str) -> None:
        """Note that `MODULE.SKILL` starts: faults of physics heed it, the symbolic plant samples by it."""

    def skill_ended(self, skill: str, *, finished: bool) -> None:
        """Note that `MODULE.SKILL` ended; `finished` says whether it ran to its own end."""

    def close(self) -> None:
        """Release what the plant holds; safe to call twice."""


@dataclass(frozen=True, slots=True)
class StepRequest:
    """One skill invocation that the agent proposes; `inputs` in SI, those with defaults may be left out."""

    module: str
    skill: str
    inputs: Mapping[str, Any]


class StepStatus(Enum):
    """How a skill invocation ended, as far as the runtime can tell; outcomes are for the supervisor."""

    FINISHED = "finished"  # the skill ran to its end
    REFUSED = "refused"  # never started: unknown, inactive, or its inputs are not what it declares
    DENIED = "denied"  # the gate denied an action; the skill was halted
    STOPPED = "stopped"  # the plant or the monitor stopped a motion; the skill was halted
    TIMED_OUT = "timed_out"  # the skill was halted at its time-out
    RAISED = "raised"  # the skill's code failed; it was halted
    HALTED = "halted"  # the operator stopped everything: nothing begins any more
    HOLD_LOST = "unheld"  # what must be measured as long as the skill runs was not; it was halted
    CANCELLED = "cancelled"  # whoever had asked for it took it back; it was halted, or never began


@dataclass(frozen=True, slots=True)
class StepResult:
    """What became of a step: status, the reason in words, what the gate decided on the way, its outputs.

    may_pass: it was denied on account of what is measured alone, so that later it may be allowed.
    causes: the reason as data, where there is more to it than words.
    """

    status: StepStatus
    reason: str
    allowed: int = 0
    attenuated: int = 0
    denied: int = 0
    outputs: Mapping[str, Any] = field(default_factory=dict)
    is_transient: bool = False
    causes: tuple[Cause, ...] = ()


StepHandle = NewType("StepHandle", int)
"""A step that was started, by the number that the runtime gave it."""


class EndedStep(NamedTuple):
    """A step that has ended, and what became of it."""

    step: StepHandle
    result: StepResult


class LogHead(NamedTuple):
    """Where the audit record ends: how many records it has, and the hash of the last."""

    records: int
    hash: str


EMPTY_LOG_HEAD: Final = LogHead(0, "")
"""Before the first record."""


class AuditEvent(NamedTuple):
    """A record of the runtime's own, and its number."""

    sequence: int
    event: str
    details: Mapping[str, Any]


class Runtime(Protocol):
    """What the agent sees: it can observe, propose steps, leave notes and read the record; nothing else."""

    @property
    def site(self) -> Site:
        """The site whose policy governs."""

    @property
    def is_stopped(self) -> bool:
        """Whether the operator has stopped everything, so that nothing begins any more."""

    def active_modules(self) -> Mapping[str, Ecm]:
        """The certified, active modules by name."""

    def certificate(self, module: str) -> Certificate | None:
        """What is proved of an active module."""

    def now(self) -> float:
        """Seconds on the plant's clock."""

    def observe(self) -> Readings:
        """Everything that is measured now."""

    def start(self, request: StepRequest) -> StepHandle | StepResult:
        """Start one skill, beside those under way; a result where it is refused at once.

        It waits its turn where others hold what it needs.  Goes on only inside `wait`.
        """

    def wait(self, until: float = inf) -> EndedStep | None:
        """Let every step go on, every action decided by the gate, until one has ended; which.

        until: plant seconds; None where they come first, as they do where nothing was started; without
            them that raises `MisuseError`.
        """

    def cancel(self, step: StepHandle, reason: str) -> None:
        """Halt a step, by the same clean-up as any other, unless it has ended; `wait` says when it has."""

    def note(self, event: str, details: Mapping[str, Any]) -> None:
        """Put an event of the agent's (a plan, an outcome, a transition) into the audit record."""

    def log_head(self) -> LogHead:
        """Where the audit record ends now."""

    def events_since(self, head: LogHead) -> Sequence[AuditEvent] | None:
        """What the runtime itself has recorded since, without notes; None where it never ended so."""
