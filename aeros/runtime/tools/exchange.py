"""Parts of every call of a service: the token that it sends, and the JSON that it gets back."""

from __future__ import annotations

import json
import os
from typing import Any, Final

from aeros.descriptions import describe_exception

MAX_ANSWER: Final = 64 * 1024
"""Greatest size of an answer, bytes."""


class ToolError(Exception):
    """A call gave no answer that can be used; the message says why."""


def late_reason(seconds: float) -> str:
    """Describe that a call took too long.

    Args:
        seconds: its time limit, s.

    Returns:
        The reason, as in "it did not answer within 2 s".
    """
    return f"it did not answer within {seconds:g} s"


def bearer_header(variable: str | None) -> dict[str, str]:
    """Make the header with the token that an environment variable holds.

    Args:
        variable: name of the variable; None for no token.

    Returns:
        The header; empty without a token.

    Raises:
        ToolError: the variable is not set.
    """
    if variable is None:
        return {}
    token = os.environ.get(variable, "")
    if not token:
        raise ToolError(f"the environment variable `{variable}` holds no token")
    return {"Authorization": f"Bearer {token}"}


def parse_answer(content: bytes) -> Any:
    """Parse the JSON of an answer.

    Args:
        content: its bytes, one more than `MAX_ANSWER` at most.

    Returns:
        The data; numbers that are not finite are refused, and so is a name that stands twice.

    Raises:
        ToolError: it is too large, or no JSON.
    """
    if len(content) > MAX_ANSWER:
        raise ToolError(f"its answer has more than {MAX_ANSWER} bytes")
    try:
        return json.loads(content, parse_constant=_refuse_constant, object_pairs_hook=_once_each)
    except (ValueError, RecursionError) as failure:
        raise ToolError(f"its answer is not JSON: {describe_exception(failure)}") from failure


def _refuse_constant(text: str) -> Any:
    raise ValueError(f"{text} is no number")


def _once_each(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        raise ValueError("a name stands twice")
    return found
