"""Hostile arguments of a client are refused, with the reason, before any use."""

from __future__ import annotations

from typing import Any

import pytest

from aeros.apps.mcp.tool_arguments import (
    ProposedStep,
    ToolCallError,
    check_call,
    read_seconds,
    read_steps,
    read_text,
)


def nested(depth: int) -> Any:
    return [] if depth == 0 else [nested(depth - 1)]


@pytest.mark.parametrize(
    ("tool", "arguments", "why"),
    [
        ("exec_plan", {}, "there is no tool `exec_plan`; did you mean `execute_plan`?"),
        ("a\x1b[2J" * 50, {}, r"there is no tool `a\\x1b"),
        ("state", {"all": True}, "there is no argument `all`"),
        ("propose_plan", {}, "the argument `steps` is missing"),
        ("propose_plan", {"steps": [{"skill": "a.b", "inputs": {"x": float("nan")}}]}, "not finite"),
        ("propose_plan", {"steps": [{"skill": "a.b", "inputs": {"x": float("-inf")}}]}, "not finite"),
        ("propose_plan", {"steps": [{"skill": "a.b", "inputs": {"x": 2**60}}]}, "larger than 2"),
        ("propose_plan", {"steps": nested(20)}, "nested more than 8 deep"),
        ("propose_plan", {"steps": [], "goal": "x" * 1001}, "longer than 1000 characters"),
        ("propose_plan", {"steps": [{"x" * 1001: 1}]}, "longer than 1000 characters"),
        ("propose_plan", {"steps": [{"skill": "x" * 900}] * 80}, "larger than 65536 bytes"),
        ("propose_plan", {"steps": {1, 2}}, "set is not a JSON value"),
    ],
)
def test_a_call_is_refused(tool: str, arguments: dict[str, Any], why: str) -> None:
    with pytest.raises(ToolCallError, match=why):
        check_call(tool, arguments)


@pytest.mark.parametrize(
    ("steps", "why"),
    [
        ("a.b", "`steps` is a list"),
        ([], "`steps` is a list"),
        ([{"skill": "a.b"}] * 4, "the plan has 4 steps; this site allows 3"),
        (["a.b"], "step 1 is not an object"),
        ([{"skill": "a.b"}, {}], "step 2: the field `skill` is missing"),
        ([{"skill": "a.b", "retry": 3}], "step 1: there is no field `retry`"),
        ([{"skill": ["a.b"]}], "step 1: `skill` must be a string"),
        ([{"skill": "a.b", "inputs": [1]}], "`inputs` an object"),
    ],
)
def test_steps_are_refused(steps: Any, why: str) -> None:
    with pytest.raises(ToolCallError, match=why):
        read_steps({"steps": steps}, 3)


def test_steps_are_taken() -> None:
    steps = [{"skill": "a.b"}, {"skill": "c.d", "inputs": {"at": "pot"}}]
    assert read_steps({"steps": steps}, 3) == (ProposedStep("a.b", {}), ProposedStep("c.d", {"at": "pot"}))


@pytest.mark.parametrize("seconds", ["1", True, -1, 301, None, [1]])
def test_seconds_that_are_none_are_refused(seconds: Any) -> None:
    with pytest.raises(ToolCallError, match="from 0 to 300"):
        read_seconds({"wait": seconds}, "wait")


def test_texts_and_seconds_are_taken() -> None:
    assert read_seconds({"wait": 2}, "wait") == 2.0
    assert read_seconds({}, "wait") == 0.0
    assert read_text({"goal": "x"}, "goal") == "x"
    assert read_text({}, "goal") is None
    with pytest.raises(ToolCallError, match="`goal` must be a string"):
        read_text({"goal": 3}, "goal")
