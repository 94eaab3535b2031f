"""One run of a skill in a worker: whatever the code does comes back as an action or as an ending, in time."""

from __future__ import annotations

import signal
from collections.abc import Iterable, Mapping
from typing import Any, Final

from aeros.runtime.isolation.layers import Layer
from aeros.runtime.isolation.protocol import (
    Answer,
    Asked,
    Close,
    Closed,
    Conversation,
    ConversationError,
    EndedError,
    Finished,
    LateError,
    Load,
    Loaded,
    Raised,
    Refused,
    Resume,
)
from aeros.runtime.isolation.zygote_pool import Nursery, ZygoteError
from aeros.runtime.ports import StepStatus
from aeros.runtime.skills.contract import NoActionError, SkillRefusedError, snapshot
from aeros.runtime.skills.in_process_run import Ending, finished
from aeros.runtime.skills.load import CertifiedCode
from aeros.skill import Action, Observation

LEAST_ANSWER: Final = 1.0
"""Seconds of real time that a skill has for each answer at least.

What is left of its time-out is plant time.  A simulation's clock stands still while a skill thinks, so
whether a skill is late in it must not depend on how busy the machine is; and where it does not stand
still, the time-out is looked at again when the answer is there, before anything moves.
"""

_CLEAN_UP: Final = 1.0
"""Seconds of real time that a skill's own clean-up has."""


class IsolatedRun:
    """A skill loaded in a worker of its own, not yet started.

    layers: what the worker puts on before it sees any code.
    answer_within: seconds of real time in which each answer must be there.
    Raises `SkillRefusedError`.
    """

    def __init__(
        self,
        nursery: Nursery,
        layers: Iterable[Layer],
        code: CertifiedCode,
        inputs: Mapping[str, Any],
        answer_within: float,
    ) -> None:
        self._nursery = nursery
        self._answer_within = answer_within
        self._is_open = False
        try:
            self._zygote, channel = nursery.spawn()
        except ZygoteError as failure:
            raise SkillRefusedError(
                f"no worker can be had for module `{code.module}`: {failure}"
            ) from failure
        self._conversation = Conversation(channel)
        self._is_alive = True
        try:
            self._load(layers, code, inputs)
        except BaseException:
            self._end()
            raise

    def resume(self, observed: Observation, seconds: float) -> Action | Ending:
        """Run the skill up to its next action or its end, for at most `seconds` more or its limit."""
        if not self._is_alive:
            return Ending(StepStatus.RAISED, "the skill's process has ended")
        within = min(max(seconds, LEAST_ANSWER), self._answer_within)
        self._is_open = True
        try:
            said = self._conversation.ask(Resume(Conversation.token(), dict(observed)), within)
            return self._understood(said)
        except LateError:
            self._end()
            return Ending(
                StepStatus.TIMED_OUT, f"the skill did not answer within {within:g} s and was killed"
            )
        except EndedError:
            return Ending(StepStatus.RAISED, f"the skill's process {_spell_exit(self._end())}")
        except ConversationError as failure:
            self._end()
            return Ending(StepStatus.RAISED, f"the skill's process was killed: {failure}")

    def close(self) -> str | None:
        """End the skill and everything that it started; what its own clean-up raised, if anything."""
        if not self._is_alive:
            return None
        try:
            return self._clean_up() if self._is_open else None
        finally:
            self._end()

    # Inside.

    def _load(self, layers: Iterable[Layer], code: CertifiedCode, inputs: Mapping[str, Any]) -> None:
        names = tuple(layer.value for layer in layers)
        load = Load(
            Conversation.token(),
            names,
            code.module,
            code.name,
            code.path,
            code.content,
            code.function,
            dict(inputs),
        )
        try:
            said = self._conversation.ask(load, self._answer_within)
        except EndedError as failure:
            why = f"its process {_spell_exit(self._end())}"
            raise SkillRefusedError(f"the code of module `{code.module}` fails to load: {why}") from failure
        except (ConversationError, TypeError, ValueError, OverflowError) as failure:
            raise SkillRefusedError(
                f"the code of module `{code.module}` fails to load: {failure}"
            ) from failure
        if not isinstance(said, Loaded):
            why = said.reason if isinstance(said, Refused) else "it answers out of turn"
            raise SkillRefusedError(why)

    def _understood(self, said: Answer) -> Action | Ending:
        if isinstance(said, Asked):
            try:
                return snapshot(Action(said.kind, said.parameters))
            except NoActionError as failure:
                return Ending(StepStatus.RAISED, str(failure))
        self._is_open = False
        if isinstance(said, Finished):
            return finished(said.outputs)
        if isinstance(said, Raised):
            return Ending(StepStatus.RAISED, said.reason)
        raise ConversationError("it answers out of turn")

    def _clean_up(self) -> str | None:
        try:
            said = self._conversation.ask(Close(Conversation.token()), _CLEAN_UP)
        except LateError:
            return f"TimeoutError: it took more than {_CLEAN_UP:g} s and was killed"
        except ConversationError as failure:
            return f"{type(failure).__name__}: {failure}"
        return said.complaint if isinstance(said, Closed) else "ConversationError: it answers out of turn"

    def _end(self) -> int | None:
        """Kill the worker with everything below it; its exit code if it is known."""
        if not self._is_alive:
            return None
        self._is_alive = False
        self._conversation.close()
        try:
            code = self._zygote.end_worker()
        except ZygoteError:
            return None  # the zygote is dead, and with it everything below it: nothing to give back
        self._nursery.give_back(self._zygote)
        return code


def _spell_exit(code: int | None) -> str:
    if code is None or code == -signal.SIGKILL:
        return "hung up or was killed"
    if code >= 0:
        return f"ended with exit status {code}"
    try:
        return f"was killed by {signal.Signals(-code).name}"
    except ValueError:
        return f"was killed by signal {-code}"
