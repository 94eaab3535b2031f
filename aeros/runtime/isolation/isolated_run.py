"""Run of a skill in a worker: whatever the code does becomes an action or an ending, within a time limit."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Final

from aeros.runtime.isolation.isolated_code import IsolatedCode, format_exit_code
from aeros.runtime.isolation.layers import IsolationLayer
from aeros.runtime.isolation.limits import USUAL_LIMITS, ProcessLimits
from aeros.runtime.isolation.protocol import (
    ActionRequested,
    CloseSkill,
    LoadSkill,
    ProtocolError,
    ResponseTimeoutError,
    ResumeSkill,
    SkillClosed,
    SkillDenied,
    SkillFinished,
    SkillRaised,
    WorkerConnection,
    WorkerEndedError,
    WorkerResponse,
)
from aeros.runtime.isolation.zygote_pool import ZygotePool
from aeros.runtime.ports import StepStatus
from aeros.runtime.skills.contract import NoActionError, copy_action
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


class IsolatedRun(IsolatedCode):
    """Skill loaded in a worker of its own, not yet started; implements `SkillRunProtocol`.

    Args:
        pool: provides the worker.
        layers: isolation layers that the worker applies before it sees any code.
        code: certified code of the skill.
        inputs: checked inputs, SI, by name.
        answer_within: limit on the time of each answer, s of real time.
        limits: limits on its process.

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
        limits: ProcessLimits = USUAL_LIMITS,
    ) -> None:
        super().__init__(pool, code.module, limits=limits)
        self._answer_within = answer_within
        self._is_open = False
        load = LoadSkill(
            WorkerConnection.token(),
            tuple(layer.value for layer in layers),
            code.file,
            code.function,
            dict(inputs),
            code.models,
            limits.memory,
        )
        self._load(load, answer_within)

    def resume(self, observation: Observation, seconds: float, denial: str = "") -> Action | SkillRunResult:
        """Implement `SkillRunProtocol.resume`; kills the worker if it exceeds its time limit."""
        if not self._is_alive:
            return SkillRunResult(StepStatus.RAISED, "the skill's process has ended")
        within = min(max(seconds, MIN_RESPONSE_TIMEOUT_S), self._answer_within)
        self._is_open = True
        try:
            resume = ResumeSkill(WorkerConnection.token(), dict(observation), denial)
            return self._interpret_response(self._request(resume, within))
        except ResponseTimeoutError:
            self._kill_worker()
            return SkillRunResult(
                StepStatus.TIMED_OUT, f"the skill did not answer within {within:g} s and was killed"
            )
        except WorkerEndedError:
            return SkillRunResult(
                StepStatus.RAISED, f"the skill's process {format_exit_code(self._kill_worker())}"
            )
        except ProtocolError as failure:
            self._kill_worker()
            return SkillRunResult(StepStatus.RAISED, f"the skill's process was killed: {failure}")

    def close(self) -> str | None:
        """Implement `SkillRunProtocol.close`; ends the skill and every process that it started."""
        if not self._is_alive:
            return None
        try:
            return self._clean_up() if self._is_open else None
        finally:
            self._kill_worker()

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
        if isinstance(response, SkillDenied):
            reason = "the skill did not catch a denial"
            return SkillRunResult(StepStatus.DENIED, reason, denials=response.denials)
        raise ProtocolError("it sent an unexpected response")

    def _clean_up(self) -> str | None:
        try:
            response = self._request(CloseSkill(WorkerConnection.token()), _CLEAN_UP_TIMEOUT_S)
        except ResponseTimeoutError:
            return f"TimeoutError: it took more than {_CLEAN_UP_TIMEOUT_S:g} s and was killed"
        except ProtocolError as failure:
            return f"{type(failure).__name__}: {failure}"
        return (
            response.error
            if isinstance(response, SkillClosed)
            else "ProtocolError: it sent an unexpected response"
        )
