"""The runtime's ports: everything agent and plant may know of each other.

Agent and sim import this module and nothing else of the runtime, so the agent can propose and
cannot act, and a plant can act and cannot decide.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, Protocol

from aeros.skill import Action
from aeros.spec.model import Ecm, Site


@dataclass(frozen=True, slots=True)
class Reading:
    """One measured value and when it was measured.

    value: SI; bool, float, enum member as str, 3-tuple of float, or tuple of float for a family
        (in the order of the vocabulary's index set).
    time: seconds on the plant's clock.
    """

    value: Any
    time: float


Readings = Mapping[str, Reading]
"""Readings by vocabulary name.  A name that is absent is unknown."""

Monitor = Callable[[float, Mapping[str, Any]], str | None]
"""Checks what is measured at one control tick, given its time (plant seconds) and the values by
vocabulary name (SI): None, or the id of the violated rule, upon which the plant makes a protective
stop within that tick."""


@dataclass(frozen=True, slots=True)
class Completion:
    """How one action ended on the plant.

    completed: the plant did all of it.
    reason: None when completed; else `monitor:RULE`, `deadline`, or the plant's own words
        (for example `unreachable: …`).
    """

    completed: bool
    reason: str | None = None


class Plant(Protocol):
    """What executes allowed actions: a simulator, an in-memory fake, a robot.

    A plant never decides.  It refuses what it cannot do (`Completion` with a reason, before any
    motion), never raises for it, and stops when `monitor` names a rule.
    """

    def now(self) -> float:
        """Seconds on the plant's clock; never goes back."""

    def observe(self) -> Readings:
        """Everything that is measured now, each value with its own time."""

    def execute(self, action: Action, monitor: Monitor, deadline: float) -> Completion:
        """Do `action`, calling `monitor` every control tick; stop at `deadline` (plant seconds)."""

    def stop(self) -> None:
        """Protective stop: bring every actuator to rest within its limits and hold."""

    def skill_began(self, skill: str) -> None:
        """Note that `MODULE.SKILL` starts; physics ignores it, the symbolic plant samples by it."""

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


@dataclass(frozen=True, slots=True)
class StepResult:
    """What became of a step: status, the reason in words, and what the gate decided on the way."""

    status: StepStatus
    reason: str
    allowed: int = 0
    attenuated: int = 0
    denied: int = 0


class Runtime(Protocol):
    """What the agent sees: it can observe, propose steps and leave notes, and nothing else."""

    @property
    def site(self) -> Site:
        """The site whose policy governs."""

    def active_modules(self) -> Mapping[str, Ecm]:
        """The certified, active modules by name."""

    def now(self) -> float:
        """Seconds on the plant's clock."""

    def observe(self) -> Readings:
        """Everything that is measured now."""

    def submit(self, request: StepRequest) -> StepResult:
        """Run one skill to its end, every action decided by the gate; never raises for a bad request."""

    def note(self, event: str, details: Mapping[str, Any]) -> None:
        """Put an event of the agent's (a plan, an outcome, a transition) into the audit record."""
