"""The client of a language model: addresses, deadlines, and answers that cannot be used."""

from __future__ import annotations

from time import monotonic

import pytest

from aeros.agent.errors import AgentError
from tests.unit.agent.stub_llm import Reply, Stub, says, sends, stalls, stub, trickles

pytest.importorskip("httpx", reason="needs `pip install '.[llm]'`")

from aeros.agent.planning.llm_client import (
    MAX_RESPONSE_BYTES,
    LlmEndpoint,
    LlmError,
    request_completion,
)

KEY = "sk-secret"


@pytest.mark.parametrize(
    ("url", "key", "message"),
    [
        ("http://models.example/v1", KEY, "would go to `models.example` in the clear"),
        ("ftp://models.example/v1", None, "is not of the form"),
        ("models.example", None, "is not of the form"),
        ("https://user:word@models.example/v1", None, "is not of the form"),
        ("https://models.example:port/v1", None, "is not of the form"),
        ("https://models.example/v1", f"{KEY}\n", "contains an impossible character"),
        ("https://models.example/v1", "", "contains an impossible character"),
    ],
)
def test_where_no_key_should_go_none_goes(url: str, key: str | None, message: str) -> None:
    with pytest.raises(AgentError) as refusal:
        LlmEndpoint(url, "stub", key)
    assert message in str(refusal.value)
    assert KEY not in str(refusal.value)
    assert KEY not in repr(LlmEndpoint("https://models.example/v1", "stub", KEY))


def endpoint(server: Stub, key: str | None = None) -> LlmEndpoint:
    return LlmEndpoint(f"{server.url}/", "stub", key)


def ask(server: Stub, key: str | None = None, within: float = 5.0) -> str:
    return request_completion(
        endpoint(server, key), [{"role": "user", "content": "hi"}], {}, monotonic() + within
    )


def refusal(reply: Reply, within: float = 5.0) -> tuple[str, bool]:
    with stub(reply) as server, pytest.raises(LlmError) as refused:
        ask(server, within=within)
    return str(refused.value), refused.value.may_pass


@pytest.mark.parametrize("url", ["http://localhost:1/v1", "http://127.0.0.1/v1", "http://[::1]:80/v1"])
def test_to_this_machine_a_key_goes_in_the_clear(url: str) -> None:
    assert LlmEndpoint(url, "stub", KEY).api_key == KEY


@pytest.mark.parametrize("key", ["sk secret", "sk-sécret", "sk\x7f"])
def test_a_key_that_no_header_may_hold_is_refused(key: str) -> None:
    with pytest.raises(AgentError, match="contains an impossible character"):
        LlmEndpoint("https://models.example/v1", "stub", key)


def test_a_query_in_the_url_is_refused() -> None:
    with pytest.raises(AgentError, match="is not of the form"):
        LlmEndpoint("https://models.example/v1?key=1", "stub")


def test_the_text_of_the_answer_is_returned_and_the_request_holds_what_was_given() -> None:
    with stub(says("hello")) as server:
        assert ask(server, within=0.9) == "hello"
    (asked,), (headers,) = server.asked, server.headers
    assert asked["path"] == "/v1/chat/completions"  # one slash, though the URL ends with one
    assert (asked["model"], asked["messages"]) == ("stub", [{"role": "user", "content": "hi"}])
    assert asked["response_format"]["json_schema"] == {"name": "plan", "strict": True, "schema": {}}
    assert headers["accept-encoding"] == "identity"
    assert "authorization" not in headers


def test_a_key_is_sent_in_one_header_and_cut_out_of_the_answer() -> None:
    with stub(says(f"your key is {KEY}")) as server:
        assert ask(server, KEY) == "your key is ***"
    assert server.headers[0]["authorization"] == f"Bearer {KEY}"


@pytest.mark.parametrize(
    ("status", "passes"), [(500, True), (429, True), (529, True), (401, False), (201, False)]
)
def test_of_an_error_only_the_status_is_reported(status: int, *, passes: bool) -> None:
    assert refusal(sends(status, b"secret")) == (f"its server answers with status {status}", passes)


@pytest.mark.parametrize(
    ("reply", "message", "passes"),
    [
        (
            sends(200, b"{}", content_encoding="gzip"),
            "its answer is compressed, although the request accepts no compression",
            False,
        ),
        (sends(200, b"{}"), "its answer is not a chat completion", True),
        (sends(200, b'{"choices": "no"}'), "its answer is not a chat completion", True),
        (says("half", "length"), "its answer is cut off", True),
        (sends(200, b'{"choices": [{"message": {"content": 7}}]}'), "it declines to answer", True),
        (sends(200, b" " * (MAX_RESPONSE_BYTES + 1)), "its answer is longer than 1048576 bytes", False),
    ],
)
def test_an_answer_that_cannot_be_used_is_an_error(reply: Reply, message: str, *, passes: bool) -> None:
    assert refusal(reply) == (message, passes)


def test_an_answer_of_the_greatest_length_is_read() -> None:
    body = b'{"choices": [{"message": {"content": "ok"}}]}'
    with stub(sends(200, body + b" " * (MAX_RESPONSE_BYTES - len(body)))) as server:
        assert ask(server) == "ok"


@pytest.mark.parametrize("reply", [stalls, trickles])
def test_the_deadline_is_of_the_whole_answer(reply: Reply) -> None:
    began = monotonic()
    assert refusal(reply, within=0.2) == ("it has not answered in time", False)
    assert monotonic() - began < 2.0


def test_after_the_deadline_nothing_is_asked() -> None:
    with stub(says("late")) as server, pytest.raises(LlmError, match="it has not answered in time"):
        ask(server, within=0.0)
    assert server.asked == []


def test_a_server_that_is_not_there_may_be_there_later() -> None:
    with stub(stalls) as server:
        pass
    with pytest.raises(LlmError, match="could not be reached, or the connection broke") as refused:
        ask(server)
    assert refused.value.may_pass
