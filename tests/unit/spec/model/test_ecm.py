"""Modules: providers of capabilities, and outcomes that are successes."""

from __future__ import annotations

from dataclasses import replace

from tests.unit.agent.dumplings import DUMPLING


def test_a_step_may_name_a_skill_or_a_capability_of_skills() -> None:
    module = replace(DUMPLING, capabilities={"heating": ("boil", "recover"), "all": ("make", "boil")})
    assert module.providers("boil") == ("boil",)
    assert module.providers("heating") == ("boil", "recover")
    assert module.providers("all") == ()  # a composition is no step
    assert module.providers("flying") == ()


def test_successes_are_the_outcomes_that_are_no_failures() -> None:
    assert [outcome.id for outcome in DUMPLING.skills["wrap"].success_outcomes] == ["wrapped"]
