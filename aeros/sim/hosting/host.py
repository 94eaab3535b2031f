"""Hosts a plant for one agent after another, and stops it whenever none commands it.

No control tick passes but inside an `advance` that an agent has asked for, and each only after that agent
has said that the tick before was in order.  An agent that is gone, or does not answer in `PATIENCE`, has
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

from aeros.runtime.ports import Body, Completion, Motion, Plan, Plant, Trajectory
from aeros.sim.hosting.wire import Line, LostError, body_told, heard, plan_told
from aeros.skill import Action

PATIENCE: Final = 5.0
"""Real seconds that an agent has to judge a tick; it takes about a tenth of a millisecond."""

LINGER: Final = 600.0
"""Real seconds without any agent after which a hosted plant ends by itself."""

DEAD_MAN: Final = "dead-man"
"""The rule that an agent breaks which is gone."""


class Host:
    """One plant, offered at a socket.

    tell: hears of what matters to whoever judges a crash: who came and went, what began, what was at rest.
    """

    def __init__(
        self,
        plant: Plant,
        tell: Callable[[Mapping[str, Any]], None],
        patience: float = PATIENCE,
        linger: float = LINGER,
    ) -> None:
        self._plant = plant
        self._tell_it = tell
        self._patience = patience
        self._linger = linger
        self._line: Line | None = None
        self._plans: tuple[int, Plan | None] = (0, None)
        self._body: Body | None = None
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
                        self._converse(connection)
                        continue
                    break
            finally:
                path.unlink(missing_ok=True)

    # One agent.

    def _converse(self, connection: socket.socket) -> None:
        # An agent may think for as long as it likes: nothing moves meanwhile.
        self._line, self._dead = Line(connection, None), False
        self._body, self._patient = None, connection
        self._tell("connected")
        try:
            while not self._ended:
                self._answer(self._line.hear())
        except LostError as lost:
            self._let_go(str(lost))
        finally:
            self._line.close()

    def _let_go(self, why: str) -> None:
        """The agent is gone: everything comes to rest, if it has not already."""
        self._plant.stop()
        for skill in self._skills:
            self._plant.skill_ended(skill, finished=False)
        self._skills.clear()
        self._tell("let-go", why=why, amid_motion=self._dead)

    def _answer(self, message: Mapping[str, Any]) -> None:
        doing = _DOING.get(message.get("do", ""))
        if doing is None:
            raise LostError(f"nobody can do {message.get('do')!r}")
        try:
            reply = doing(self, message)
        except (KeyError, TypeError, ValueError, AttributeError) as fault:
            raise LostError(f"what was asked for makes no sense: {fault}") from fault
        if self._dead:
            raise LostError("the agent did not say that a tick was in order")
        assert self._line is not None  # noqa: S101  answered only while there is somebody
        self._line.say({"is": reply})

    # What an agent may ask for.

    def _now(self, message: Mapping[str, Any]) -> Any:
        return self._plant.now()

    def _observe(self, message: Mapping[str, Any]) -> Any:
        return {name: [one.value, one.time] for name, one in self._plant.observe().items()}

    def _plan(self, message: Mapping[str, Any]) -> Any:
        plan = self._plant.plan(_action(message))
        number = self._plans[0] + 1
        self._plans = (number, plan)
        told = {"number": number, "plan": plan_told(plan)}
        if isinstance(plan, Trajectory) and plan.body is not self._body:
            self._body = plan.body
            told["body"] = body_told(plan.body)
        return told

    def _begin(self, message: Mapping[str, Any]) -> Any:
        number, plan = self._plans
        decided = plan if message["plan"] is not None and message["plan"] == number else None
        if message["plan"] is not None and decided is None:
            return plan_told(Completion(False, "stale: what was decided is not what was planned last"))
        begun = self._plant.begin(_action(message), decided)
        return plan_told(begun) if isinstance(begun, Completion) else begun

    def _advance(self, message: Mapping[str, Any]) -> Any:
        until = float("inf") if message["until"] is None else message["until"]
        ended = self._plant.advance(self._judged, until)
        return [[motion, plan_told(how)] for motion, how in ended.items()]

    def _judged(self, now: float, measured: Mapping[str, Any]) -> str | None:
        """What the agent says of a tick; of an agent that says nothing, that it is gone."""
        if self._dead:
            return DEAD_MAN
        assert self._line is not None  # noqa: S101
        try:
            self._patient.settimeout(self._patience)
            self._line.say({"tick": now, "measured": measured})
            while "rule" not in (message := self._line.hear()):
                self._answer(message)
        except LostError:
            self._dead = True
            return DEAD_MAN
        finally:
            with suppress(OSError):
                self._patient.settimeout(None)
        rule: str | None = message["rule"]
        return rule

    def _halt(self, message: Mapping[str, Any]) -> Any:
        self._plant.halt(Motion(message["motion"]))

    def _stop(self, message: Mapping[str, Any]) -> Any:
        self._plant.stop()

    def _skill_began(self, message: Mapping[str, Any]) -> Any:
        self._tell("skill-began", skill=message["skill"])
        self._plant.skill_began(message["skill"])
        self._skills.append(message["skill"])

    def _skill_ended(self, message: Mapping[str, Any]) -> Any:
        if message["skill"] in self._skills:
            self._skills.remove(message["skill"])
        self._plant.skill_ended(message["skill"], finished=message["finished"])
        self._tell("skill-ended", skill=message["skill"], finished=message["finished"])

    def _end(self, message: Mapping[str, Any]) -> Any:
        self._plant.stop()
        self._tell("ended")
        self._ended = True

    def _tell(self, event: str, **more: Any) -> None:
        values = {name: one.value for name, one in self._plant.observe().items()}
        self._tell_it({"event": event, "time": self._plant.now(), **more, "measured": values})


def _action(message: Mapping[str, Any]) -> Action:
    return Action(message["kind"], {name: heard(value) for name, value in message["parameters"].items()})


_DOING: Final[Mapping[str, Callable[[Host, Mapping[str, Any]], Any]]] = {
    "now": Host._now,
    "observe": Host._observe,
    "plan": Host._plan,
    "begin": Host._begin,
    "advance": Host._advance,
    "halt": Host._halt,
    "stop": Host._stop,
    "skill-began": Host._skill_began,
    "skill-ended": Host._skill_ended,
    "end": Host._end,
}


class HostLog:
    """Writes what a host tells as lines of JSON."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def __call__(self, told: Mapping[str, Any]) -> None:
        """Write one line."""
        with self._path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(told, default=float) + "\n")
