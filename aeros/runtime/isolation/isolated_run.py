"""One run of a skill in a worker: whatever the code does comes back as an action or as an ending, in time."""

from __future__ import annotations

import signal
from collections.abc import Iterable, Mapping
from typing import Any, Final

from aeros.runtime.isolation.layers import IsolationLayer
from aeros.runtime.isolation.protocol import (
    ActionRequested,
    CloseSkill,
    LoadSkill,
    ProtocolError,
    ResponseTimeoutError,
    ResumeSkill,
    SkillClosed,
    SkillFinished,
    SkillLoaded,
    SkillRaised,
    SkillRejected,
    WorkerConnection,
    WorkerGoneError,
    WorkerResponse,
)
from aeros.runtime.isolation.zygote_pool import ZygoteError, ZygotePool
from aeros.runtime.ports import StepStatus
from aeros.runtime.skills.contract import NoActionError, SkillRefusedError, copy_action
from aeros.runtime.skills.in_process_run import SkillRunResult, finished_result
from aeros.runtime.skills.load import CertifiedCode
from aeros.skill import Action, Observation

MIN_RESPONSE_TIMEOUT_S: Final = 1.0
"""Seconds of real time that a skill has for each answer at least.

What is left of its time-out is plant time.  A simulation's clock stands still while a skill thinks, so
whether a skill is late in it must not depend on how busy the machine is; and where it does not stand
still, the time-out is looked at again when the answer is there, before anything moves.
"""

_CLEAN_UP_TIMEOUT_S: Final = 1.0
"""Seconds of real time that a skill's own clean-up has."""


class IsolatedRun:
    """A skill loaded in a worker of its own, not yet started.

    layers: what the worker puts on before it sees any code.
    answer_within: seconds of real time in which each answer must be there.
    Raises `SkillRefusedError`.
    """

    def __init__(
        self,
        nursery: ZygotePool,
        layers: Iterable[IsolationLayer],
        code: CertifiedCode,
        inputs: Mapping[str, Any],
        answer_within: float,
    ) -> None:
        self._nursery = nursery
        self._answer_within = answer_within
        self._is_open = False
        try:
            self._zygote, channel = nursery.spawn_worker()
        except ZygoteError as failure:
            raise SkillRefusedError(
                f"no worker can be had for module `{code.module}`: {failure}"
            ) from failure
        self._conversation = WorkerConnection(channel)
        self._is_alive = True
        try:
            self._load(layers, code, inputs)
        except BaseException:
            self._kill_worker()
            raise

    def resume(self, observation: Observation, seconds: float) -> Action | SkillRunResult:
        """Run the skill up to its next action or its end, for at most `seconds` more or its limit."""
        if not self._is_alive:
            return SkillRunResult(StepStatus.RAISED, "the skill's process has ended")
        within = min(max(seconds, MIN_RESPONSE_TIMEOUT_S), self._answer_within)
        self._is_open = True
        try:
            said = self._conversation.request(
                ResumeSkill(WorkerConnection.token(), dict(observation)), within
            )
            return self._interpret_response(said)
        except ResponseTimeoutError:
            self._kill_worker()
            return SkillRunResult(
                StepStatus.TIMED_OUT, f"the skill did not answer within {within:g} s and was killed"
            )
        except WorkerGoneError:
            return SkillRunResult(
                StepStatus.RAISED, f"the skill's process {_format_exit_code(self._kill_worker())}"
            )
        except ProtocolError as failure:
            self._kill_worker()
            return SkillRunResult(StepStatus.RAISED, f"the skill's process was killed: {failure}")

    def close(self) -> str | None:
        """End the skill and everything that it started; what its own clean-up raised, if anything."""
        if not self._is_alive:
            return None
        try:
            return self._clean_up() if self._is_open else None
        finally:
            self._kill_worker()

    # Inside.

    def _load(self, layers: Iterable[IsolationLayer], code: CertifiedCode, inputs: Mapping[str, Any]) -> None:
        names = tuple(layer.value for layer in layers)
        load = LoadSkill(
            WorkerConnection.token(),
            names,
            code.module,
            code.name,
            code.path,
            code.content,
            code.function,
            dict(inputs),
        )
        try:
            said = self._conversation.request(load, self._answer_within)
        except WorkerGoneError as failure:
            why = f"its process {_format_exit_code(self._kill_worker())}"
            raise SkillRefusedError(f"the code of module `{code.module}` fails to load: {why}") from failure
        except (ProtocolError, TypeError, ValueError, OverflowError) as failure:
            raise SkillRefusedError(
                f"the code of module `{code.module}` fails to load: {failure}"
            ) from failure
        if not isinstance(said, SkillLoaded):
            why = said.reason if isinstance(said, SkillRejected) else "it answers out of turn"
            raise SkillRefusedError(why)

    def _interpret_response(self, response: WorkerResponse) -> Action | SkillRunResult:
        if isinstance(response, ActionRequested):
            try:
                return copy_action(Action(response.kind, response.parameters))
            except NoActionError as failure:
                return SkillRunResult(StepStatus.RAISED, str(failure))
        self._is_open = False
        if isinstance(response, SkillFinished):
            return finished_result(response.outputs)
        if isinstance(response, SkillRaised):
            return SkillRunResult(StepStatus.RAISED, response.reason)
        raise ProtocolError("it answers out of turn")

    def _clean_up(self) -> str | None:
        try:
            said = self._conversation.request(CloseSkill(WorkerConnection.token()), _CLEAN_UP_TIMEOUT_S)
        except ResponseTimeoutError:
            return f"TimeoutError: it took more than {_CLEAN_UP_TIMEOUT_S:g} s and was killed"
        except ProtocolError as failure:
            return f"{type(failure).__name__}: {failure}"
        return said.error if isinstance(said, SkillClosed) else "ConversationError: it answers out of turn"

    def _kill_worker(self) -> int | None:
        """Kill the worker with everything below it; its exit code if it is known."""
        if not self._is_alive:
            return None
        self._is_alive = False
        self._conversation.close()
        try:
            code = self._zygote.end_worker()
        except ZygoteError:
            return None  # the zygote is dead, and with it everything below it: nothing to give back
        self._nursery.release(self._zygote)
        return code


def _format_exit_code(code: int | None) -> str:
    if code is None or code == -signal.SIGKILL:
        return "hung up or was killed"
    if code >= 0:
        return f"ended with exit status {code}"
    try:
        return f"was killed by {signal.Signals(-code).name}"
    except ValueError:
        return f"was killed by signal {-code}"
