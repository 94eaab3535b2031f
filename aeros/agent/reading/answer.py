"""Strict reader of a model's answer: JSON with requests, prohibitions and an account for each word."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, TypeVar

from aeros.agent.planning.plan_json import MalformedPlanError, parse_strict_json
from aeros.agent.reading.word_claims import WordClaim

MAX_REQUESTS: Final = 10
"""Largest number of requests, and of prohibitions, of one instruction."""

_MAX_CLAIMS: Final = 200
_MAX_TEXT_CHARS: Final = 2000

_Item = TypeVar("_Item")


class MalformedAnswerError(Exception):
    """An answer that does not have the required form; the message says where and why."""


@dataclass(frozen=True, slots=True)
class AnsweredRequest:
    """One request as the model answered it, unchecked.

    Attributes:
        task: the declared task that it is about, as MODULE.TASK.
        arguments: values of the task's parameters as text, by name.
        goal: goal, in the expression language.
        condition: condition on which it is done, in the expression language; None for always.
        plan: JSON values of a plan.
    """

    task: str
    arguments: tuple[tuple[str, str], ...]
    goal: str
    condition: str | None
    plan: Any


@dataclass(frozen=True, slots=True)
class ModelAnswer:
    """Answer of a model to an instruction, unchecked.

    Attributes:
        requests: requests in the order in which they are to be done.
        prohibited: tasks that must not be done, as MODULE.TASK.
        claims: account for the words of the instruction.
    """

    requests: tuple[AnsweredRequest, ...]
    prohibited: tuple[str, ...]
    claims: tuple[WordClaim, ...]


def parse_answer(text: str) -> ModelAnswer:
    """Parse the text of an answer.

    Args:
        text: text of the model, untrusted.

    Returns:
        The answer.

    Raises:
        MalformedAnswerError: it does not have the form that `answer_form` describes.
    """
    try:
        data = parse_strict_json(text)
    except MalformedPlanError as error:
        raise MalformedAnswerError(str(error)) from error
    form = _object(data, {"requests", "prohibited", "words"}, "the answer")
    return ModelAnswer(
        _items(form, "requests", MAX_REQUESTS, _request),
        _items(form, "prohibited", MAX_REQUESTS, _text),
        _items(form, "words", _MAX_CLAIMS, _claim),
    )


def _request(data: Any, place: str) -> AnsweredRequest:
    form = _object(data, {"task", "arguments", "goal", "condition", "plan"}, place)
    arguments = form["arguments"]
    if type(arguments) is not dict or len(arguments) > MAX_REQUESTS:
        raise MalformedAnswerError(f"`{place}.arguments` is not an object of at most {MAX_REQUESTS} values")
    condition = form["condition"]
    return AnsweredRequest(
        _text(form["task"], f"{place}.task"),
        tuple((name, _text(one, f"{place}.arguments.{name[:40]}")) for name, one in arguments.items()),
        _text(form["goal"], f"{place}.goal"),
        None if condition is None else _text(condition, f"{place}.condition"),
        form["plan"],
    )


def _claim(data: Any, place: str) -> WordClaim:
    form = _object(data, {"phrase", "accounts_for"}, place)
    return WordClaim(
        _text(form["phrase"], f"{place}.phrase"), _text(form["accounts_for"], f"{place}.accounts_for")
    )


def _items(form: dict[str, Any], key: str, most: int, read: Callable[[Any, str], _Item]) -> tuple[_Item, ...]:
    data = form[key]
    if type(data) is not list or len(data) > most:
        raise MalformedAnswerError(f"`{key}` is not a list of at most {most}")
    return tuple(read(one, f"{key}[{at}]") for at, one in enumerate(data))


def _object(data: Any, keys: set[str], place: str) -> dict[str, Any]:
    if type(data) is not dict or data.keys() != keys:
        expected = ", ".join(sorted(keys))
        raise MalformedAnswerError(f"{place} is not an object with exactly the keys {expected}")
    return data


def _text(data: Any, place: str) -> str:
    if type(data) is not str or not 0 < len(data) <= _MAX_TEXT_CHARS:
        shown = json.dumps(data)[:40] if isinstance(data, str | int | float | None) else type(data).__name__
        raise MalformedAnswerError(f"`{place}` is not a text of 1 to {_MAX_TEXT_CHARS} characters: {shown}")
    return data
