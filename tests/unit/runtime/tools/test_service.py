"""Calls of services by HTTP and of programs: bounded, and with a reason for whatever goes wrong."""

from __future__ import annotations

import os
import time
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.tools.exchange import MAX_ANSWER, ToolError
from aeros.runtime.tools.service import call_http, call_program, open_service
from aeros.spec.model.policy import IsolationPolicy
from aeros.spec.model.tools import HttpService, McpService, Program, Tool
from tests.unit.runtime.tools.services import PYTHON, Answer, cookbook, mcp_server, ok, python, slow

ECHO = 'print(json.dumps({"asked": json.load(sys.stdin)}))'
POLICY = IsolationPolicy(refuses_missing=False)
QUESTION = {"mass": 0.05, "filling": "pork", "place": (0.1, 0.2, 0.3)}


def test_a_service_gets_the_parameters_and_its_answer_is_parsed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COOKBOOK_TOKEN", "secret")
    monkeypatch.setenv("http_proxy", "http://127.0.0.1:1")
    with cookbook(ok(b'{"cooking_time": 3}')) as server:
        assert call_http(HttpService(server.url, "COOKBOOK_TOKEN"), QUESTION, 5.0) == {"cooking_time": 3}
    asked = {**QUESTION, "place": [0.1, 0.2, 0.3]}
    assert server.asked == [("/time?unit=s", asked, "Bearer secret")]


@pytest.mark.parametrize(
    ("answer", "reason"),
    [
        (lambda _: (500, b"{}"), "status 500"),
        (lambda _: (302, b"{}"), "status 302"),
        (ok(b"not json"), "is not JSON"),
        (ok(b'{"cooking_time": NaN}'), "NaN is no number"),
        (ok(b'{"cooking_time": Infinity}'), "Infinity is no number"),
        (ok(b'{"a": 1, "a": 2}'), "a name stands twice"),
        (ok(b"[" * 30_000), "is not JSON"),
        (ok(b"\xff"), "is not JSON"),
        (ok(b'"' + b"x" * MAX_ANSWER + b'"'), f"more than {MAX_ANSWER} bytes"),
        (slow(2.0), r"it did not answer within 0\.3 s$"),
    ],
)
def test_an_answer_that_cannot_be_used_has_a_reason(answer: Answer, reason: str) -> None:
    with cookbook(answer) as server, pytest.raises(ToolError, match=reason):
        call_http(HttpService(server.url), {}, 0.3)
    assert len(server.asked) == 1  # a redirect is not followed


def test_a_service_that_is_not_there_has_a_reason() -> None:
    with cookbook(ok(b"{}")) as server:
        url = server.url
    with pytest.raises(ToolError, match="cannot be reached: ConnectionRefusedError"):
        call_http(HttpService(url), {}, 0.3)
    with pytest.raises(ToolError, match="cannot be reached"):
        call_http(HttpService(url.replace("http:", "https:")), {}, 0.3)


def test_a_program_gets_the_parameters_and_nothing_of_the_environment(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("SECRET", "1")
    asked = call_program(Program(python(ECHO), PYTHON), POLICY, QUESTION, 10.0)
    assert asked == {"asked": {**QUESTION, "place": [0.1, 0.2, 0.3]}}
    found = call_program(
        Program(python("print(json.dumps([dict(os.environ), os.getcwd()]))"), PYTHON), POLICY, {}, 10.0
    )
    environment, folder = found
    assert environment.pop("HOME") == environment.pop("TMPDIR")
    environment.pop("LC_CTYPE", None)  # Python's own
    assert environment == {"PATH": os.defpath, "LANG": "C.UTF-8"}
    assert folder == "/"


def test_a_program_need_not_read_its_input() -> None:
    program = Program(python("os.close(0); time.sleep(0.2); print('{}')"), PYTHON)
    assert call_program(program, POLICY, {"a": 1}, 10.0) == {}


@pytest.mark.parametrize(
    ("command", "reason"),
    [
        (("/no/such/program",), "cannot be started: No such file"),
        (python("sys.exit(3)"), "ended with code 3$"),
        (
            python("sys.exit('no\\x1b[1m book')"),
            "ended with code 1; its last line of errors: no\ufffd.1m book$",
        ),
        (python("print('{}'); sys.exit(1)"), "ended with code 1"),
        (python("time.sleep(60)"), r"it did not answer within 1\.5 s$"),
        (python("print('{}', flush=True); time.sleep(60)"), "did not answer"),
        (python("print('{')"), "is not JSON"),
        (python("while True: print('x' * 1000)"), f"more than {MAX_ANSWER} bytes"),
        (python("os.kill(os.getpid(), 9)"), "ended with code 137"),
    ],
)
def test_a_program_that_gives_no_answer_has_a_reason(command: tuple[str, ...], reason: str) -> None:
    began = time.monotonic()
    with pytest.raises(ToolError, match=reason):
        call_program(Program(command, PYTHON), POLICY, {}, 1.5)
    assert time.monotonic() - began < 10.0


def test_every_kind_of_service_is_opened(tmp_path: Path) -> None:
    with cookbook(ok(b"{}")) as server:
        services: list[HttpService | Program | McpService] = [
            HttpService(server.url),
            Program(python("print('{}')"), PYTHON),
            McpService("ask", mcp_server(tmp_path), confinement=PYTHON),
        ]
        answers: list[Any] = [
            open_service(Tool(service, Fraction(10), ()), POLICY)({"mass": 0.05}, 10.0)
            for service in services
        ]
    assert answers == [{}, {}, {"cooking_time": 3.0}]
