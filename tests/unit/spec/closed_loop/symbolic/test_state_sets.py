"""Sets of states: conditions, numbers as thresholds and as digits, and branches forward and backward."""

from __future__ import annotations

from fractions import Fraction
from itertools import product
from typing import Any

import pytest

from aeros.spec.closed_loop.loop_variables import StateSpaceError
from aeros.spec.closed_loop.symbolic import state_sets
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


def test_the_picked_state_has_first_values_where_it_may() -> None:
    made = sets()
    picked = made.pick(made.where(term("count >= 2 or area == pot")) & made.valid)
    assert picked == {**STATES[0], "count": Fraction(2)}


def test_limits_are_the_largest_numbers_that_are_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(state_sets, "MAX_COMBINATIONS", 5)
    made = sets()
    assert made.where(term("count == 2")) != made.none
    joined = term("not (count == 2 and dumpling_cooked or area == pot and not dumpling_cooked)")
    assert made.where(joined) != made.none
    with pytest.raises(
        StateSpaceError, match=r"^a condition compares too many values of `count` and `fill_level`$"
    ):
        made.where(t.Compare("<", VARIABLES["count"], VARIABLES["fill_level"]))
    monkeypatch.setattr(state_sets, "MAX_ORDERED", 3)
    assert sets().ordered == {"fill_level", "fill_level afterwards"}


@pytest.mark.parametrize(("most", "number"), [(2, 2), (1, None)])
def test_so_many_clauses_are_listed(most: int, number: int | None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(state_sets, "MAX_CLAUSES", most)
    made = sets()
    differing = made.where(term("dumpling_cooked and area == pot or not dumpling_cooked and area == table"))
    for _ in range(2):  # the second time from what is kept
        found = made.clauses(differing & made.valid)
        assert (None if found is None else len(found)) == number


def test_too_many_values_are_not_compared(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(state_sets, "MAX_COMBINATIONS", 4)
    with pytest.raises(StateSpaceError, match=r"^a condition compares too many values of `count`$"):
        sets().where(term("count == 2"))
