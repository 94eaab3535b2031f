"""Plant wrapper between the site's action kinds and the plant: it calls tools, and translates other words.

It carries out the actions of tools itself, and measures their answers. A kind that `means` another
reaches a plant that says its action kinds under that name.

A call runs in a thread, so that no control tick waits for it.  On a simulator the clock stands still until
all calls have ended: the same answers give the same run.  On a plant that runs in real time, time goes on.
A call that fails leaves the values that it would have set unknown; the skill sees that, as of a sensor.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, Final

from aeros.descriptions import describe_exception
from aeros.runtime.execution.governor import Governor
from aeros.runtime.ports import (
    BACK_OFF,
    CameraPicture,
    Monitor,
    MotionCompletion,
    MotionHandle,
    NoMotion,
    PlannedMotion,
    Plant,
    Reading,
    Readings,
    announce_parameters,
    announce_stop,
    known_action_kinds,
    newest_pictures,
    plan_sequence,
)
from aeros.runtime.records.failed_measurements import RecordEvent
from aeros.runtime.tools.answer import check_answer
from aeros.runtime.tools.exchange import ToolError
from aeros.runtime.tools.service import ServiceCall, open_service
from aeros.skill import Action
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.model.policy import IsolationPolicy
from aeros.spec.model.rules import ActionKind
from aeros.spec.model.site import Site
from aeros.spec.model.tools import Tool

POLL_S: Final = 0.02
"""Time between two looks at calls under way, s."""

OpenService = Callable[[Tool, IsolationPolicy], ServiceCall]
"""Returns the function that calls the service of a tool, under the site's policy."""

_DONE: Final = MotionCompletion(completed=True)


@dataclass
class _Call:
    """A call under way: the thread sets `answer` or `failure` and then `ended`."""

    kind: str
    tool: Tool
    site: Site
    started: float
    answer: dict[str, Any] = field(default_factory=dict)
    failure: str = ""
    ended: threading.Event = field(default_factory=threading.Event)
    is_halted: bool = False

    @property
    def seconds_left(self) -> float:
        return float(self.tool.timeout) - (time.monotonic() - self.started)


class ToolPlant:
    """Plant that behaves as `plant`, calls the tools of the site in force, and translates its action kinds.

    Args:
        plant: the wrapped plant; closed with this one.
        governor: returns the configuration in force.
        record: writes events of calls into the audit record.
        open_service: returns the function that calls the service of a tool.
    """

    def __init__(
        self,
        plant: Plant,
        governor: Governor,
        record: RecordEvent,
        open_service: OpenService = open_service,
    ) -> None:
        self._plant, self._governor, self._record = plant, governor, record
        self._open_service = open_service
        self._generation: int | None = None
        self._site: Site | None = None
        self._calls: dict[MotionHandle, _Call] = {}
        self._next = -1  # handles of the plant itself are not negative
        self._values: dict[str, Reading] = {}
        self._under_way: set[MotionHandle] = set()
        self._plant_kinds = known_action_kinds(plant)
        self.runs_in_real_time = bool(getattr(plant, "runs_in_real_time", False))

    def now(self) -> float:
        """Implements `Plant.now`."""
        return self._plant.now()

    def observe(self) -> Readings:
        """Implements `Plant.observe`; adds the newest answers."""
        readings = self._plant.observe()
        return {**readings, **self._values} if self._values else readings

    def plan_sequence(self, actions: Sequence[Action]) -> Sequence[PlannedMotion] | None:
        """Plan actions one after the other; see `ports.plan_sequence`.

        Args:
            actions: the actions.

        Returns:
            A plan for each; None if the plant cannot plan ahead.
        """
        return plan_sequence(self._plant, [self._in_plant_words(action) for action in actions])

    def pictures(self) -> Mapping[str, CameraPicture]:
        """Return the newest pictures of the plant; see `newest_pictures`.

        Returns:
            The pictures by camera; empty if it has none.
        """
        return newest_pictures(self._plant)

    def set_parameters(self, values: Mapping[str, Any]) -> None:
        """Say the parameters of the task; see `announce_parameters`.

        Args:
            values: values (SI) of parameters of tasks, by full name.
        """
        announce_parameters(self._plant, values)

    def plan(self, action: Action) -> PlannedMotion:
        """Implements `Plant.plan`; a call moves nothing."""
        if self._tool(action.kind) is not None:
            return NoMotion("a tool is called")
        return self._plant.plan(self._in_plant_words(action))

    def begin(self, action: Action, decided: PlannedMotion | None = None) -> MotionHandle | MotionCompletion:
        """Implements `Plant.begin`: starts a call; what the tool answered before is unknown from now on."""
        tool = self._tool(action.kind)
        if tool is None or self._site is None:
            motion = self._plant.begin(self._in_plant_words(action), decided)
            if not isinstance(motion, MotionCompletion):
                self._under_way.add(motion)
            return motion
        for name in tool.answers:
            self._values.pop(name, None)
        handle, self._next = MotionHandle(self._next), self._next - 1
        call = self._calls[handle] = _Call(action.kind, tool, self._site, time.monotonic())
        service, parameters = self._open_service, dict(action.parameters)
        threading.Thread(target=_run, args=(call, service, parameters), daemon=True).start()
        return handle

    def advance(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        """Implements `Plant.advance`."""
        if not self._calls:
            ended = self._plant.advance(monitor, until)
            self._under_way.difference_update(ended)
            return ended
        return self._advance_in_slices(monitor, until) if self.runs_in_real_time else self._wait(monitor)

    def halt(self, motion: MotionHandle) -> None:
        """Implements `Plant.halt`: nobody waits for a halted call any more, and its answer is dropped."""
        if motion in self._calls:
            self._calls[motion].is_halted = True
        else:
            self._plant.halt(motion)

    def stop(self) -> None:
        """Implements `Plant.stop`: calls are over, too."""
        self._plant.stop()
        self._calls.clear()
        self._under_way.clear()

    def skill_began(self, skill: str) -> None:
        """Implements `Plant.skill_began`."""
        self._plant.skill_began(skill)

    def skill_ended(self, skill: str, *, finished: bool) -> None:
        """Implements `Plant.skill_ended`."""
        self._plant.skill_ended(skill, finished=finished)

    def close(self) -> None:
        """Implements `Plant.close`."""
        self._calls.clear()
        self._plant.close()

    def _tool(self, kind: str) -> Tool | None:
        """Return the tool that carries out actions of a kind; None if the robot does."""
        declared = self._declared(kind)
        return None if declared is None else declared.tool

    def _in_plant_words(self, action: Action) -> Action:
        """Return the action under the name by which a plant that says its action kinds knows it."""
        declared = self._declared(action.kind)
        if declared is None or declared.means is None or self._plant_kinds is None:
            return action
        return Action(declared.means, action.parameters)

    def _declared(self, kind: str) -> ActionKind | None:
        """Return the action kind as the site in force declares it."""
        if self._governor.generation != self._generation:
            # Without a configuration nothing is decided, and so nothing is begun.
            with suppress(UserError):
                self._generation, configuration = self._governor.configuration()
                self._site = configuration.site
        return None if self._site is None else self._site.kinds.get(kind)

    def _wait(self, monitor: Monitor) -> dict[MotionHandle, MotionCompletion]:
        """Wait until a call ends, while the simulator's clock stands still."""
        while self._calls:
            ended = self._collect()
            if ended:
                return ended
            reason = monitor(self._plant.now(), self._plant.observe())
            if reason is not None and reason != BACK_OFF:
                broken = MotionCompletion(completed=False, reason=f"monitor:{reason}")
                over = dict.fromkeys((*self._calls, *self._under_way), broken)
                self.stop()
                return over
            next(iter(self._calls.values())).ended.wait(POLL_S)
        return {}  # everything was stopped meanwhile

    def _advance_in_slices(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        """Let time go on, and look at the calls between two slices of it."""
        watching = _AnswerWatch(monitor)
        while True:
            ended = self._collect()
            if ended or self._plant.now() >= until:
                return ended
            moved = self._plant.advance(watching, min(until, self._plant.now() + POLL_S))
            self._under_way.difference_update(moved)
            if watching.rule is not None:
                broken = MotionCompletion(completed=False, reason=f"monitor:{watching.rule}")
                over = {**dict.fromkeys(self._calls, broken), **moved}
                self._calls.clear()
                return over
            if moved:
                return {**moved, **self._collect()}

    def _collect(self) -> dict[MotionHandle, MotionCompletion]:
        """Return the calls that have ended; take in their answers, and record them."""
        over: dict[MotionHandle, MotionCompletion] = {}
        for handle, call in list(self._calls.items()):
            if call.is_halted:
                over[handle] = MotionCompletion(completed=False, reason="the call was halted")
            elif call.ended.is_set() or call.seconds_left <= 0:
                over[handle] = _DONE
                self._take_in(call)
            if handle in over:
                del self._calls[handle]
        return over

    def _take_in(self, call: _Call) -> None:
        now = self._plant.now()
        failure = call.failure
        if not call.ended.is_set():
            failure = f"it did not answer within {float(call.tool.timeout):g} s"
        details: dict[str, Any] = {"tool": call.kind, "time": now}
        if failure:
            self._record("tool-failed", {**details, "reason": failure, "unknown": sorted(call.tool.answers)})
            return
        self._values |= {name: Reading(value, now) for name, value in call.answer.items()}
        self._record("tool-answered", {**details, "answer": call.answer})


class _AnswerWatch:
    """A monitor that remembers the rule that stopped the robot."""

    def __init__(self, monitor: Monitor) -> None:
        self._monitor = monitor
        self.rule: str | None = None

    def __call__(self, now: float, measured: Mapping[str, Any]) -> str | None:
        answer = self._monitor(now, measured)
        if answer is not None and answer != BACK_OFF and self.rule is None:
            self.rule = answer
        return answer

    def begin_stop(self, reason: str, now: float) -> None:
        self.rule = self.rule or reason
        announce_stop(self._monitor, reason, now)


def _run(call: _Call, open_service: OpenService, parameters: Mapping[str, Any]) -> None:
    """Carry out a call, in a thread of its own."""
    try:
        answer = open_service(call.tool, call.site.isolation)(parameters, float(call.tool.timeout))
        call.answer = check_answer(answer, call.tool, call.site)
    except ToolError as failure:
        call.failure = str(failure)
    except ImportError as failure:
        call.failure = f"it needs a package that is not installed: {failure.name}"
    except Exception as failure:  # nothing that a service does may end the run
        call.failure = describe_exception(failure)
    finally:
        call.ended.set()
