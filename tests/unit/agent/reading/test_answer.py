"""Form of a model's answer: exactly the declared keys and types."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.agent.reading.answer import MAX_REQUESTS, MalformedAnswerError, parse_answer
from aeros.agent.reading.word_claims import WordClaim
from tests.hypothesis_profiles import examples

REQUEST: dict[str, Any] = {"task": "m.t", "arguments": {}, "goal": "done", "condition": None, "plan": []}
ANSWER: dict[str, Any] = {
    "requests": [REQUEST],
    "prohibited": ["m.u"],
    "words": [{"phrase": "do", "accounts_for": "request 1"}],
}


def test_an_answer_is_read_as_it_is() -> None:
    answer = parse_answer(json.dumps(ANSWER))
    assert [(one.task, one.goal, one.condition, one.plan) for one in answer.requests] == [
        ("m.t", "done", None, [])
    ]
    assert answer.prohibited == ("m.u",)
    assert answer.claims == (WordClaim("do", "request 1"),)


@pytest.mark.parametrize(
    "change",
    [
        {"requests": {}},
        {"requests": [REQUEST] * (MAX_REQUESTS + 1)},
        {"requests": [{**REQUEST, "goal": 1}]},
        {"requests": [{**REQUEST, "goal": ""}]},
        {"requests": [{**REQUEST, "condition": False}]},
        {"requests": [{**REQUEST, "confirmed": True}]},
        {"requests": [{**REQUEST, "goal": "x" * 2001}]},
        {"prohibited": [None]},
        {"words": [["do", "request 1"]]},
        {"words": [{"phrase": "do"}]},
        {"more": []},
    ],
)
def test_any_other_form_is_refused(change: dict[str, Any]) -> None:
    with pytest.raises(MalformedAnswerError):
        parse_answer(json.dumps({**ANSWER, **change}))


_JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from([*ANSWER, *REQUEST]), inner),
    max_leaves=12,
)


@examples(100)
@given(_JSON)
def test_any_json_is_an_answer_or_is_refused(data: Any) -> None:
    try:
        answer = parse_answer(json.dumps(data))
    except MalformedAnswerError:
        return
    assert set(data) == set(ANSWER)
    assert len(answer.requests) == len(data["requests"])
