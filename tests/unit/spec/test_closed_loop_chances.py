from __future__ import annotations

from fractions import Fraction

import pytest

from aeros.spec.closed_loop import markov_chain
from aeros.spec.closed_loop.markov_chain import Prediction, predict
from aeros.spec.closed_loop.outcome_probabilities import (
    outcome_probabilities,
    with_probabilities,
    with_retries,
    with_skill_probabilities,
)
from aeros.spec.closed_loop.transition_system import LoopState, StateSpaceError, TransitionSystem
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.model.ecm import Ecm, Outcome, Skill
from tests.unit.agent.dumplings import DUMPLING, MAKE_DUMPLINGS, module, rule, site, skill, task

NONE = Fraction(0)


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


@pytest.mark.parametrize(
    "given",
    [
        {"d": Fraction(1)},
        {"a": Fraction(2)},
        {"a": Fraction(1), "b": Fraction(1)},
        dict.fromkeys("abc", Fraction(0)),
    ],
)
def test_probabilities_that_are_no_distribution_are_refused(given: dict[str, Fraction]) -> None:
    with pytest.raises(MisuseError, match=r"^(`boil` has no .*`d`|the prob.* are not a distribution)$"):
        with_probabilities(three(None, None, None), given)


def test_a_skill_or_rule_that_is_not_there_is_refused() -> None:
    with pytest.raises(MisuseError, match="no skill `fry`"):
        with_skill_probabilities(DUMPLING, {"fry": {}})
    with pytest.raises(MisuseError, match="no rule of `make_dumplings` runs `fry`"):
        with_retries(MAKE_DUMPLINGS, {"fry": 1})


def boiling(failure: Fraction, retry: int) -> Ecm:
    boil = with_probabilities(three(None, None, 0), {"a": 1 - failure})
    return module(
        "kitchen", (boil,), task("cook", ("cook",), "dumpling_cooked", rule("dumpling_cooked", "boil", retry))
    )


def predicted(ecm: Ecm, replans: int) -> Prediction:
    system = TransitionSystem(ecm, ecm.tasks["cook"], site())
    return predict(system, (False,) * len(system.names), replans)


@pytest.mark.parametrize("retry", [0, 1, 3])
@pytest.mark.parametrize("replans", [0, 1, 10])
def test_independent_tries_are_a_geometric_series(retry: int, replans: int) -> None:
    p = Fraction(3, 10)
    tries, plans = (1 + retry) * (1 + replans), 1 + replans
    found = predicted(boiling(p, retry), replans)
    assert found.success == 1 - p**tries
    assert found.invocations == sum(p**n for n in range(tries))
    assert found.replans == sum(p ** (n * (1 + retry)) for n in range(1, plans))
    assert found.retries == found.invocations - 1 - found.replans
    assert found.recoveries == 0


def test_a_loop_that_has_ended_goes_nowhere() -> None:
    ecm = boiling(Fraction(1), 0)
    system = TransitionSystem(ecm, ecm.tasks["cook"], site())
    assert (
        system.transitions(LoopState("reached", (True,)))
        == system.transitions(LoopState("rejected", (False,)))
        == []
    )


def test_a_goal_reached_at_the_start_needs_no_invocation() -> None:
    ecm = boiling(Fraction(1), 0)
    system = TransitionSystem(ecm, ecm.tasks["cook"], site())
    assert predict(system, (True,), 3) == Prediction(Fraction(1), NONE, NONE, NONE, NONE)


@pytest.mark.parametrize(("replans", "counted"), [(0, 0), (1, 1), (5, 1)])
def test_a_plan_that_is_rejected_is_made_once_more(replans: int, counted: int) -> None:
    ecm = module(
        "kitchen",
        (three(1, 0, 0),),
        task("cook", ("cook",), "dumpling_cooked", rule("not dumpling_cooked", "boil")),
    )
    assert predicted(ecm, replans) == Prediction(NONE, NONE, NONE, NONE, Fraction(counted))


def test_a_chain_that_is_too_large_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(markov_chain, "MAX_WORK", 20)
    with pytest.raises(StateSpaceError, match="too large"):
        predicted(boiling(Fraction(3, 10), 3), 10)
