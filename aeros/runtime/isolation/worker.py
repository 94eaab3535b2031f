"""A worker: locks itself down, runs one skill once, and ends.

Everything here after `lock_down` shares its process with hostile code and is worth nothing as a defence:
that code may speak to the runtime itself.  What holds it is the kernel, and what `frames` believes.
"""

from __future__ import annotations

import sys
from typing import Final, cast

from aeros.descriptions import describe_exception
from aeros.runtime.isolation.layers import Layer, lock_down
from aeros.runtime.isolation.protocol import (
    MOST_ANSWER,
    Answer,
    Asked,
    Close,
    Closed,
    Finished,
    Load,
    Loaded,
    Plain,
    Question,
    Raised,
    Refused,
    answer,
    encode,
    hear_question,
    words,
)
from aeros.runtime.skills.contract import (
    NoActionError,
    SkillFunction,
    SkillRefusedError,
    execute_skill,
    returned,
    snapshot,
)
from aeros.skill import Action, SkillBody

_LAST: Final = (Refused, Finished, Raised, Closed)


def serve(channel: int) -> None:
    """Run the one skill that the runtime, at the other end of `channel`, sends."""
    worker = _Worker(channel)
    while (question := hear_question(channel)) is not None:
        said = worker.answer(question)
        answer(channel, encode(said))
        if isinstance(said, _LAST):
            return


class _Worker:
    def __init__(self, channel: int) -> None:
        self._channel = channel
        self._load: Load | None = None
        self._function: SkillFunction | None = None
        self._body: SkillBody | None = None

    def answer(self, question: Question) -> Answer:
        if isinstance(question, Load):
            return self._loaded(question)
        if isinstance(question, Close):
            return self._closed(question.token)
        if self._load is None or self._function is None:
            return Raised(question.token, "no skill is loaded")
        try:
            if self._body is None:
                self._body = self._function(question.observed, self._load.inputs)
                yielded = next(self._body)
            else:
                yielded = self._body.send(question.observed)
            asked = snapshot(yielded)
        except StopIteration as end:
            return _finished(question.token, end.value)
        except NoActionError as failure:
            return Raised(question.token, words(str(failure)))
        except BaseException as failure:
            return Raised(question.token, words(describe_exception(failure)))
        return _asked(question.token, asked)

    def _loaded(self, load: Load) -> Answer:
        try:
            lock_down([Layer(name) for name in load.layers], self._channel)
        except OSError as failure:
            return Refused(load.token, words(f"a layer of isolation cannot be put on: {failure}"))
        # Nothing can be opened any more; without these, an import says so in the usual words.
        sys.path.clear()
        sys.path_importer_cache.clear()
        self._load = load
        try:
            self._function = execute_skill(load.module, load.name, load.source, load.path, load.function)
        except SkillRefusedError as refusal:
            return Refused(load.token, words(str(refusal)))
        except BaseException as failure:
            return Refused(load.token, words(describe_exception(failure)))
        return Loaded(load.token)

    def _closed(self, token: bytes) -> Closed:
        try:
            if self._body is not None:
                self._body.close()
        except BaseException as failure:
            return Closed(token, words(describe_exception(failure)))
        return Closed(token, None)


def _finished(token: bytes, value: object) -> Answer:
    try:
        finished = Finished(token, cast("dict[str, Plain | list[Plain]] | None", returned(value)))
        size = len(encode(finished))
    except NoActionError as failure:
        return Raised(token, words(str(failure)))
    except (TypeError, ValueError, OverflowError, RecursionError) as failure:
        return Raised(token, words(f"the skill returns outputs that are no plain data: {failure}"))
    if size > MOST_ANSWER:
        return Raised(token, f"the skill returns outputs of more than {MOST_ANSWER} bytes")
    return finished


def _asked(token: bytes, action: Action) -> Answer:
    # msgspec takes exact built-in types, so no code of the values' runs here.
    try:
        asked = Asked(token, action.kind, dict(action.parameters))
        size = len(encode(asked))
    except (TypeError, ValueError, OverflowError, RecursionError) as failure:
        return Raised(token, words(f"the skill asks for an action that is no plain data: {failure}"))
    if size > MOST_ANSWER:
        return Raised(token, f"the skill asks for an action of more than {MOST_ANSWER} bytes")
    return asked
