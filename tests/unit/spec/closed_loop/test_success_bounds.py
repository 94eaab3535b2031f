"""Bounds of success: equal to the prediction where there is one, and else the best and the worst case."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest
from hypothesis import given

from aeros.spec.closed_loop import success_bounds
from aeros.spec.closed_loop.giving_up import declared_beliefs
from aeros.spec.closed_loop.loop_variables import StateSpaceError
from aeros.spec.closed_loop.markov_chain import predict
from aeros.spec.closed_loop.success_bounds import SuccessBounds, bound_success
from aeros.spec.closed_loop.transition_system import TransitionSystem
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.expr import terms as t
from aeros.spec.model.composition import Composition, Step
from aeros.spec.model.ecm import PlanningRule, Task
from aeros.spec.model.step_graph import Par
from tests.differential.planning.small_tasks import Case, cases
from tests.differential.planning.test_giving_up import with_all_failures
from tests.differential.reference_cases import predicted
from tests.hypothesis_profiles import examples
from tests.repo.tree import ROOT
from tests.unit.agent import dumplings
from tests.unit.agent.dumplings import SPAN, module, outcome, rule, skill
from tests.unit.spec.consequences import places

CORPUS = ROOT / "tests" / "corpus"


def bounds(name: str, replans: int) -> SuccessBounds:
    sink = Diagnostics()
    site = load_site(CORPUS / "site" / "table.yaml", sink)
    assert site is not None
    loaded = load_ecm(CORPUS / "accepted" / name, site, sink)
    assert loaded is not None
    (task,) = loaded.ecm.tasks.values()
    system = TransitionSystem(loaded.ecm, task, site)
    start = {"fetched": "brush", "table_tidy": False}
    return bound_success(system, tuple(start[one] for one in system.names), replans)


@examples(30)
@given(cases(most_rules=3, most_retries=2, most_replans=3))
def test_bounds_meet_where_every_probability_is_known(case: Case) -> None:
    system = TransitionSystem(case.ecm, case.task, case.site, declared_beliefs(case.ecm))
    found = bound_success(system, system.start(case.start), case.site.limits.replans)
    assert found.at_least == found.at_most == predicted(case).success


@examples(30)
@given(cases(most_rules=2, most_retries=2, most_replans=3))
def test_an_agent_that_gives_up_is_between_one_that_does_so_no_later_and_one_that_never_does(
    case: Case,
) -> None:
    expected = declared_beliefs(with_all_failures(case.ecm, Fraction(1, 100)))
    system = TransitionSystem(case.ecm, case.task, case.site, expected)
    soonest, success, most = (
        predict(one, one.start(case.start), case.site.limits.replans).success
        for one in (system.giving_up_soonest(), system, system.never_giving_up())
    )
    assert soonest <= success <= most


@pytest.mark.parametrize("replans", [0, 1, 3])
def test_a_failed_branch_leaves_the_other_anywhere(replans: int) -> None:
    # Each skill succeeds in one of two tries. At best the table is always swept, and only the sponge is
    # missing after a failure; at worst nothing is done by then.
    failed = Fraction(3, 4)
    at_worst, at_best = Fraction(0), Fraction(0)
    for _ in range(replans + 1):
        at_worst = 1 - failed + failed * at_worst
    alone = Fraction(0)
    for _ in range(replans + 1):
        alone = Fraction(1, 2) + Fraction(1, 2) * alone
    at_best = 1 - failed + failed * alone
    assert bounds("branches_that_may_fail", replans) == SuccessBounds(at_worst, at_best)


@pytest.mark.parametrize("replans", [0, 2])
def test_an_outcome_that_leaves_the_goal_true_or_false_is_a_success_at_best(replans: int) -> None:
    # One drive in four brings the cup. After each, nothing decides if the robot is docked.
    goal = "m.docked or holding"
    reached = PlanningRule(places.term(goal), goal, "go", {}, 0, None, None, SPAN)
    task = Task("arrive", (), places.term(goal), goal, (reached,), {}, None, SPAN)
    lucky = replace(outcome("lucky", {"holding": True}), probability=Fraction(1, 4))
    ecm = module("m", (places.asking("go", lucky, outcome("gone", {})),))
    system = TransitionSystem(replace(ecm, definitions=places.DEFINITIONS), task, places.site())
    found = bound_success(system, (False, False), replans)
    assert found == SuccessBounds(1 - Fraction(3, 4) ** (1 + replans), Fraction(1))


@pytest.mark.parametrize(("after", "success"), [("bake", Fraction(3, 4)), (None, Fraction(1, 2))])
def test_the_agent_s_choices_are_equally_likely_also_where_the_rest_is_not_known(
    after: str | None, success: Fraction
) -> None:
    """It fries, or runs a composition that fails in one of two runs, after which the recovery bakes."""
    cooked = outcome("cooked", {"dumpling_cooked": True})
    skills = (
        skill("fry", cooked),
        skill("bake", cooked),
        skill("wrap", outcome("wrapped", {"dumpling_wrapped": True}), outcome("torn", {}, failure=True)),
        skill("align", outcome("aligned", {"wrapper_aligned": True})),
    )
    steps = tuple(Step(one, one, {}, {}, 0, None, None, SPAN) for one in ("wrap", "align"))
    both = Composition("both", t.TRUE, None, Par(steps, SPAN), {}, SPAN)
    task = dumplings.task("t", (), "dumpling_cooked", rule("dumpling_cooked", "cooking", 0, None, after))
    ecm = replace(module("m", skills), compositions={"both": both}, capabilities={"cooking": ("fry", "both")})
    system = TransitionSystem(ecm, task, dumplings.site())
    start = system.start(dict.fromkeys(system.names, False))
    assert bound_success(system, start, 0) == SuccessBounds(success, success)
    assert system.inexact_reason == "which of several steps fails first depends on how long they take"


def test_a_chain_that_is_too_large_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(success_bounds, "MAX_NODES", 5)
    with pytest.raises(StateSpaceError, match=r"^its Markov chain is too large for bounds of its success$"):
        bounds("branches_that_may_fail", 3)
