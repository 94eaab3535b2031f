"""Actions as skills make them: a name, parameters, and nothing checked."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.skill import Action, ActionDenied, Observation, Way, act, first_allowed


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


# Several ways to do the same.


def turned(yaw: float) -> Way:
    def way(observed: Observation) -> Generator[Action, Observation, Observation]:
        yield act("over", yaw=yaw, seen=observed["seen"])
        return (yield act("down", yaw=yaw))

    return way


def test_a_denial_counts_as_a_failure_of_its_way_and_the_next_begins_with_what_is_seen_then() -> None:
    body = first_allowed({"seen": 1}, turned(0.0), turned(1.5))
    assert next(body) == act("over", yaw=0.0, seen=1)
    assert body.send({"seen": 2}) == act("down", yaw=0.0)
    assert body.throw(ActionDenied("too near", {"seen": 3})) == act("over", yaw=1.5, seen=3)
    assert body.send({"seen": 4}) == act("down", yaw=1.5)
    with pytest.raises(StopIteration) as ended:
        body.send({"seen": 5})
    assert ended.value.value == {"seen": 5}


def test_the_last_denial_is_raised_where_every_way_is_denied() -> None:
    body = first_allowed({"seen": 1}, turned(0.0), turned(1.5))
    next(body)
    body.throw(ActionDenied("too near", {"seen": 2}))
    with pytest.raises(ActionDenied, match="nearer still") as raised:
        body.throw(ActionDenied("nearer still", {"seen": 3}))
    assert (raised.value.observed, raised.value.denials) == ({"seen": 3}, 2)


def test_a_denial_that_another_way_made_up_for_is_not_counted_later() -> None:
    def both(observed: Observation) -> Generator[Action, Observation, Observation]:
        observed = yield from first_allowed(observed, turned(0.0), turned(1.5))
        return (yield from first_allowed(observed, turned(3.0)))

    body = both({"seen": 1})
    next(body)
    body.throw(ActionDenied("too near", {"seen": 2}))
    body.send({"seen": 3})
    assert body.send({"seen": 4}) == act("over", yaw=3.0, seen=4)
    with pytest.raises(ActionDenied) as raised:
        body.throw(ActionDenied("too far", {"seen": 5}))
    assert raised.value.denials == 1


def test_without_a_way_nothing_can_be_done() -> None:
    with pytest.raises(ValueError, match="no way is given"):
        next(first_allowed({}))
