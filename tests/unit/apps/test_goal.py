"""Goals and values from arguments: exact, or refused with the place underlined."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import pytest

from aeros.apps.goal import parse_goal, parse_value
from aeros.exit_codes import UsageError
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.elaborate.load import load_site
from aeros.spec.expr.unparse import unparse
from aeros.spec.model.site import Site
from tests.repo.tree import ROOT


@pytest.fixture(scope="module")
def site() -> Site:
    found = load_site(ROOT / "docs" / "codes" / "base" / "site.yaml", Diagnostics())
    assert found is not None
    return found


def test_a_goal_is_a_condition_over_the_sites_state(site: Site) -> None:
    text = "bench_clean and human_distance > 1200 mm"
    goal = parse_goal(text, site)
    assert goal.text == text
    assert unparse(goal.term) == "bench_clean and (1.2 m < human_distance)"
    assert (goal.span.source.path, goal.span.start, goal.span.end) == ("--goal", 0, len(text))
    assert [text[part.span.start : part.span.end] for part in goal.conjuncts] == [
        "bench_clean",
        "human_distance > 1200 mm",
    ]


@pytest.mark.parametrize(
    ("text", "start", "end"),
    [
        ("bench_clear", 0, 11),  # no such variable
        ("bench_clean and", 15, 15),  # no condition
        ("human_distance", 0, 14),  # a number
        ("bench_clean and human_distance > 1 s", 33, 36),  # other units
        ("speed > 1 m/s", 0, 5),  # a parameter is no state
    ],
)
def test_a_text_that_is_no_goal_is_refused_with_its_place(
    site: Site, text: str, start: int, end: int
) -> None:
    with pytest.raises(UserError) as refused:
        parse_goal(text, site)
    (problem,) = refused.value.diagnostics
    assert problem.primary is not None
    place = problem.primary.span
    assert (place.source.path, place.start, place.end) == ("--goal", start, end)


@pytest.mark.parametrize(
    ("name", "text", "value"),
    [
        ("bench_clean", "true", True),
        ("bench_clean", "false", False),
        ("human_distance", "1200 mm", Fraction(6, 5)),
        ("human_distance", "reduced_speed * 2 s", Fraction(1, 2)),
        ("human_distance", "unknown", None),
    ],
)
def test_a_value_is_exact_or_unknown(site: Site, name: str, text: str, value: Any) -> None:
    assert parse_value(name, text, site) == (name, value)


@pytest.mark.parametrize(
    ("name", "text"), [("bench_clean", "1 m"), ("human_distance", "2"), ("cloth_held", "")]
)
def test_a_value_of_another_type_is_refused_with_its_place(site: Site, name: str, text: str) -> None:
    with pytest.raises(UserError) as refused:
        parse_value(name, text, site)
    (problem,) = refused.value.diagnostics
    assert problem.primary is not None
    assert problem.primary.span.source.path == f"--initial {name}"


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("bench_clear", "`bench` has no state variable `bench_clear`; did you mean `bench_clean`?"),
        ("weather", "`bench` has no state variable `weather`"),
        ("\x1b[2J", "`bench` has no state variable `\\x1b[2J`"),
    ],
)
def test_a_variable_that_the_site_lacks_is_a_usage_error(site: Site, name: str, message: str) -> None:
    with pytest.raises(UsageError) as refused:
        parse_value(name, "true", site)
    assert str(refused.value) == message
