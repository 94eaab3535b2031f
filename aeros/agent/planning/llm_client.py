"""Client of a language model behind an OpenAI-compatible endpoint, with bounded time and answer length.

This is the only module that imports httpx, which the extra `llm` installs.

The server may be slow, broken or hostile. Every answer has a deadline and a maximum length. Compressed
answers and redirects are refused. Of a server's errors only the status is reported. The key is sent in one
header, without encryption only to this machine, and is removed from everything that comes back.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from ssl import SSLContext
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
"""Messages of a conversation, in order: `role` and `content`."""


class LlmError(Exception):
    """A request without an answer; the message says why. If `may_pass` is true, asking again may help."""

    def __init__(self, reason: str, *, is_transient: bool = False) -> None:
        super().__init__(reason)
        self.may_pass = is_transient


@dataclass(frozen=True)
class LlmEndpoint:
    """Address of a language model.

    Attributes:
        url: URL of the API, up to and with its version, as in `https://host/v1`.
        model: name of the model.
        api_key: key; None if none is needed.
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
            raise AgentError(
                "the language model's key contains an impossible character, such as a space or a newline"
            )
        if parts.scheme == "http" and host not in _LOOPBACK_HOSTS:
            raise AgentError(
                f"the language model's key would go to `{host}` in the clear: its URL is not https://"
            )


def request_completion(
    endpoint: LlmEndpoint, messages: Messages, schema: Mapping[str, Any], by: float
) -> str:
    """Ask the model for a chat completion.

    Args:
        endpoint: address of the model.
        messages: conversation so far.
        schema: JSON Schema that the answer should have.
        by: deadline for the whole answer (s), on the clock of `time.monotonic`.

    Returns:
        The text of the answer, unverified.

    Raises:
        LlmError: there is no complete answer in time.
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
    response = _post(f"{endpoint.url.rstrip('/')}/chat/completions", asked, headers, by)
    text = _completion_text(response)
    return text if endpoint.api_key is None else text.replace(endpoint.api_key, "***")


def _post(url: str, asked: Mapping[str, Any], headers: Mapping[str, str], by: float) -> bytes:
    left = by - time.monotonic()
    if left <= 0:
        raise LlmError("it has not answered in time")
    body = bytearray()
    try:
        with (
            httpx.Client(timeout=left, verify=_certificates()) as client,
            client.stream("POST", url, json=asked, headers=headers) as answer,
        ):
            if answer.status_code != httpx.codes.OK:
                status = answer.status_code
                raise LlmError(
                    f"its server answers with status {status}", is_transient=status in _TRANSIENT_STATUS_CODES
                )
            if answer.headers.get("content-encoding", "identity") != "identity":
                raise LlmError("its answer is compressed, although the request accepts no compression")
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
            f"it could not be reached, or the connection broke ({type(error).__name__})", is_transient=True
        ) from error
    return bytes(body)


@cache
def _certificates() -> SSLContext:
    """Return the certificates that servers are checked against; to load them takes longer than a request."""
    return httpx.create_ssl_context()


def _completion_text(body: bytes) -> str:
    """Extract the text of a complete answer.

    Raises:
        LlmError: the answer is cut off, refused or not a chat completion.
    """
    try:
        choice = parse_strict_json(body)["choices"][0]
        reason, text = choice.get("finish_reason"), choice["message"]["content"]
    except (MalformedPlanError, LookupError, TypeError, AttributeError) as error:
        raise LlmError("its answer is not a chat completion", is_transient=True) from error
    if reason == "length":
        raise LlmError("its answer is cut off", is_transient=True)
    if type(text) is not str:
        raise LlmError("it declines to answer", is_transient=True)
    return text
