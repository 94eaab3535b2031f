"""Branches forward and backward: each against the states one by one."""

from __future__ import annotations

from fractions import Fraction
from itertools import product
from typing import Any

from hypothesis import example, given
from hypothesis import strategies as st

from aeros.spec.closed_loop.symbolic.branch_images import BranchImages
from aeros.spec.closed_loop.symbolic.program import REACHED, End, Move, ProgramBranch
from aeros.spec.closed_loop.symbolic.state_sets import StateSets
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import is_true
from tests.differential.planning.number_loops import term
from tests.unit.spec.closed_loop.symbolic.test_state_sets import CONDITIONS, STATES, VALUES, VARIABLES, sets

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


@example({"area": "pot", "count": "+1", "dumpling_cooked": "area == pot"}, {}, "true", "count == 2")
@example({"area": "table", "count": "-1", "dumpling_cooked": "area == pot"}, {}, "true", "dumpling_cooked")
@given(_UPDATES, _OPENED, st.sampled_from(CONDITIONS), st.sampled_from(CONDITIONS))
def test_branches_lead_forward_and_backward_alike(
    updates: dict[str, Any], opened: dict[str, Any], guard: str, wanted: str
) -> None:
    branch = ProgramBranch(term("count > 0 and count < 4"), (End(t.TRUE, REACHED),), _terms(updates), opened)
    move = Move(term(guard), (branch,))
    made = sets()
    images = BranchImages(made)
    target = {REACHED: made.where(term(wanted)) & made.valid}
    before = images.before(target, move, branch)
    surely = images.surely_before(target, branch)
    for state in STATES:
        possible = Fraction(0) < state["count"] < 4
        after = _after(state, updates, opened) if possible else []
        kept = [is_true(term(wanted), one) for one in after]
        assert made.contains(before, state) is (is_true(term(guard), state) and any(kept))
        assert made.contains(surely, state) is (possible and all(kept))
        start = made.intersection(made.equals(name, value) for name, value in state.items())
        found = list(images.after(start, move, branch))
        expected = [one for one in after if is_true(term(guard), state)]
        assert all(made.contains(found[0][1], one) for one in expected)
        assert sum(int(made.bdd.count(one, _width(made))) for _, one in found) == len(expected)


def _width(made: StateSets) -> int:
    return sum(len(made.bits[name]) for name in VALUES)


def _terms(updates: dict[str, Any]) -> dict[str, t.Term]:
    """Terms over the values before, also where these change at the same time."""
    found: dict[str, t.Term] = {}
    for name, value in updates.items():
        variable = VARIABLES[name]
        if value in ("+1", "-1"):
            found[name] = t.Add(variable, t.Literal(Fraction(int(value)), variable.type))  # type: ignore[arg-type]
        elif value == "area == pot":
            found[name] = term(value)
        else:
            found[name] = t.Literal(value, variable.type)  # type: ignore[arg-type]
    return found


def _after(state: dict[str, Any], updates: dict[str, Any], opened: dict[str, Any]) -> list[dict[str, Any]]:
    changed = dict(state)
    for name, value in updates.items():
        if value in ("+1", "-1"):
            changed[name] = state[name] + int(value)
        elif value == "area == pot":
            changed[name] = state["area"] == "pot"
        else:
            changed[name] = value
    return [{**changed, **dict(zip(opened, chosen, strict=True))} for chosen in product(*opened.values())]
