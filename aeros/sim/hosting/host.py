"""Host a plant for one agent after another, and stop it whenever none commands it.

A control tick passes only inside an `advance` that an agent has asked for, and only after that agent has
confirmed the previous tick. An agent that is gone, or does not answer within `AGENT_TIMEOUT_S`, has not
confirmed it: the plant makes a protective stop within that tick, as for a violated rule, and every motion
ends. So while no agent decides, nothing moves.

Not modelled: changes of the world meanwhile. The plant's clock stands still while no agent is connected.
"""

from __future__ import annotations

import json
import os
import select
import socket
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from aeros.files import open_private
from aeros.runtime.ports import (
    MotionCompletion,
    MotionHandle,
    PlannedMotion,
    Plant,
    RobotBody,
    Trajectory,
    announce_parameters,
    known_action_kinds,
    newest_pictures,
    plan_sequence,
)
from aeros.sim.hosting.wire import (
    ConnectionLostError,
    MessageChannel,
    decode_value,
    encode_body,
    encode_picture,
    encode_plan,
    encode_value,
)
from aeros.sim.referee import truth_of
from aeros.skill import Action
from aeros.spec.migrations.formats import PLANT_LOG

AGENT_TIMEOUT_S: Final = 5.0
"""Real seconds that an agent has to judge a tick; it takes about a tenth of a millisecond."""

IDLE_TIMEOUT_S: Final = 600.0
"""Real time without any agent after which a hosted plant ends by itself, s; a silent agent that no watchdog
watches is given up after the same time."""

DEAD_MAN_RULE: Final = "dead-man"
"""Name of the rule that counts as broken when the agent is gone."""


class PlantHost:
    """Serves one plant at a local socket, to one agent at a time.

    Args:
        plant: the plant.
        log: called with each event that helps to judge a crash: agents that come and go, skills that begin
            and end, with what was measured then.
        patience: real seconds that an agent has to judge a tick.
        linger: real seconds without any agent, or with a silent one that no watchdog watches, after which
            `serve` ends or gives it up.
        is_watched: tells if the watchdog lives; None to ask for the process that started this one.
    """

    def __init__(
        self,
        plant: Plant,
        log: Callable[[Mapping[str, Any]], None],
        patience: float = AGENT_TIMEOUT_S,
        linger: float = IDLE_TIMEOUT_S,
        is_watched: Callable[[], bool] | None = None,
    ) -> None:
        parent = os.getppid()
        self._is_watched = is_watched or (lambda: os.getppid() == parent)
        self._plant = plant
        self._write_event = log
        self._agent_timeout_s = patience
        self._idle_timeout_s = linger
        self._channel: MessageChannel | None = None
        self._plans: tuple[int, PlannedMotion | None] = (0, None)
        self._body: RobotBody | None = None
        self._skills: list[str] = []
        self._is_agent_lost = False
        self._is_shut_down = False

    def serve(self, path: Path) -> None:
        """Serve agents, one at a time, until one shuts the host down or none has connected for `linger` s.

        Args:
            path: of the socket; an existing file there is removed.
        """
        path.unlink(missing_ok=True)
        with socket.socket(socket.AF_UNIX) as listening:
            listening.bind(str(path))
            listening.listen()
            listening.settimeout(self._idle_timeout_s)
            try:
                while not self._is_shut_down:
                    with suppress(TimeoutError):
                        connection, _ = listening.accept()
                        self._serve_connection(connection)
                        continue
                    break
            finally:
                path.unlink(missing_ok=True)

    # Connection to one agent.

    def _serve_connection(self, connection: socket.socket) -> None:
        self._channel = MessageChannel(connection, self._idle_timeout_s)
        self._is_agent_lost = False
        self._body, self._connection = None, connection
        self._log("agent-connected")
        try:
            while not self._is_shut_down:
                self._await_request()
                self._answer(self._channel.receive())
        except ConnectionLostError as lost:
            self._on_disconnect(str(lost))
        finally:
            self._channel.close()

    def _await_request(self) -> None:
        """Wait for the agent's next request, for as long as it likes to think: nothing moves meanwhile.

        A watchdog kills an agent that hangs.  Without one, an agent that hangs would keep the plant for ever.

        Raises:
            ConnectionLostError: nobody watches the agent, and it was silent for too long.
        """
        while not select.select([self._connection], [], [], self._idle_timeout_s)[0]:
            if not self._is_watched():
                silence = f"the agent was silent for {self._idle_timeout_s:g} s"
                raise ConnectionLostError(f"{silence}, and no watchdog is left to end it")

    def _on_disconnect(self, why: str) -> None:
        """Bring everything to rest after the agent is gone, if it has not come to rest already."""
        self._plant.stop()
        for skill in self._skills:
            self._plant.skill_ended(skill, finished=False)
        self._skills.clear()
        self._log("agent-disconnected", why=why, amid_motion=self._is_agent_lost)

    def _answer(self, message: Mapping[str, Any]) -> None:
        handler = _HANDLERS.get(message.get("do", ""))
        if handler is None:
            raise ConnectionLostError(f"unknown request {message.get('do')!r}")
        try:
            reply = handler(self, message)
        except (KeyError, TypeError, ValueError, AttributeError) as fault:
            raise ConnectionLostError(f"malformed request: {fault}") from fault
        if self._is_agent_lost:
            raise ConnectionLostError("the agent did not confirm a tick in time")
        assert self._channel is not None  # noqa: S101  answers only while an agent is connected
        self._channel.send({"is": reply})

    # Requests of an agent.

    def _now(self, message: Mapping[str, Any]) -> Any:
        return self._plant.now()

    def _observe(self, message: Mapping[str, Any]) -> Any:
        return {name: [reading.value, reading.time] for name, reading in self._plant.observe().items()}

    def _pictures(self, message: Mapping[str, Any]) -> Any:
        known = message["known"]
        newest = newest_pictures(self._plant)
        return [encode_picture(one) for name, one in newest.items() if known.get(name) != one.time]

    def _plan(self, message: Mapping[str, Any]) -> Any:
        plan = self._plant.plan(_decode_action(message))
        number = self._plans[0] + 1
        self._plans = (number, plan)
        reply = {"number": number, "plan": encode_plan(plan)}
        if isinstance(plan, Trajectory) and plan.body is not self._body:
            self._body = plan.body
            reply["body"] = encode_body(plan.body)
        return reply

    def _plan_sequence(self, message: Mapping[str, Any]) -> Any:
        plans = plan_sequence(self._plant, [_decode_action(one) for one in message["actions"]])
        reply: dict[str, Any] = {"plans": None if plans is None else [encode_plan(one) for one in plans]}
        bodies = [plan.body for plan in plans or () if isinstance(plan, Trajectory)]
        if bodies and bodies[0] is not self._body:
            self._body = bodies[0]
            reply["body"] = encode_body(bodies[0])
        return reply

    def _begin(self, message: Mapping[str, Any]) -> Any:
        number, plan = self._plans
        decided = plan if message["plan"] is not None and message["plan"] == number else None
        if message["plan"] is not None and decided is None:
            return encode_plan(MotionCompletion(False, "stale: the decided plan is not the latest one"))
        motion = self._plant.begin(_decode_action(message), decided)
        return encode_plan(motion) if isinstance(motion, MotionCompletion) else motion

    def _advance(self, message: Mapping[str, Any]) -> Any:
        until = float("inf") if message["until"] is None else message["until"]
        ended = self._plant.advance(_AgentMonitor(self._ask_monitor, self._announce_stop), until)
        return [[motion, encode_plan(how)] for motion, how in ended.items()]

    def _ask_monitor(self, now: float, measured: Mapping[str, Any]) -> str | None:
        """Ask the agent to judge a tick; the dead-man rule if it does not answer."""
        values = {name: encode_value(value) for name, value in measured.items()}
        return self._ask({"tick": now, "measured": values})

    def _announce_stop(self, reason: str, now: float) -> None:
        """Tell the agent that the plant begins to stop by itself."""
        self._ask({"stops": reason, "at": now})

    def _ask(self, question: Mapping[str, Any]) -> str | None:
        """Return the agent's answer, or the dead-man rule; the agent may ask for readings meanwhile."""
        if self._is_agent_lost:
            return DEAD_MAN_RULE
        assert self._channel is not None  # noqa: S101
        try:
            self._connection.settimeout(self._agent_timeout_s)
            self._channel.send(question)
            while "rule" not in (message := self._channel.receive()):
                self._answer(message)
        except ConnectionLostError:
            self._is_agent_lost = True
            return DEAD_MAN_RULE
        finally:
            with suppress(OSError):
                self._connection.settimeout(self._idle_timeout_s)
        rule: str | None = message["rule"]
        return rule

    def _runs_in_real_time(self, message: Mapping[str, Any]) -> Any:
        return bool(getattr(self._plant, "runs_in_real_time", False))

    def _action_kinds(self, message: Mapping[str, Any]) -> Any:
        kinds = known_action_kinds(self._plant)
        return None if kinds is None else sorted(kinds)

    def _truth(self, message: Mapping[str, Any]) -> Any:
        return dict(truth_of(self._plant))

    def _halt(self, message: Mapping[str, Any]) -> Any:
        self._plant.halt(MotionHandle(message["motion"]))

    def _stop(self, message: Mapping[str, Any]) -> Any:
        self._plant.stop()

    def _skill_began(self, message: Mapping[str, Any]) -> Any:
        self._log("skill-began", skill=message["skill"])
        self._plant.skill_began(message["skill"])
        self._skills.append(message["skill"])

    def _skill_ended(self, message: Mapping[str, Any]) -> Any:
        if message["skill"] in self._skills:
            self._skills.remove(message["skill"])
        self._plant.skill_ended(message["skill"], finished=message["finished"])
        self._log("skill-ended", skill=message["skill"], finished=message["finished"])

    def _set_parameters(self, message: Mapping[str, Any]) -> Any:
        announce_parameters(self._plant, message["values"])

    def _shut_down(self, message: Mapping[str, Any]) -> Any:
        self._plant.stop()
        self._log("host-ended")
        self._is_shut_down = True

    def _log(self, event: str, **more: Any) -> None:
        values = {name: reading.value for name, reading in self._plant.observe().items()}
        self._write_event({"event": event, "time": self._plant.now(), **more, "measured": values})


def _decode_action(message: Mapping[str, Any]) -> Action:
    return Action(
        message["kind"], {name: decode_value(value) for name, value in message["parameters"].items()}
    )


_HANDLERS: Final[Mapping[str, Callable[[PlantHost, Mapping[str, Any]], Any]]] = {
    "now": PlantHost._now,
    "observe": PlantHost._observe,
    "pictures": PlantHost._pictures,
    "plan": PlantHost._plan,
    "plan-sequence": PlantHost._plan_sequence,
    "begin": PlantHost._begin,
    "advance": PlantHost._advance,
    "runs-in-real-time": PlantHost._runs_in_real_time,
    "action-kinds": PlantHost._action_kinds,
    "truth": PlantHost._truth,
    "halt": PlantHost._halt,
    "stop": PlantHost._stop,
    "skill-began": PlantHost._skill_began,
    "skill-ended": PlantHost._skill_ended,
    "set-parameters": PlantHost._set_parameters,
    "end": PlantHost._shut_down,
}


class _AgentMonitor:
    """The agent's monitor, as the hosted plant calls it."""

    def __init__(
        self,
        ask: Callable[[float, Mapping[str, Any]], str | None],
        announce: Callable[[str, float], None],
    ) -> None:
        self._ask = ask
        self.begin_stop = announce

    def __call__(self, now: float, measured: Mapping[str, Any]) -> str | None:
        return self._ask(now, measured)


class HostLog:
    """A log that appends a host's events to a file, one line of JSON each.

    Args:
        path: of the file.
    """

    def __init__(self, path: Path) -> None:
        self._path = path

    def __call__(self, event: Mapping[str, Any]) -> None:
        """Append one event.

        Args:
            event: its values; those that JSON cannot hold must convert to float.
        """
        line = {"schema": PLANT_LOG.schema, **event}
        with open_private(self._path) as file:
            file.write((json.dumps(line, default=float) + "\n").encode("ascii"))
