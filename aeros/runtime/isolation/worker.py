"""Worker process: locks itself down, runs one skill once or one perceiver for many views, and ends.

After `apply_layers` everything here shares its process with hostile code and defends nothing: that code may
talk to the runtime itself. The kernel confines it, and the runtime's side of `protocol` checks what it sends.
"""

from __future__ import annotations

import sys
from typing import Final, Protocol, cast

from aeros.descriptions import describe_exception
from aeros.models.interface import ModelFileError
from aeros.models.load import load_models
from aeros.runtime.isolation.layers import IsolationLayer, apply_layers
from aeros.runtime.isolation.protocol import (
    MAX_RESPONSE_BYTES,
    ActionRequested,
    CloseSkill,
    JsonValue,
    LoadSkill,
    ResumeSkill,
    RuntimeRequest,
    SkillClosed,
    SkillDenied,
    SkillFinished,
    SkillLoaded,
    SkillRaised,
    SkillRejected,
    WorkerResponse,
    encode,
    receive_request,
    sanitize_text,
    send_response,
)
from aeros.runtime.skills.contract import (
    NoActionError,
    SkillFunction,
    SkillRefusedError,
    check_outputs,
    continue_skill,
    copy_action,
    start_skill,
)
from aeros.runtime.skills.raised import describe_raised
from aeros.skill import Action, ActionDenied, Models, SkillBody

_FINAL_RESPONSES: Final = (SkillRejected, SkillFinished, SkillRaised, SkillDenied, SkillClosed)


class _Handler(Protocol):
    def handle(self, question: RuntimeRequest) -> WorkerResponse: ...


def serve(channel: int, memory: int | None = None) -> None:
    """Run the one skill or perceiver that the runtime sends.

    Args:
        channel: descriptor of a socket whose other end the runtime holds.
        memory: descriptor of the memory with a perceiver's pictures; None for a skill.
    """
    worker: _Handler = _Worker(channel)
    if memory is not None:
        # Needs NumPy, which skills do without.
        from aeros.runtime.isolation.perceiver_worker import PerceiverWorker

        worker = PerceiverWorker(channel, memory)
    while (question := receive_request(channel)) is not None:
        response = worker.handle(question)
        send_response(channel, encode(response))
        if isinstance(response, _FINAL_RESPONSES):
            return


class _Worker:
    def __init__(self, channel: int) -> None:
        self._channel = channel
        self._load: LoadSkill | None = None
        self._function: SkillFunction | None = None
        self._models: Models = {}
        self._body: SkillBody | None = None

    def handle(self, question: RuntimeRequest) -> WorkerResponse:
        if isinstance(question, LoadSkill):
            return self._handle_load(question)
        if isinstance(question, CloseSkill):
            return self._handle_close(question.token)
        if self._load is None or self._function is None or not isinstance(question, ResumeSkill):
            return SkillRaised(question.token, "no skill is loaded")
        try:
            if self._body is None:
                self._body = start_skill(
                    self._function, question.observation, self._load.inputs, self._models
                )
                yielded = next(self._body)
            else:
                yielded = continue_skill(self._body, question.observation, question.denial)
            action = copy_action(yielded)
        except StopIteration as end:
            return _finished_message(question.token, end.value)
        except ActionDenied as uncaught:
            return SkillDenied(question.token, uncaught.denials)
        except NoActionError as failure:
            return SkillRaised(question.token, sanitize_text(str(failure)))
        except BaseException as failure:
            known = (*question.observation, *self._load.inputs)
            return SkillRaised(question.token, sanitize_text(describe_raised(failure, self._function, known)))
        return _action_message(question.token, action)

    def _handle_load(self, load: LoadSkill) -> WorkerResponse:
        try:
            apply_layers([IsolationLayer(name) for name in load.layers], self._channel, load.memory)
        except OSError as failure:
            return SkillRejected(
                load.token, sanitize_text(f"a layer of isolation cannot be applied: {failure}")
            )
        # No file can be opened any more; without paths an import fails with the usual message.
        sys.path.clear()
        sys.path_importer_cache.clear()
        self._load = load
        try:
            self._models = load_models(load.models)
            self._function = load.file.generator_function(load.function)
        except ModelFileError as failure:
            return SkillRejected(
                load.token,
                sanitize_text(f"a model of module `{load.file.module}` cannot be loaded: {failure}"),
            )
        except SkillRefusedError as refusal:
            return SkillRejected(load.token, sanitize_text(str(refusal)))
        except BaseException as failure:
            return SkillRejected(load.token, sanitize_text(describe_exception(failure)))
        return SkillLoaded(load.token)

    def _handle_close(self, token: bytes) -> SkillClosed:
        try:
            if self._body is not None:
                self._body.close()
        except BaseException as failure:
            return SkillClosed(token, sanitize_text(describe_exception(failure)))
        return SkillClosed(token, None)


def _finished_message(token: bytes, value: object) -> WorkerResponse:
    try:
        finished = SkillFinished(
            token, cast("dict[str, JsonValue | list[JsonValue]] | None", check_outputs(value))
        )
        size = len(encode(finished))
    except NoActionError as failure:
        return SkillRaised(token, sanitize_text(str(failure)))
    except (TypeError, ValueError, OverflowError, RecursionError) as failure:
        return SkillRaised(
            token, sanitize_text(f"the skill returns outputs that are not plain data: {failure}")
        )
    if size > MAX_RESPONSE_BYTES:
        return SkillRaised(token, f"the skill returns outputs of more than {MAX_RESPONSE_BYTES} bytes")
    return finished


def _action_message(token: bytes, action: Action) -> WorkerResponse:
    # msgspec accepts exact built-in types only, so no code of the values runs here.
    try:
        request = ActionRequested(token, action.kind, dict(action.parameters))
        size = len(encode(request))
    except (TypeError, ValueError, OverflowError, RecursionError) as failure:
        return SkillRaised(
            token, sanitize_text(f"the skill asks for an action that is not plain data: {failure}")
        )
    if size > MAX_RESPONSE_BYTES:
        return SkillRaised(token, f"the skill asks for an action of more than {MAX_RESPONSE_BYTES} bytes")
    return request
