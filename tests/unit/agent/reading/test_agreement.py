"""Two meanings agree only where it is proved."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest

from aeros.agent.instructions.meaning import Errand, Understanding
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.reading.agreement import is_equivalent, meanings_agree
from aeros.spec.backends.oracle import Oracle
from aeros.spec.expr import terms as t
from aeros.spec.expr.constants import constant_term
from tests.unit.agent.dumplings import MAKE_DUMPLINGS, site, task, term
from tests.unit.agent.instructions.lists.reference import parametric_modules

COOK = RoutedTask("dumpling", MAKE_DUMPLINGS)
CLEAN = RoutedTask("clean", task("clean", ("clean",), "area == table"))


def meaning(*errands: Errand, prohibited: tuple[RoutedTask, ...] = ()) -> Understanding:
    return Understanding("words", errands, prohibited)


def with_goal(goal: str) -> Errand:
    return Errand(replace(COOK, task=replace(MAKE_DUMPLINGS, goal=term(goal), goal_text=goal)))


@pytest.mark.parametrize(
    ("one", "other", "agree"),
    [
        ("dumpling_cooked", "not not dumpling_cooked", True),
        ("dumpling_cooked", "dumpling_cooked or (dumpling_cooked and wrapper_aligned)", True),
        ("fill_level >= 0", "true", True),
        ("fill_level >= 0.5", "fill_level > 0.5", False),
        ("area == table", "not (area == pot)", True),
        ("dumpling_cooked", "dumpling_wrapped", False),
        ("dumpling_cooked", "not dumpling_cooked", False),
        ("dumpling_cooked", "dumpling_cooked and dumpling_wrapped", False),
        ("dumpling_cooked", "dumpling_cooked or dumpling_wrapped", False),
    ],
)
def test_conditions_are_equivalent_for_all_values_or_not(one: str, other: str, agree: bool) -> None:
    assert is_equivalent(term(one), term(other), site(), Oracle()) is agree
    assert is_equivalent(term(other), term(one), site(), Oracle()) is agree


@pytest.mark.parametrize(
    "other",
    [
        meaning(Errand(CLEAN), Errand(COOK)),
        meaning(Errand(COOK)),
        meaning(Errand(COOK), Errand(CLEAN), Errand(CLEAN)),
        meaning(Errand(COOK), Errand(CLEAN), prohibited=(COOK,)),
        meaning(Errand(COOK, term("wrapper_aligned"), "wrapper_aligned"), Errand(CLEAN)),
        meaning(with_goal("dumpling_wrapped"), Errand(CLEAN)),
    ],
    ids=["order", "one less", "one more", "a prohibition", "a condition", "a goal"],
)
def test_meanings_that_differ_do_not_agree(other: Understanding) -> None:
    both = meaning(Errand(COOK), Errand(CLEAN))
    assert meanings_agree(
        both, meaning(with_goal("not not dumpling_cooked"), Errand(CLEAN)), site(), Oracle()
    )
    assert not meanings_agree(both, other, site(), Oracle())
    assert not meanings_agree(other, both, site(), Oracle())


def test_a_request_that_is_decided_later_is_no_other_branch() -> None:
    first = Errand(COOK, term("wrapper_aligned"), "wrapper_aligned")
    branches = meaning(first, first.otherwise(CLEAN))
    later = meaning(first, replace(first.otherwise(CLEAN), is_otherwise=False))
    assert meanings_agree(branches, branches, site(), Oracle())
    assert not meanings_agree(branches, later, site(), Oracle())


def test_without_a_budget_nothing_is_equivalent() -> None:
    one, other = term("fill_level * fill_level > 0.25"), term("fill_level > 0.5")
    assert not is_equivalent(one, other, site(), Oracle(rlimit=1))


@pytest.mark.parametrize(("written", "stated", "agree"), [(1, 1, True), (1, 2, False), (2, 2, True)])
def test_goals_are_compared_with_the_values_that_the_request_says(
    written: int, stated: int, agree: bool
) -> None:
    declared = parametric_modules()["make_dumplings"].tasks["make_dumplings"]
    count = declared.parameters["count"].declared.variable
    number = constant_term(Fraction(written), count.type)
    with_number = replace(declared, goal=t.substitute(declared.goal, {count.name: number}))
    arguments = declared.complete_arguments({"count": Fraction(stated)})
    grammar, model = (
        meaning(Errand(RoutedTask("make_dumplings", one, arguments))) for one in (declared, with_number)
    )
    assert meanings_agree(grammar, model, site(), Oracle()) is agree
