"""Run of a skill in a worker: whatever the code does becomes an action or an ending, within a time limit."""

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
    WorkerEndedError,
    WorkerResponse,
)
from aeros.runtime.isolation.zygote_pool import ZygoteError, ZygotePool
from aeros.runtime.ports import StepStatus
from aeros.runtime.skills.contract import NoActionError, SkillRefusedError, copy_action
from aeros.runtime.skills.in_process_run import SkillRunResult, finished_result
from aeros.runtime.skills.load import CertifiedCode
from aeros.skill import Action, Observation

MIN_RESPONSE_TIMEOUT_S: Final = 1.0
"""Minimum time that a skill has for each answer, s of real time.

The rest of its timeout is plant time.  A simulator's clock stands still while a skill computes, so a
timeout there must not depend on how busy the machine is.  On a clock that goes on, the timeout is checked
again when the answer has arrived, before anything moves.
"""

_CLEAN_UP_TIMEOUT_S: Final = 1.0
"""Time that a skill's own clean-up has, s of real time."""


class IsolatedRun:
    """Skill loaded in a worker of its own, not yet started; implements `SkillRunProtocol`.

    Args:
        pool: provides the worker.
        layers: isolation layers that the worker applies before it sees any code.
        code: certified code of the skill.
        inputs: checked inputs, SI, by name.
        answer_within: limit on the time of each answer, s of real time.

    Raises:
        SkillRefusedError: there is no worker, or the code cannot be loaded in it.
    """

    def __init__(
        self,
        pool: ZygotePool,
        layers: Iterable[IsolationLayer],
        code: CertifiedCode,
        inputs: Mapping[str, Any],
        answer_within: float,
    ) -> None:
        self._pool = pool
        self._answer_within = answer_within
        self._is_open = False
        try:
            self._zygote, channel = pool.spawn_worker()
        except ZygoteError as failure:
            raise SkillRefusedError(f"there is no worker for module `{code.module}`: {failure}") from failure
        self._connection = WorkerConnection(channel)
        self._is_alive = True
        try:
            self._load(layers, code, inputs)
        except BaseException:
            self._kill_worker()
            raise

    def resume(self, observation: Observation, seconds: float) -> Action | SkillRunResult:
        """Implements `SkillRunProtocol.resume`; kills the worker if it exceeds its time limit."""
        if not self._is_alive:
            return SkillRunResult(StepStatus.RAISED, "the skill's process has ended")
        within = min(max(seconds, MIN_RESPONSE_TIMEOUT_S), self._answer_within)
        self._is_open = True
        try:
            response = self._connection.request(
                ResumeSkill(WorkerConnection.token(), dict(observation)), within
            )
            return self._interpret_response(response)
        except ResponseTimeoutError:
            self._kill_worker()
            return SkillRunResult(
                StepStatus.TIMED_OUT, f"the skill did not answer within {within:g} s and was killed"
            )
        except WorkerEndedError:
            return SkillRunResult(
                StepStatus.RAISED, f"the skill's process {_format_exit_code(self._kill_worker())}"
            )
        except ProtocolError as failure:
            self._kill_worker()
            return SkillRunResult(StepStatus.RAISED, f"the skill's process was killed: {failure}")

    def close(self) -> str | None:
        """Implements `SkillRunProtocol.close`; ends the skill and every process that it started."""
        if not self._is_alive:
            return None
        try:
            return self._clean_up() if self._is_open else None
        finally:
            self._kill_worker()

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
            code.models,
        )
        try:
            response = self._connection.request(load, self._answer_within)
        except WorkerEndedError as failure:
            why = f"its process {_format_exit_code(self._kill_worker())}"
            raise SkillRefusedError(f"the code of module `{code.module}` fails to load: {why}") from failure
        except (ProtocolError, TypeError, ValueError, OverflowError) as failure:
            raise SkillRefusedError(
                f"the code of module `{code.module}` fails to load: {failure}"
            ) from failure
        if not isinstance(response, SkillLoaded):
            why = response.reason if isinstance(response, SkillRejected) else "it sent an unexpected response"
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
        raise ProtocolError("it sent an unexpected response")

    def _clean_up(self) -> str | None:
        try:
            response = self._connection.request(CloseSkill(WorkerConnection.token()), _CLEAN_UP_TIMEOUT_S)
        except ResponseTimeoutError:
            return f"TimeoutError: it took more than {_CLEAN_UP_TIMEOUT_S:g} s and was killed"
        except ProtocolError as failure:
            return f"{type(failure).__name__}: {failure}"
        return (
            response.error
            if isinstance(response, SkillClosed)
            else "ProtocolError: it sent an unexpected response"
        )

    def _kill_worker(self) -> int | None:
        """Kill the worker with all its descendants; return its exit code if it is known."""
        if not self._is_alive:
            return None
        self._is_alive = False
        self._connection.close()
        try:
            code = self._zygote.end_worker()
        except ZygoteError:
            return None  # the zygote was killed with everything below it, so it is not released
        self._pool.release(self._zygote)
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
