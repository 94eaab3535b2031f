"""Actions as skills make them: a name, parameters, and nothing checked."""

from __future__ import annotations

from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from aeros.skill import Action, act


def test_an_action_is_its_kind_and_its_parameters() -> None:
    action = act("move", target=(0.1, 0.2, 0.3), speed=0.2)
    assert action == Action("move", {"target": (0.1, 0.2, 0.3), "speed": 0.2})
    assert (action.kind, action.parameters["speed"]) == ("move", 0.2)


def test_an_action_may_have_no_parameters() -> None:
    assert act("stop") == Action("stop", {})


def test_nothing_is_checked() -> None:
    assert act("", speed=float("inf"), target=None).parameters == {"speed": float("inf"), "target": None}


@given(st.text(max_size=5), st.dictionaries(st.from_regex(r"\A[a-j]{1,4}\Z"), st.integers(), max_size=4))
def test_the_order_of_parameters_makes_no_other_action(kind: str, parameters: dict[str, Any]) -> None:
    assert act(kind, **parameters) == act(kind, **dict(reversed(parameters.items())))
