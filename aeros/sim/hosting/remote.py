"""The agent's end of a hosted plant: a `ports.Plant` that forwards every call to another process."""

from __future__ import annotations

import socket
from collections.abc import Mapping, Sequence
from contextlib import suppress
from math import inf
from pathlib import Path
from typing import Any, Final

from aeros.runtime.ports import (
    CameraPicture,
    Monitor,
    MotionCompletion,
    MotionHandle,
    PlannedMotion,
    Reading,
    Readings,
    RobotBody,
    announce_stop,
)
from aeros.sim.hosting.wire import MessageChannel, decode_body, decode_picture, decode_plan, decode_value
from aeros.skill import Action
from aeros.spec.expr.doubles import to_doubles

HOST_TIMEOUT_S: Final = 600.0
"""Real seconds for a hosted plant to answer: a tick of physics takes a millisecond, a picture far more."""


class RemotePlant:
    """Implementation of `aeros.runtime.ports.Plant` by a plant that `PlantHost` serves.

    Every method raises `ConnectionLostError`, which is a `ConnectionError`, if the host is gone.

    Args:
        path: of the host's socket.

    Raises:
        OSError: nothing listens there.
    """

    def __init__(self, path: Path) -> None:
        connection = socket.socket(socket.AF_UNIX)
        try:
            connection.connect(str(path))
        except OSError:
            connection.close()
            raise
        self._channel = MessageChannel(connection, HOST_TIMEOUT_S)
        self._body: RobotBody | None = None
        self._planned: tuple[int, PlannedMotion] | None = None
        self._pictures: dict[str, CameraPicture] = {}
        self._is_open = True

    def now(self) -> float:
        """Implement `Plant.now`."""
        return float(self._call("now"))

    def observe(self) -> Readings:
        """Implement `Plant.observe`."""
        reply = self._call("observe")
        return {name: Reading(decode_value(value), time) for name, (value, time) in reply.items()}

    def pictures(self) -> Mapping[str, CameraPicture]:
        """Return the newest pictures of the plant; only new ones cross the socket.

        Returns:
            The pictures by camera; empty if it has none.
        """
        known = {name: one.time for name, one in self._pictures.items()}
        for picture in map(decode_picture, self._call("pictures", known=known)):
            self._pictures[picture.camera] = picture
        return dict(self._pictures)

    def plan(self, action: Action) -> PlannedMotion:
        """Implement `Plant.plan`."""
        refusal = _encoding_problem(action)
        if refusal is not None:
            return refusal
        reply = self._call("plan", **_encode_action(action))
        if "body" in reply:
            self._body = decode_body(reply["body"])
        plan = decode_plan(reply["plan"], self._body)
        self._planned = (reply["number"], plan)
        return plan

    def plan_sequence(self, actions: Sequence[Action]) -> Sequence[PlannedMotion] | None:
        """Plan actions one after the other; see `ports.plan_sequence`.

        Args:
            actions: the actions.

        Returns:
            A plan for each; None if the hosted plant cannot plan ahead.
        """
        if any(_encoding_problem(action) is not None for action in actions):
            return None
        reply = self._call("plan-sequence", actions=[_encode_action(action) for action in actions])
        if "body" in reply:
            self._body = decode_body(reply["body"])
        return None if reply["plans"] is None else [decode_plan(one, self._body) for one in reply["plans"]]

    def begin(self, action: Action, decided: PlannedMotion | None = None) -> MotionHandle | MotionCompletion:
        """Implement `Plant.begin`."""
        refusal = _encoding_problem(action)
        if refusal is not None:
            return refusal
        number = None
        if decided is not None:
            # A plan that this plant did not make is not one of the host's either.
            number = self._planned[0] if self._planned and self._planned[1] is decided else -1
        reply = self._call("begin", plan=number, **_encode_action(action))
        return (
            MotionCompletion(reply["completed"], reply["reason"])
            if isinstance(reply, dict)
            else MotionHandle(reply)
        )

    def advance(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        """Implement `Plant.advance`; the host waits at every tick for the verdict of `monitor`."""
        self._channel.send({"do": "advance", "until": None if until == inf else until})
        failure: BaseException | None = None
        while "is" not in (message := self._channel.receive()):
            rule: str | None = None
            try:
                if "stops" in message:
                    announce_stop(monitor, message["stops"], message["at"])
                else:
                    measured = {name: decode_value(value) for name, value in message["measured"].items()}
                    rule = monitor(message["tick"], measured)
            except BaseException as raised:
                failure, rule = raised, "the monitor failed"
            self._channel.send({"rule": rule})
        if failure is not None:
            raise failure
        return {
            MotionHandle(motion): MotionCompletion(how["completed"], how["reason"])
            for motion, how in message["is"]
        }

    @property
    def runs_in_real_time(self) -> bool:
        """True if the hosted plant does not wait for the monitor."""
        return bool(self._call("runs-in-real-time"))

    @property
    def action_kinds(self) -> tuple[str, ...] | None:
        """Names of the action kinds that the hosted plant can do; None if it does not say."""
        kinds = self._call("action-kinds")
        return None if kinds is None else tuple(kinds)

    def truth(self) -> Mapping[str, int]:
        """Read the truth of the hosted plant's scene, for a referee; nothing that acts may call it.

        Returns:
            The truth, or the number, of each state variable that the scene defines; empty if the plant
            knows none.
        """
        return dict(self._call("truth"))

    def halt(self, motion: MotionHandle) -> None:
        """Implement `Plant.halt`."""
        self._call("halt", motion=motion)

    def stop(self) -> None:
        """Implement `Plant.stop`."""
        self._call("stop")

    def skill_began(self, skill: str) -> None:
        """Implement `Plant.skill_began`."""
        self._call("skill-began", skill=skill)

    def skill_ended(self, skill: str, *, finished: bool) -> None:
        """Implement `Plant.skill_ended`."""
        self._call("skill-ended", skill=skill, finished=finished)

    def set_parameters(self, values: Mapping[str, Any]) -> None:
        """Say the parameters of the task; see `announce_parameters`.

        Args:
            values: values (SI) of parameters of tasks, by full name.
        """
        self._call("set-parameters", values=to_doubles(dict(values)))

    def shut_down_host(self) -> None:
        """Shut down the host with its plant, and disconnect."""
        self._call("end")
        self.close()

    def close(self) -> None:
        """Disconnect: the host stops the plant and waits for another agent. Safe to call twice."""
        if self._is_open:
            self._is_open = False
            with suppress(OSError):
                self._channel.close()

    def _call(self, what: str, **about: Any) -> Any:
        self._channel.send({"do": what, **about})
        return self._channel.receive()["is"]


def _encoding_problem(action: Action) -> MotionCompletion | None:
    """Return a refusal if a parameter of the action cannot be encoded; no plant accepts such values."""
    for name, value in action.parameters.items():
        if not _is_json_value(value):
            return MotionCompletion(False, f"bad parameter: `{name}` has an unsupported type")
    return None


def _is_json_value(value: object) -> bool:
    if type(value) is tuple:
        return all(map(_is_json_value, value))
    return type(value) in (bool, int, float, str)


def _encode_action(action: Action) -> dict[str, Any]:
    return {"kind": action.kind, "parameters": dict(action.parameters)}
