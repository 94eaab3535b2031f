"""Hosts a plant for one agent after another, and stops it whenever none commands it.

No control tick passes but inside an `advance` that an agent has asked for, and each only after that agent
has said that the tick before was in order.  An agent that is gone, or does not answer in `AGENT_TIMEOUT_S`,
has
not said so: the plant makes a protective stop within that tick, as for a violated rule, and whatever was
under way is over.  So while nobody decides, nothing moves.

Not modelled: what goes on in the world meanwhile.  The plant's clock stands still while nobody is there.
"""

from __future__ import annotations

import json
import socket
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from aeros.runtime.ports import MotionCompletion, MotionHandle, PlannedMotion, Plant, RobotBody, Trajectory
from aeros.sim.hosting.wire import ConnectionLostError, MessageChannel, decode_value, encode_body, encode_plan
from aeros.skill import Action

AGENT_TIMEOUT_S: Final = 5.0
"""Real seconds that an agent has to judge a tick; it takes about a tenth of a millisecond."""

IDLE_TIMEOUT_S: Final = 600.0
"""Real seconds without any agent after which a hosted plant ends by itself."""

DEAD_MAN_RULE: Final = "dead-man"
"""The rule that an agent breaks which is gone."""


class PlantHost:
    """One plant, offered at a socket.

    tell: hears of what matters to whoever judges a crash: who came and went, what began, what was at rest.
    """

    def __init__(
        self,
        plant: Plant,
        log: Callable[[Mapping[str, Any]], None],
        patience: float = AGENT_TIMEOUT_S,
        linger: float = IDLE_TIMEOUT_S,
    ) -> None:
        self._plant = plant
        self._tell_it = log
        self._patience = patience
        self._linger = linger
        self._line: MessageChannel | None = None
        self._plans: tuple[int, PlannedMotion | None] = (0, None)
        self._body: RobotBody | None = None
        self._skills: list[str] = []
        self._dead = False
        self._ended = False

    def serve(self, path: Path) -> None:
        """Serve agents, one at a time, until one says that it was the last or none has come for long."""
        path.unlink(missing_ok=True)
        with socket.socket(socket.AF_UNIX) as listening:
            listening.bind(str(path))
            listening.listen()
            listening.settimeout(self._linger)
            try:
                while not self._ended:
                    with suppress(TimeoutError):
                        connection, _ = listening.accept()
                        self._serve_connection(connection)
                        continue
                    break
            finally:
                path.unlink(missing_ok=True)

    # One agent.

    def _serve_connection(self, connection: socket.socket) -> None:
        # An agent may think for as long as it likes: nothing moves meanwhile.
        self._line, self._dead = MessageChannel(connection, None), False
        self._body, self._patient = None, connection
        self._log("connected")
        try:
            while not self._ended:
                self._answer(self._line.receive())
        except ConnectionLostError as lost:
            self._on_disconnect(str(lost))
        finally:
            self._line.close()

    def _on_disconnect(self, why: str) -> None:
        """The agent is gone: everything comes to rest, if it has not already."""
        self._plant.stop()
        for skill in self._skills:
            self._plant.skill_ended(skill, finished=False)
        self._skills.clear()
        self._log("let-go", why=why, amid_motion=self._dead)

    def _answer(self, message: Mapping[str, Any]) -> None:
        doing = _HANDLERS.get(message.get("do", ""))
        if doing is None:
            raise ConnectionLostError(f"nobody can do {message.get('do')!r}")
        try:
            reply = doing(self, message)
        except (KeyError, TypeError, ValueError, AttributeError) as fault:
            raise ConnectionLostError(f"what was asked for makes no sense: {fault}") from fault
        if self._dead:
            raise ConnectionLostError("the agent did not say that a tick was in order")
        assert self._line is not None  # noqa: S101  answered only while there is somebody
        self._line.send({"is": reply})

    # What an agent may ask for.

    def _now(self, message: Mapping[str, Any]) -> Any:
        return self._plant.now()

    def _observe(self, message: Mapping[str, Any]) -> Any:
        return {name: [one.value, one.time] for name, one in self._plant.observe().items()}

    def _plan(self, message: Mapping[str, Any]) -> Any:
        plan = self._plant.plan(_decode_action(message))
        number = self._plans[0] + 1
        self._plans = (number, plan)
        told = {"number": number, "plan": encode_plan(plan)}
        if isinstance(plan, Trajectory) and plan.body is not self._body:
            self._body = plan.body
            told["body"] = encode_body(plan.body)
        return told

    def _begin(self, message: Mapping[str, Any]) -> Any:
        number, plan = self._plans
        decided = plan if message["plan"] is not None and message["plan"] == number else None
        if message["plan"] is not None and decided is None:
            return encode_plan(
                MotionCompletion(False, "stale: what was decided is not what was planned last")
            )
        begun = self._plant.begin(_decode_action(message), decided)
        return encode_plan(begun) if isinstance(begun, MotionCompletion) else begun

    def _advance(self, message: Mapping[str, Any]) -> Any:
        until = float("inf") if message["until"] is None else message["until"]
        ended = self._plant.advance(self._ask_monitor, until)
        return [[motion, encode_plan(how)] for motion, how in ended.items()]

    def _ask_monitor(self, now: float, measured: Mapping[str, Any]) -> str | None:
        """What the agent says of a tick; of an agent that says nothing, that it is gone."""
        if self._dead:
            return DEAD_MAN_RULE
        assert self._line is not None  # noqa: S101
        try:
            self._patient.settimeout(self._patience)
            self._line.send({"tick": now, "measured": measured})
            while "rule" not in (message := self._line.receive()):
                self._answer(message)
        except ConnectionLostError:
            self._dead = True
            return DEAD_MAN_RULE
        finally:
            with suppress(OSError):
                self._patient.settimeout(None)
        rule: str | None = message["rule"]
        return rule

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

    def _shut_down(self, message: Mapping[str, Any]) -> Any:
        self._plant.stop()
        self._log("ended")
        self._ended = True

    def _log(self, event: str, **more: Any) -> None:
        values = {name: one.value for name, one in self._plant.observe().items()}
        self._tell_it({"event": event, "time": self._plant.now(), **more, "measured": values})


def _decode_action(message: Mapping[str, Any]) -> Action:
    return Action(
        message["kind"], {name: decode_value(value) for name, value in message["parameters"].items()}
    )


_HANDLERS: Final[Mapping[str, Callable[[PlantHost, Mapping[str, Any]], Any]]] = {
    "now": PlantHost._now,
    "observe": PlantHost._observe,
    "plan": PlantHost._plan,
    "begin": PlantHost._begin,
    "advance": PlantHost._advance,
    "halt": PlantHost._halt,
    "stop": PlantHost._stop,
    "skill-began": PlantHost._skill_began,
    "skill-ended": PlantHost._skill_ended,
    "end": PlantHost._shut_down,
}


class HostLog:
    """Writes what a host tells as lines of JSON."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def __call__(self, event: Mapping[str, Any]) -> None:
        """Write one line."""
        with self._path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(event, default=float) + "\n")
