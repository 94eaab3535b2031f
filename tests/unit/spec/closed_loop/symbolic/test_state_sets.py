"""Sets of states: conditions, numbers as thresholds and as digits, and branches forward and backward."""

from __future__ import annotations

from fractions import Fraction
from itertools import product
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.closed_loop.loop_variables import StateSpaceError
from aeros.spec.closed_loop.symbolic import state_sets
from aeros.spec.closed_loop.symbolic.program import REACHED, Branch, End, Move
from aeros.spec.closed_loop.symbolic.state_sets import StateSets
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import is_true
from tests.differential.planning.number_loops import STATE, term

NAMES = ("area", "count", "dumpling_cooked", "fill_level")
VALUES: dict[str, tuple[Any, ...]] = {
    "area": ("table", "pot"),
    "count": tuple(map(Fraction, range(5))),
    "dumpling_cooked": (False, True),
    "fill_level": (Fraction(1, 4), Fraction(1, 2), Fraction(3, 4)),
}
VARIABLES = {name: STATE[name].variable for name in NAMES}
STATES = [dict(zip(NAMES, chosen, strict=True)) for chosen in product(*VALUES.values())]
CONDITIONS = [
    "dumpling_cooked",
    "not (area == pot and count >= 3)",
    "count == 2 or fill_level > 0.5",
    "count + 1 <= 3 and not dumpling_cooked",
    "abs(fill_level - 0.5) < 0.1",
    "true",
]


def sets() -> StateSets:
    return StateSets(VALUES, VARIABLES)


@pytest.mark.parametrize("ordered", [64, 0], ids=["thresholds", "digits"])
@pytest.mark.parametrize("text", CONDITIONS)
def test_a_set_has_the_states_in_which_its_condition_holds(
    text: str, ordered: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(state_sets, "MAX_ORDERED", ordered)
    made = sets()
    assert bool(made.ordered) is bool(ordered)
    found = made.where(term(text))
    for state in STATES:
        assert made.contains(found, state) is is_true(term(text), state)


@pytest.mark.parametrize("ordered", [64, 0], ids=["thresholds", "digits"])
def test_the_valid_states_are_all_and_no_more(ordered: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(state_sets, "MAX_ORDERED", ordered)
    made = sets()
    bits = sum(len(made.bits[name]) for name in NAMES)
    assert made.bdd.count(made.valid, bits) == len(STATES)


_UPDATES = st.fixed_dictionaries(
    {},
    optional={
        "area": st.sampled_from(["table", "pot"]),
        "count": st.sampled_from([Fraction(0), Fraction(3), "+1", "-1"]),
        "dumpling_cooked": st.sampled_from([False, True, "area == pot"]),
    },
)
_OPENED = st.sampled_from(
    [{}, {"fill_level": VALUES["fill_level"][:2]}, {"fill_level": VALUES["fill_level"]}]
)


@given(_UPDATES, _OPENED, st.sampled_from(CONDITIONS), st.sampled_from(CONDITIONS))
def test_branches_lead_forward_and_backward_alike(
    updates: dict[str, Any], opened: dict[str, Any], guard: str, wanted: str
) -> None:
    branch = Branch(term("count > 0 and count < 4"), (End(t.TRUE, REACHED),), _terms(updates), opened)
    move = Move(term(guard), (branch,))
    made = sets()
    target = {REACHED: made.where(term(wanted)) & made.valid}
    before = made.before(target, move, branch)
    surely = made.surely_before(target, branch)
    for state in STATES:
        possible = Fraction(0) < state["count"] < 4
        after = _after(state, updates, opened) if possible else []
        kept = [is_true(term(wanted), one) for one in after]
        assert made.contains(before, state) is (is_true(term(guard), state) and any(kept))
        assert made.contains(surely, state) is (possible and all(kept))
        start = made.intersection(made.equals(name, value) for name, value in state.items())
        found = list(made.after(start, move, branch))
        expected = [one for one in after if is_true(term(guard), state)]
        assert all(made.contains(found[0][1], one) for one in expected)
        assert sum(int(made.bdd.count(one, _width(made))) for _, one in found) == len(expected)


def _width(made: StateSets) -> int:
    return sum(len(made.bits[name]) for name in NAMES)


def _terms(updates: dict[str, Any]) -> dict[str, t.Term]:
    found: dict[str, t.Term] = {}
    for name, value in updates.items():
        variable = VARIABLES[name]
        if value in ("+1", "-1"):
            found[name] = t.Add(variable, t.Literal(Fraction(int(value)), variable.type))  # type: ignore[arg-type]
        elif value == "area == pot":
            found[name] = term(value) if "area" not in updates else t.TRUE
        else:
            found[name] = t.Literal(value, variable.type)  # type: ignore[arg-type]
    return found


def _after(state: dict[str, Any], updates: dict[str, Any], opened: dict[str, Any]) -> list[dict[str, Any]]:
    changed = dict(state)
    for name, value in updates.items():
        if value in ("+1", "-1"):
            changed[name] = state[name] + int(value)
        elif value == "area == pot":
            changed[name] = state["area"] == "pot" if "area" not in updates else True
        else:
            changed[name] = value
    return [{**changed, **dict(zip(opened, chosen, strict=True))} for chosen in product(*opened.values())]


def test_the_picked_state_has_first_values_where_it_may() -> None:
    made = sets()
    picked = made.pick(made.where(term("count >= 2 or area == pot")) & made.valid)
    assert picked == {**STATES[0], "count": Fraction(2)}


def test_too_many_values_are_not_compared(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(state_sets, "MAX_COMBINATIONS", 4)
    with pytest.raises(StateSpaceError, match="compares too many values of `count`"):
        sets().where(term("count == 2"))
