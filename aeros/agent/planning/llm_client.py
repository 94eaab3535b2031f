"""Asks a language model behind an OpenAI-compatible endpoint, and takes but a bounded text from there.

The sole importer of httpx, which is there with `pip install 'aeros[llm]'`.

Whoever answers may be slow, broken or hostile: every answer has a time by which all of it must be there and
a greatest length, compressed answers and redirects are refused, and of what a server says of its errors only
the status is told.  The key goes into one header, to nowhere in the clear but this machine, and is cut out
of all that comes back.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final
from urllib.parse import urlsplit

import httpx

from aeros.agent.errors import AgentError
from aeros.agent.planning.plan_json import MalformedPlanError, parse_strict_json

MAX_RESPONSE_BYTES: Final = 1 << 20
"""The longest answer, bytes."""

_TRANSIENT_STATUS_CODES: Final = frozenset({408, 409, 425, 429, 500, 502, 503, 504, 529})
_LOOPBACK_HOSTS: Final = frozenset({"localhost", "127.0.0.1", "::1"})

Messages = Sequence[Mapping[str, str]]
"""Who says what, in order: `role` and `content`."""


class LlmError(Exception):
    """There is no answer; the message says why.

    may_pass: asking again may help.
    """

    def __init__(self, reason: str, *, is_transient: bool = False) -> None:
        super().__init__(reason)
        self.may_pass = is_transient


@dataclass(frozen=True)
class LlmEndpoint:
    """Where a model is asked.

    url: of the API, up to and with its version, as in `https://host/v1`.
    key: None where none is needed.
    """

    url: str
    model: str
    api_key: str | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        try:
            parts = urlsplit(self.url)
            host, _ = parts.hostname, parts.port
        except ValueError:
            host = None
        if not host or parts.scheme not in ("http", "https") or parts.username or parts.query:
            raise AgentError("the language model's URL is not of the form `https://HOST/v1`")
        if self.api_key is None:
            return
        if (
            not self.api_key.isascii()
            or not self.api_key.isprintable()
            or " " in self.api_key
            or not self.api_key
        ):
            raise AgentError("the language model's key holds what no key does, such as a space or a newline")
        if parts.scheme == "http" and host not in _LOOPBACK_HOSTS:
            raise AgentError(
                f"the language model's key would go to `{host}` in the clear: its URL is not https://"
            )


def request_completion(
    endpoint: LlmEndpoint, messages: Messages, schema: Mapping[str, Any], by: float
) -> str:
    """What the model says, which should be JSON of this schema.  Raises `LlmError`.

    by: when all of it must be there, on the clock of `time.monotonic`.
    """
    form = {"name": "plan", "strict": True, "schema": schema}
    asked = {
        "model": endpoint.model,
        "messages": list(messages),
        "response_format": {"type": "json_schema", "json_schema": form},
    }
    headers = {"Accept-Encoding": "identity"}
    if endpoint.api_key is not None:
        headers["Authorization"] = f"Bearer {endpoint.api_key}"
    said = _post(f"{endpoint.url.rstrip('/')}/chat/completions", asked, headers, by)
    text = _completion_text(said)
    return text if endpoint.api_key is None else text.replace(endpoint.api_key, "***")


def _post(url: str, asked: Mapping[str, Any], headers: Mapping[str, str], by: float) -> bytes:
    left = by - time.monotonic()
    if left <= 0:
        raise LlmError("it has not answered in time")
    body = bytearray()
    try:
        with (
            httpx.Client(timeout=left) as client,
            client.stream("POST", url, json=asked, headers=headers) as answer,
        ):
            if answer.status_code != httpx.codes.OK:
                status = answer.status_code
                raise LlmError(
                    f"its server answers with status {status}", is_transient=status in _TRANSIENT_STATUS_CODES
                )
            if answer.headers.get("content-encoding", "identity") != "identity":
                raise LlmError("its answer is compressed, which was not asked for")
            for chunk in answer.iter_raw():
                body += chunk
                if len(body) > MAX_RESPONSE_BYTES:
                    raise LlmError(f"its answer is longer than {MAX_RESPONSE_BYTES} bytes")
                if time.monotonic() > by:
                    raise LlmError("it has not answered in time")
    except httpx.TimeoutException as error:
        raise LlmError("it has not answered in time") from error
    except httpx.HTTPError as error:
        raise LlmError(
            f"it is not reached, or broke off ({type(error).__name__})", is_transient=True
        ) from error
    return bytes(body)


def _completion_text(body: bytes) -> str:
    """The text of a whole answer."""
    try:
        choice = parse_strict_json(body)["choices"][0]
        reason, text = choice.get("finish_reason"), choice["message"]["content"]
    except (MalformedPlanError, LookupError, TypeError, AttributeError) as error:
        raise LlmError("its answer is no chat completion", is_transient=True) from error
    if reason == "length":
        raise LlmError("its answer is cut off", is_transient=True)
    if type(text) is not str:
        raise LlmError("it declines to answer", is_transient=True)
    return text
