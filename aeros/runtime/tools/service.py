"""Calls of services: bounded in size and time, and whatever goes wrong has a reason in words."""

from __future__ import annotations

import http.client
import json
import os
import selectors
import signal
import ssl
import subprocess
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Any, Final
from urllib.parse import urlsplit

from aeros.descriptions import describe_exception
from aeros.runtime.tools.confinement import confine
from aeros.runtime.tools.exchange import MAX_ANSWER, ToolError, bearer_header, late_reason, parse_answer
from aeros.spec.model.policy import IsolationPolicy
from aeros.spec.model.tools import HttpService, McpService, Program, Tool

_HEADERS: Final = {"Content-Type": "application/json", "Accept": "application/json"}
_CHUNK: Final = 16 * 1024

_END_S: Final = 2.0
"""Time in which a launcher ends with all that it started, s; it takes some milliseconds."""

ServiceCall = Callable[[Mapping[str, Any], float], Any]
"""Calls a service with parameters (SI) and a time limit (s); returns the parsed JSON of its answer."""


def open_service(tool: Tool, policy: IsolationPolicy) -> ServiceCall:
    """Return the function that calls the service of a tool.

    Args:
        tool: the tool.
        policy: says which layers must confine a program that is started.

    Returns:
        The function, which raises `ToolError`. It takes about as long as its limit at most.
    """
    service = tool.service
    match service:
        case HttpService():
            return lambda parameters, seconds: call_http(service, parameters, seconds)
        case Program():
            return lambda parameters, seconds: call_program(service, policy, parameters, seconds)
        case McpService():
            # Needs the SDK, which no other tool does.
            from aeros.runtime.tools.mcp_service import call_mcp

            return lambda parameters, seconds: call_mcp(service, policy, parameters, seconds)


def call_http(service: HttpService, parameters: Mapping[str, Any], seconds: float) -> Any:
    """Call a service with POST. Redirects are not followed, and no proxy of the environment is used.

    Args:
        service: the service.
        parameters: parameters of the action, SI.
        seconds: time limit of each exchange, s.

    Returns:
        The parsed answer.

    Raises:
        ToolError: it cannot be reached, or its answer is not JSON with status 200.
    """
    parts = urlsplit(service.url)
    host = parts.hostname or ""
    connection: http.client.HTTPConnection
    if parts.scheme == "https":
        context = ssl.create_default_context()
        connection = http.client.HTTPSConnection(host, parts.port, timeout=seconds, context=context)
    else:
        connection = http.client.HTTPConnection(host, parts.port, timeout=seconds)
    path = (parts.path or "/") + (f"?{parts.query}" if parts.query else "")
    try:
        body = json.dumps(parameters, allow_nan=False).encode()
        connection.request("POST", path, body, {**_HEADERS, **bearer_header(service.token)})
        response = connection.getresponse()
        content = response.read(MAX_ANSWER + 1)
    except TimeoutError as failure:
        raise ToolError(late_reason(seconds)) from failure
    except (OSError, http.client.HTTPException, ValueError) as failure:
        raise ToolError(f"it cannot be reached: {describe_exception(failure)}") from failure
    finally:
        connection.close()
    if response.status != http.client.OK:
        raise ToolError(f"it answered with status {response.status}")
    return parse_answer(content)


def call_program(
    service: Program, policy: IsolationPolicy, parameters: Mapping[str, Any], seconds: float
) -> Any:
    """Run a program confined, without a shell and with an environment of its own.

    Args:
        service: the program.
        policy: says which layers must confine it.
        parameters: parameters of the action, SI; a JSON object on its standard input.
        seconds: time after which it is killed with all that it started, s.

    Returns:
        The parsed JSON of its standard output.

    Raises:
        ToolError: it cannot be started or confined, takes too long, starts too many processes, ends with a
            code other than 0, or prints no JSON.
    """
    deadline = time.monotonic() + seconds
    with confine(service.command, service.confinement, policy, seconds) as confined:
        try:
            return _run(confined.arguments, parameters, deadline)
        except subprocess.TimeoutExpired as failure:
            raise ToolError(confined.describe(late_reason(seconds))) from failure
        except ToolError as failure:
            raise ToolError(confined.describe(str(failure))) from failure


def _run(command: Sequence[str], parameters: Mapping[str, Any], deadline: float) -> Any:
    """Start a command, and return its parsed answer.

    Raises:
        TimeoutExpired: the time is over.
        ToolError: there is none for another reason.
    """
    try:
        process = subprocess.Popen(  # noqa: S603 - the launcher; the site's operator names the program
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env={},
            cwd="/",
            start_new_session=True,
        )
    except OSError as failure:
        raise ToolError(f"it cannot be started: {failure.strerror}") from failure
    try:
        content = _exchange(process, json.dumps(parameters, allow_nan=False).encode(), deadline)
        if len(content) > MAX_ANSWER:
            return parse_answer(content)  # which refuses it
        code = process.wait(max(0.0, deadline - time.monotonic()))
    except (OSError, ValueError) as failure:
        raise ToolError(f"it did not answer: {describe_exception(failure)}") from failure
    finally:
        _end(process)
        for pipe in (process.stdin, process.stdout):
            if pipe is not None:
                with suppress(OSError):
                    pipe.close()
    if code != 0:
        raise ToolError(f"it ended with code {code}")
    return parse_answer(content)


def _end(process: subprocess.Popen[bytes]) -> None:
    """Let the launcher kill what it started, and end it."""
    try:
        process.terminate()
        process.wait(_END_S)
    except subprocess.TimeoutExpired:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def _exchange(process: subprocess.Popen[bytes], question: bytes, deadline: float) -> bytes:
    """Write the question, and read to the end or one byte beyond the greatest size.

    Raises:
        TimeoutExpired: the time is over.
    """
    assert process.stdin is not None and process.stdout is not None  # noqa: S101, PT018 - they are pipes
    with suppress(BrokenPipeError):  # it need not read its input
        process.stdin.write(question)
        process.stdin.close()
    content = b""
    with selectors.DefaultSelector() as selector:
        selector.register(process.stdout, selectors.EVENT_READ)
        while len(content) <= MAX_ANSWER:
            left = deadline - time.monotonic()
            if left <= 0 or not selector.select(left):
                raise subprocess.TimeoutExpired(process.args, 0)
            chunk = os.read(process.stdout.fileno(), min(_CHUNK, MAX_ANSWER + 1 - len(content)))
            if not chunk:
                return content
            content += chunk
    return content
