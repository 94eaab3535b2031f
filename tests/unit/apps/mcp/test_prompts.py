"""Prompts: texts for what they are given, and refusals."""

from __future__ import annotations

import pytest

from aeros.apps.mcp.prompts import PROMPTS, PromptError, prompt_text


@pytest.mark.parametrize("name", PROMPTS)
def test_a_prompt_holds_what_it_is_given(name: str) -> None:
    given = {argument: f"a given {argument}" for argument in PROMPTS[name].arguments}
    text = prompt_text(name, given)
    assert all(one in text for one in given.values())


@pytest.mark.parametrize(
    ("name", "arguments", "why"),
    [
        ("nothing", {}, "there is no prompt `nothing`; there are carry_out"),
        ("carry_out", {}, "`carry_out` takes exactly these arguments: task"),
        ("carry_out", {"task": "x", "more": "y"}, "takes exactly these arguments: task"),
        ("explain_latest", {"task": "x"}, "takes exactly these arguments: none"),
        ("carry_out", {"task": "x" * 1001}, "longer than 1000 characters"),
    ],
)
def test_an_unknown_prompt_or_argument_is_refused(name: str, arguments: dict[str, str], why: str) -> None:
    with pytest.raises(PromptError, match=why):
        prompt_text(name, arguments)
