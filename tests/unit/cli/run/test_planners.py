"""The planner that options select, its time limit, and the options that contradict each other."""

from __future__ import annotations

from argparse import Namespace
from dataclasses import replace
from fractions import Fraction
from math import inf
from typing import Any

import pytest

from aeros.agent.errors import AgentError
from aeros.agent.planning.base import RulePlanner
from aeros.agent.planning.compositions import CompositionPlanner
from aeros.agent.planning.pddl import PddlPlanner
from aeros.agent.planning.smt import SmtPlanner
from aeros.cli.run.planners import LLM_KEY, build_planner, planning_timeout
from aeros.exit_codes import UsageError
from aeros.spec.model.composition import Composition
from aeros.spec.model.step_graph import Seq
from tests.unit.agent.dumplings import DUMPLING, SPAN, site, term

COMPOSED = replace(
    DUMPLING, compositions={"all_at_once": Composition("all_at_once", term("true"), None, Seq(()), {}, SPAN)}
)
LLM = {"planner": "llm", "llm_url": "http://localhost:9/v1", "llm_model": "tiny"}
SITE = replace(site(), limits=replace(site().limits, planning=Fraction(10)))


def options(**given: Any) -> Namespace:
    names = ("composition", "planner", "goal", "llm_url", "llm_model", "pddl_engine", "planning_timeout")
    return Namespace(**{**dict.fromkeys(names), **given})


def built(**given: Any) -> Any:
    return build_planner(options(**given), COMPOSED, SITE)


def test_by_default_the_rules_of_the_task_plan() -> None:
    assert type(built()) is RulePlanner
    assert type(built(planner="rules")) is RulePlanner


def test_a_goal_is_searched_for() -> None:
    assert type(built(goal="dumpling_cooked")) is SmtPlanner
    assert type(built(planner="smt")) is SmtPlanner
    assert type(built(goal="dumpling_cooked", planner="smt", planning_timeout=1.0)) is SmtPlanner


def test_a_composition_of_the_module_is_its_own_planner() -> None:
    planner = built(composition="all_at_once")
    assert type(planner) is CompositionPlanner
    assert planner.name == "composition all_at_once"


@pytest.mark.parametrize(
    ("name", "hint"), [("all_at_one", "; did you mean `all_at_once`?"), ("nothing_like_it", "")]
)
def test_a_composition_that_the_module_lacks_is_refused(name: str, hint: str) -> None:
    with pytest.raises(AgentError) as refused:
        built(composition=name)
    assert str(refused.value) == f"`dumpling` has no composition `{name}`{hint}"


def test_an_engine_plans_pddl() -> None:
    pytest.importorskip("unified_planning", reason="needs `pip install '.[pddl]'`")
    assert type(built(planner="pddl", pddl_engine="pyperplan")) is PddlPlanner
    assert type(built(planner="pddl")) is PddlPlanner


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"composition": "all_at_once", "planner": "smt"}, "--composition cannot be combined with"),
        ({"composition": "all_at_once", "goal": "x"}, "--composition cannot be combined with"),
        ({"goal": "x", "planner": "rules"}, "--goal requires --planner smt, pddl or llm"),
        ({"planner": "llm"}, "must be given together"),
        ({"planner": "llm", "llm_url": "http://x/v1"}, "must be given together"),
        ({"llm_url": "http://x/v1", "llm_model": "m"}, "must be given together"),
        ({"llm_url": "http://x/v1"}, "must be given together"),
        ({"llm_model": "m", "planner": "smt"}, "must be given together"),
        ({"pddl_engine": "pyperplan"}, "--pddl-engine requires --planner pddl"),
        ({"pddl_engine": "pyperplan", "planner": "smt"}, "--pddl-engine requires --planner pddl"),
        ({"planning_timeout": 1.0}, "--planning-timeout requires --planner smt, pddl or llm"),
        ({"planning_timeout": 1.0, "planner": "rules"}, "--planning-timeout requires"),
        ({"planning_timeout": 1.0, "composition": "all_at_once"}, "--planning-timeout requires"),
    ],
)
def test_options_that_contradict_each_other_are_usage_errors(given: dict[str, Any], message: str) -> None:
    with pytest.raises(UsageError, match=message):
        built(**given)


@pytest.mark.parametrize(
    ("within", "asked"),
    [(None, 8.0), (5.0, 4.0), (20.0, 8.0)],
)
def test_a_language_model_leaves_a_fifth_of_the_time_to_the_other_planner(
    within: float | None, asked: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("httpx", reason="needs `pip install '.[llm]'`")
    monkeypatch.setenv(LLM_KEY, "sk-1")
    planner = built(**LLM, planning_timeout=within)
    assert planner.name == "llm tiny"
    assert planner._within == pytest.approx(asked)
    assert planner._endpoint.api_key == "sk-1"
    assert type(planner._fallback) is RulePlanner


def test_a_language_model_falls_back_on_search_where_the_goal_is_not_the_tasks() -> None:
    pytest.importorskip("httpx", reason="needs `pip install '.[llm]'`")
    assert type(built(**LLM, goal="x")._fallback) is SmtPlanner


def test_without_its_library_no_language_model_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "aeros.agent.planning.llm_client", None)
    with pytest.raises(AgentError, match=r"--planner llm needs `pip install '\.\[llm\]'`"):
        built(**LLM)


def test_only_planners_that_search_have_a_time_limit() -> None:
    assert planning_timeout(options(planning_timeout=3.0), SmtPlanner(SITE)) == 3.0
    assert planning_timeout(options(), SmtPlanner(SITE)) == inf
    assert planning_timeout(options(planning_timeout=3.0), RulePlanner()) is None
    assert planning_timeout(options(), CompositionPlanner("x")) is None
