"""Worker of one perceiver: maps its pictures for reading, locks itself down, and computes values of views.

Like `worker`, it defends nothing once the code runs: the kernel confines the process. The mapping can never
be made writable, as its descriptor was opened for reading alone.
"""

from __future__ import annotations

import mmap
import sys
from collections.abc import Generator
from typing import Any

from aeros.descriptions import describe_exception
from aeros.models.interface import ModelFileError
from aeros.models.load import load_models
from aeros.perception.plain_values import NoValuesError, plain_values
from aeros.perception.view_builder import PictureData, build_view
from aeros.runtime.isolation.layers import IsolationLayer, apply_layers
from aeros.runtime.isolation.protocol import (
    MAX_RESPONSE_BYTES,
    CloseSkill,
    LoadPerceiver,
    PerceivedValue,
    ResumePerceiver,
    RuntimeRequest,
    SkillClosed,
    SkillLoaded,
    SkillRaised,
    SkillRejected,
    ValuesPerceived,
    WorkerResponse,
    encode,
    sanitize_text,
)
from aeros.runtime.skills.contract import SkillRefusedError
from aeros.runtime.skills.perceiver_code import (
    PerceiverFunction,
    PerceiverNames,
    execute_perceiver,
    start_perceiver,
)
from aeros.runtime.skills.raised import describe_raised
from aeros.skill import Models


class PerceiverWorker:
    """Handler of the requests to one perceiver.

    Args:
        channel: descriptor of the socket to the runtime.
        memory: descriptor of the memory with the pictures, open for reading alone.
    """

    def __init__(self, channel: int, memory: int) -> None:
        self._channel = channel
        self._memory = memory
        self._load: LoadPerceiver | None = None
        self._pictures = memoryview(b"")
        self._function: PerceiverFunction | None = None
        self._models: Models = {}
        self._body: Generator[Any, Any, None] | None = None

    def handle(self, question: RuntimeRequest) -> WorkerResponse:
        """Answer one request.

        Args:
            question: the request.

        Returns:
            The response; `SkillRejected` or `SkillRaised` is the last one.
        """
        if isinstance(question, LoadPerceiver):
            return self._handle_load(question)
        if isinstance(question, CloseSkill):
            return SkillClosed(question.token, None)
        if self._load is None or self._function is None or not isinstance(question, ResumePerceiver):
            return SkillRaised(question.token, "no perceiver is loaded")
        try:
            view = build_view(
                question.time, question.readings, question.samples, self._picture_data(self._load, question)
            )
            if self._body is None:
                self._body = start_perceiver(self._function, view, self._models)
                yielded = next(self._body)
            else:
                yielded = self._body.send(view)
            return _values_message(question.token, yielded)
        except StopIteration:
            return SkillRaised(question.token, "the perceiver returned: it yields values for every view")
        except BaseException as failure:
            known = (*question.readings, *(slot.camera for slot in self._load.slots))
            return SkillRaised(question.token, sanitize_text(describe_raised(failure, self._function, known)))

    def _handle_load(self, load: LoadPerceiver) -> WorkerResponse:
        try:
            if load.size:
                mapped = mmap.mmap(self._memory, load.size, flags=mmap.MAP_SHARED, prot=mmap.PROT_READ)
                self._pictures = memoryview(mapped)
            apply_layers([IsolationLayer(name) for name in load.layers], self._channel, load.memory)
        except OSError as failure:
            why = f"a layer of isolation cannot be applied: {failure}"
            return SkillRejected(load.token, sanitize_text(why))
        # No file can be opened any more; without paths an import fails with the usual message.
        sys.path.clear()
        sys.path_importer_cache.clear()
        names = PerceiverNames(load.members, load.builtins)
        try:
            self._models = load_models(load.models)
            self._function = execute_perceiver(load.file, load.function, names)
        except ModelFileError as failure:
            why = f"a model of module `{load.file.module}` cannot be loaded: {failure}"
            return SkillRejected(load.token, sanitize_text(why))
        except SkillRefusedError as refusal:
            return SkillRejected(load.token, sanitize_text(str(refusal)))
        except BaseException as failure:
            return SkillRejected(load.token, sanitize_text(describe_exception(failure)))
        self._load = load
        return SkillLoaded(load.token)

    def _picture_data(self, load: LoadPerceiver, question: ResumePerceiver) -> list[PictureData]:
        return [
            PictureData(
                slot.camera,
                facts.time,
                (slot.width, slot.height),
                self._pictures[slot.rgb : slot.rgb + 3 * slot.width * slot.height],
                None
                if slot.depth is None
                else self._pictures[slot.depth : slot.depth + 4 * slot.width * slot.height],
                facts.eye,
                facts.target,
                facts.up,
                facts.field_of_view,
                facts.full_size,
            )
            for slot, facts in zip(load.slots, question.pictures, strict=True)
            if facts is not None
        ]


def _values_message(token: bytes, yielded: object) -> WorkerResponse:
    try:
        values = {name: PerceivedValue(*parts) for name, parts in plain_values(yielded).items()}
        answer = ValuesPerceived(token, values)
        size = len(encode(answer))
    except NoValuesError as failure:
        return SkillRaised(token, sanitize_text(str(failure)))
    except (TypeError, ValueError, OverflowError, RecursionError) as failure:
        return SkillRaised(
            token, sanitize_text(f"the perceiver yielded values that are not plain data: {failure}")
        )
    if size > MAX_RESPONSE_BYTES:
        return SkillRaised(token, f"the perceiver yielded values of more than {MAX_RESPONSE_BYTES} bytes")
    return answer
