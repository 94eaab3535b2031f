"""Truths that depend on what an instruction says are found by it."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.scenes.truths_of_arguments import truth_name, truths_for

NAMES = st.from_regex(r"[a-z][a-z_]{0,5}", fullmatch=True)


@given(NAMES, st.dictionaries(NAMES, NAMES, max_size=3))
def test_a_truth_is_found_by_its_own_arguments_and_by_no_others(
    variable: str, arguments: dict[str, str]
) -> None:
    for owner in ("", "n."):
        name = truth_name(f"{owner}{variable}", arguments)
        stated = {f"{owner or 'm.'}{one}": value for one, value in arguments.items()}
        assert truths_for([name], {**stated, "m.another": "value"}, "m") == {f"{owner}{variable}": name}
        for one in stated:
            assert truths_for([name], {**stated, one: "otherwise"}, "m") == {}


def test_a_truth_that_depends_on_nothing_is_the_variable_itself() -> None:
    assert truth_name("m.done", {}) == "m.done"
    assert truths_for(["m.done", "m.near(to = left)"], {"m.to": "right"}, "m") == {"m.done": "m.done"}
