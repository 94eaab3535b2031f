"""Probabilities of outcomes, declared, left open and changed."""

from __future__ import annotations

from fractions import Fraction

import pytest

from aeros.spec.closed_loop.outcome_probabilities import (
    outcome_probabilities,
    with_probabilities,
    with_retries,
    with_skill_probabilities,
)
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.model.ecm import Outcome, Skill
from tests.unit.agent.dumplings import DUMPLING, MAKE_DUMPLINGS, skill


def three(*probabilities: Fraction | int | None) -> Skill:
    outcomes = (
        Outcome(name, {"dumpling_cooked": name == "a"}, name != "a", None if p is None else Fraction(p), None)
        for name, p in zip("abc", probabilities, strict=True)
    )
    return skill("boil", *outcomes)


def shares(one: Skill) -> list[Fraction]:
    return [share for _, share in outcome_probabilities(one.outcomes.values())]


def halves(*parts: int) -> list[Fraction]:
    return [Fraction(part, sum(parts)) for part in parts]


def test_outcomes_without_a_probability_share_the_rest() -> None:
    assert shares(three(Fraction(1, 2), None, None)) == halves(2, 1, 1)


def test_other_outcomes_share_the_rest_in_their_proportions() -> None:
    declared = three(Fraction(9, 10), Fraction(3, 40), Fraction(1, 40))
    assert shares(with_probabilities(declared, {"a": Fraction(6, 10)})) == halves(6, 3, 1)
    assert shares(with_probabilities(declared, {"a": Fraction(0), "c": Fraction(1, 5)})) == halves(0, 4, 1)


def test_the_others_share_equally_where_none_of_them_could_happen() -> None:
    assert shares(with_probabilities(three(1, 0, 0), {"a": Fraction(1, 2)})) == halves(2, 1, 1)


@pytest.mark.parametrize("share", [0, 1])
def test_the_probability_of_an_outcome_that_is_not_declared_is_refused(share: int) -> None:
    with pytest.raises(MisuseError, match=r"^`boil` has no outcome `d`$"):
        with_probabilities(three(None, None, None), {"d": Fraction(share)})


@pytest.mark.parametrize(
    "given",
    [
        {"a": Fraction(2)},
        {"a": Fraction(1), "b": Fraction(1)},
        dict.fromkeys("abc", Fraction(0)),
    ],
)
def test_probabilities_that_are_no_distribution_are_refused(given: dict[str, Fraction]) -> None:
    with pytest.raises(MisuseError, match=r"^the prob.* are not a distribution$"):
        with_probabilities(three(None, None, None), given)


def test_a_skill_or_rule_that_is_not_there_is_refused() -> None:
    with pytest.raises(MisuseError, match="no skill `fry`"):
        with_skill_probabilities(DUMPLING, {"fry": {}})
    with pytest.raises(MisuseError, match="no rule of `make_dumplings` runs `fry`"):
        with_retries(MAKE_DUMPLINGS, {"fry": 1})


@pytest.mark.parametrize(
    "declared", [(Fraction(1, 2), Fraction(1, 4), 0), (Fraction(3, 4), Fraction(1, 2), None), (2, -1, None)]
)
def test_declared_probabilities_that_are_no_distribution_are_refused(
    declared: tuple[Fraction | int | None, ...],
) -> None:
    with pytest.raises(MisuseError, match="not a distribution"):
        shares(three(*declared))


def test_a_module_differs_in_the_skills_named_alone() -> None:
    changed = with_skill_probabilities(DUMPLING, {"boil": {"cooked": Fraction(1, 4)}})
    assert shares(changed.skills["boil"]) == halves(1, 3)
    assert {name for name, one in changed.skills.items() if one is not DUMPLING.skills[name]} == {"boil"}


def test_a_task_differs_in_the_rules_named_alone() -> None:
    assert [one.retry for one in MAKE_DUMPLINGS.rules] == [0, 0, 2, 0]
    changed = with_retries(MAKE_DUMPLINGS, {"boil": 5, "prepare": 1})
    assert [one.retry for one in changed.rules] == [1, 0, 2, 5]
    assert with_retries(MAKE_DUMPLINGS, {}) == MAKE_DUMPLINGS
