"""Tokens that are sent, and the sizes of answers that are parsed."""

from __future__ import annotations

import pytest

from aeros.runtime.tools.exchange import MAX_ANSWER, ToolError, bearer_header, parse_answer


def test_a_token_that_is_not_set_is_missed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("COOKBOOK_TOKEN", raising=False)
    assert bearer_header(None) == {}
    monkeypatch.setenv("OVEN_TOKEN", "secret")
    assert bearer_header("OVEN_TOKEN") == {"Authorization": "Bearer secret"}
    with pytest.raises(ToolError, match="COOKBOOK_TOKEN"):
        bearer_header("COOKBOOK_TOKEN")


def test_an_answer_may_be_as_large_as_the_limit() -> None:
    content = b'"' + b"x" * (MAX_ANSWER - 2) + b'"'
    assert len(parse_answer(content)) == MAX_ANSWER - 2
    with pytest.raises(ToolError, match="more than"):
        parse_answer(content + b" ")
