"""A hosted plant as the agent's process has it: a `ports.Plant` whose other end is in another process."""

from __future__ import annotations

import socket
from collections.abc import Mapping
from contextlib import suppress
from math import inf
from pathlib import Path
from typing import Any, Final

from aeros.runtime.ports import Body, Completion, Monitor, Motion, Plan, Reading, Readings
from aeros.sim.hosting.wire import Line, body_heard, heard, plan_heard
from aeros.skill import Action

PATIENCE: Final = 600.0
"""Real seconds for a hosted plant to answer: a tick of physics takes a millisecond, a picture far more."""


class RemotePlant:
    """Implements `aeros.runtime.ports.Plant` by the plant hosted at `path`.

    Raises `LostError`, which is a `ConnectionError`, where that is gone.
    """

    def __init__(self, path: Path) -> None:
        connection = socket.socket(socket.AF_UNIX)
        try:
            connection.connect(str(path))
        except OSError:
            connection.close()
            raise
        self._line = Line(connection, PATIENCE)
        self._body: Body | None = None
        self._planned: tuple[int, Plan] | None = None
        self._is_open = True

    def now(self) -> float:
        """See `Plant`."""
        return float(self._ask("now"))

    def observe(self) -> Readings:
        """See `Plant`."""
        told = self._ask("observe")
        return {name: Reading(heard(value), time) for name, (value, time) in told.items()}

    def plan(self, action: Action) -> Plan:
        """See `Plant`."""
        untold = _untold(action)
        if untold is not None:
            return untold
        told = self._ask("plan", **_told(action))
        if "body" in told:
            self._body = body_heard(told["body"])
        plan = plan_heard(told["plan"], self._body)
        self._planned = (told["number"], plan)
        return plan

    def begin(self, action: Action, decided: Plan | None = None) -> Motion | Completion:
        """See `Plant`."""
        untold = _untold(action)
        if untold is not None:
            return untold
        number = None
        if decided is not None:
            # What is none of this plant's own plans is none of the host's either.
            number = self._planned[0] if self._planned and self._planned[1] is decided else -1
        told = self._ask("begin", plan=number, **_told(action))
        return Completion(told["completed"], told["reason"]) if isinstance(told, dict) else Motion(told)

    def advance(self, monitor: Monitor, until: float) -> Mapping[Motion, Completion]:
        """See `Plant`; the host waits at every tick for what `monitor` says of it."""
        self._line.say({"do": "advance", "until": None if until == inf else until})
        failure: BaseException | None = None
        while "is" not in (message := self._line.hear()):
            measured = {name: heard(value) for name, value in message["measured"].items()}
            try:
                rule = monitor(message["tick"], measured)
            except BaseException as raised:
                failure, rule = raised, "the monitor failed"
            self._line.say({"rule": rule})
        if failure is not None:
            raise failure
        return {Motion(motion): Completion(how["completed"], how["reason"]) for motion, how in message["is"]}

    def halt(self, motion: Motion) -> None:
        """See `Plant`."""
        self._ask("halt", motion=motion)

    def stop(self) -> None:
        """See `Plant`."""
        self._ask("stop")

    def skill_began(self, skill: str) -> None:
        """See `Plant`."""
        self._ask("skill-began", skill=skill)

    def skill_ended(self, skill: str, *, finished: bool) -> None:
        """See `Plant`."""
        self._ask("skill-ended", skill=skill, finished=finished)

    def end(self) -> None:
        """Let the host end with its plant, and leave."""
        self._ask("end")
        self.close()

    def close(self) -> None:
        """Leave: the host stops the plant and waits for another agent.  Safe to call twice."""
        if self._is_open:
            self._is_open = False
            with suppress(OSError):
                self._line.close()

    def _ask(self, what: str, **about: Any) -> Any:
        self._line.say({"do": what, **about})
        return self._line.hear()["is"]


def _untold(action: Action) -> Completion | None:
    """Why an action cannot be put into words, if so; no plant knows what to do with such a value."""
    for name, value in action.parameters.items():
        if not _is_plain(value):
            return Completion(False, f"bad parameter: `{name}` is of a type that no plant knows")
    return None


def _is_plain(value: object) -> bool:
    if type(value) is tuple:
        return all(map(_is_plain, value))
    return type(value) in (bool, int, float, str)


def _told(action: Action) -> dict[str, Any]:
    return {"kind": action.kind, "parameters": dict(action.parameters)}
