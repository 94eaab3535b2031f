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
    name = truth_name(variable, arguments)
    assert truths_for([name], {**arguments, "another": "value"}) == {variable: name}
    for one in arguments:
        assert truths_for([name], {**arguments, one: "otherwise"}) == {}


def test_a_truth_that_depends_on_nothing_is_the_variable_itself() -> None:
    assert truth_name("m.done", {}) == "m.done"
    assert truths_for(["m.done", "m.near(to = left)"], {"to": "right"}) == {"m.done": "m.done"}
