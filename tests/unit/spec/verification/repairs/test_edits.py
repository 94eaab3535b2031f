"""The smallest edit of a condition that makes it imply another, always proved."""

from __future__ import annotations

from fractions import Fraction

import pytest

from aeros.spec.backends.oracle import Oracle
from aeros.spec.diagnostics.source import Source
from aeros.spec.expr import terms as t
from aeros.spec.expr.scope import Scope
from aeros.spec.expr.types import BOOL, RealType
from aeros.spec.expr.units import LENGTH, TIME, Unit
from aeros.spec.model.variables import Declared
from aeros.spec.verification.repairs import edits
from aeros.spec.verification.repairs.edits import ConditionEditor

SPAN = Source("x", "x").span(0, 1)
METRE, SECOND = Unit("m", Fraction(1), LENGTH), Unit("s", Fraction(1), TIME)


def declared(name: str, role: t.VariableRole, unit: Unit, low: int, high: int) -> Declared:
    variable = t.Variable(name, RealType(unit.dimension), role)
    return Declared(variable, SPAN, unit, (Fraction(low), Fraction(high)))


X = declared("x", t.VariableRole.PARAMETER, METRE, -10, 10)
Y = declared("y", t.VariableRole.PARAMETER, METRE, -10, 10)
PAUSE = declared("pause", t.VariableRole.PARAMETER, SECOND, 0, 100)
FAR = declared("far", t.VariableRole.STATE, METRE, 0, 20)
NEAR = Declared(t.Variable("near", BOOL, t.VariableRole.STATE), SPAN)
ALL = (X, Y, PAUSE, FAR, NEAR)
SCOPE = Scope({one.name: one.variable for one in ALL})
ORACLE = Oracle()


def editor(*readable: str) -> ConditionEditor:
    return ConditionEditor(SCOPE, ALL, ORACLE, frozenset(readable))


def strengthened(
    text: str, goal: str, given: str | None = None, readable: tuple[str, ...] = ()
) -> str | None:
    one = editor(*readable)
    term = one.term(goal)
    assert term is not None
    edited = one.strengthen(text, term, goal if given is None else given)
    if edited is not None:
        assert one.implies(edited, term)
    return edited


def test_text_that_is_no_condition_has_no_term() -> None:
    assert editor().term("x < 1 m") == t.Compare("<", X.variable, t.Literal(Fraction(1), RealType(LENGTH)))
    assert [editor().term(text) for text in ("x <", "x < 1 s", "unknown", "x")] == [None] * 4


def test_an_implication_is_proved_or_not() -> None:
    goal = editor().term("x <= 2 m")
    assert goal is not None
    assert editor().implies("x <= 2 m and near", goal)
    assert not editor().implies("x <= 3 m", goal)
    assert not editor().implies("x <", goal)


@pytest.mark.parametrize(
    ("text", "goal", "edited"),
    [
        # A number is moved to a constant of the goal, and the bound excluded where the goal excludes it.
        ("x <= 3 m", "x <= 2 m", "x <= 2 m"),
        ("x <= 3 m", "x < 2 m", "x < 2 m"),
        ("3 m >= x", "x <= 2 m", "2 m >= x"),
        ("x >= 1 m", "x >= 150 cm", "x >= 1.5 m"),
        ("1 m < x < 5 m", "x <= 450 cm", "1 m < x < 4.5 m"),
        ("-5 m <= x and near", "x >= -4 m", "-4 m <= x and near"),
        ("abs(x) <= 3 m", "x <= 2 m", "abs(x) <= 2 m"),
        # Of two numbers the one that moves less.
        ("x <= 3 m and y <= 100 cm", "x + y <= 350 cm", "x <= 2.5 m and y <= 100 cm"),
        # Else a number with three more digits than were written.
        ("x <= 3 m", "3 * x <= 4 m", "x <= 1.333 m"),
        ("x <= 3.0 m", "3 * x <= 4 m", "x <= 1.3333 m"),
        # A constant of the goal that is not the least change is passed over.
        ("x <= 3 m", "x + 1 m <= 2.5 m", "x <= 1.5 m"),
        ("-3 m <= x", "3 * x >= -4 m", "-1.333 m <= x"),
        # Without a number to move, the goal is added, or a bound.
        ("true", "x <= 2 m", "x <= 2 m"),
        ("near", "x <= 2 m", "near and x <= 2 m"),
        ("near or x <= 1 m", "y <= 2 m", "(near or x <= 1 m) and y <= 2 m"),
        ("true", "near implies x <= 2 m", "x <= 2 m"),
        # The state is not to be bounded.
        ("far <= 3 m", "far <= 2 m", None),
        ("true", "near", None),
        ("x <= 3 m", "x <= -11 m", None),
    ],
)
def test_the_least_edit_is_found(text: str, goal: str, edited: str | None) -> None:
    assert strengthened(text, goal) == edited


@pytest.mark.parametrize(
    ("text", "goal", "edited"),
    [
        ("x <= 5 m", "near implies x <= 3 m", "x <= 5 m and (near implies x <= 3 m)"),
        ("true", "near implies x <= 3 m", "near implies x <= 3 m"),
        ("x <= 5 m", "far >= 2 m or x <= 3 m", "x <= 5 m and (far >= 2 m or x <= 3 m)"),
        # A bound that holds in the same cases is moved.
        ("near implies x <= 5 m", "near implies x <= 3 m", "near implies x <= 3 m"),
        ("near and x <= 5 m", "near implies x <= 3 m", "near and x <= 3 m"),
        # Products of state and parameter are no cases.
        ("x <= 3 m", "far * x <= 20 m*m", "x <= 1 m"),
        ("x <= 3 m", "near", None),
    ],
)
def test_a_goal_for_some_states_leaves_the_others_alone(text: str, goal: str, edited: str | None) -> None:
    assert strengthened(text, goal, readable=("near", "far")) == edited


def test_a_state_that_may_not_be_read_bounds_all_cases() -> None:
    assert strengthened("x <= 5 m", "near implies x <= 3 m", readable=("far",)) == "x <= 3 m"


def test_nothing_is_offered_that_leaves_nothing() -> None:
    assert strengthened("x >= 3 m", "x <= 2 m") is None
    assert strengthened("3 m <= x <= 5 m", "x <= 2 m") is None


def test_the_goal_is_added_only_as_a_text_that_means_it() -> None:
    assert strengthened("near", "x + y <= 2 m", "x + y <= 3 m") != "near and x + y <= 3 m"
    assert strengthened("near", "x + y <= 2 m") == "near and x + y <= 2 m"


def test_queries_come_to_an_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(edits, "MAX_QUERIES", 1)
    one = editor()
    goal = one.term("x <= 2 m")
    assert goal is not None
    assert one.implies("x <= 1 m", goal)
    assert not one.implies("x <= 1 m", goal)
    assert editor().strengthen("x <= 3 m", goal, "near") is None
