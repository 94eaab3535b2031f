"""Planner of a run and its time limit, as the options select them."""

from __future__ import annotations

import argparse
import os
from math import inf
from typing import Final

from aeros.agent.errors import AgentError
from aeros.agent.planning.base import Planner, RulePlanner
from aeros.agent.planning.classical import UnifiedPlanningEngine
from aeros.agent.planning.compositions import CompositionPlanner
from aeros.agent.planning.pddl import PddlPlanner
from aeros.agent.planning.smt import SmtPlanner
from aeros.exit_codes import UsageError
from aeros.spec.diagnostics.codes import did_you_mean
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.site import Site

LLM_KEY: Final = "AEROS_LLM_KEY"
"""Environment variable that holds the key of the language model's API."""


def build_planner(arguments: argparse.Namespace, module: Ecm, site: Site) -> Planner:
    """Build the planner that the options select; without options, the task's planning rules.

    Args:
        arguments: Parsed options of `aeros run`.
        module: The module of the task.
        site: The site in force.

    Returns:
        The planner.

    Raises:
        UsageError: Options contradict each other.
        AgentError: A package is missing, or the composition does not exist.
    """
    composition, by_rules = arguments.composition, arguments.planner == "rules"
    if composition is not None and (arguments.planner or arguments.goal) is not None:
        raise UsageError("--composition cannot be combined with --planner or --goal")
    if arguments.goal is not None and by_rules:
        raise UsageError("--goal requires --planner smt, pddl or llm")
    of_llm = (arguments.planner == "llm", arguments.llm_url is not None, arguments.llm_model is not None)
    if any(of_llm) and not all(of_llm):
        raise UsageError("--planner llm, --llm-url and --llm-model must be given together")
    if arguments.pddl_engine is not None and arguments.planner != "pddl":
        raise UsageError("--pddl-engine requires --planner pddl")
    by_search = arguments.goal is not None or arguments.planner in ("smt", "pddl", "llm")
    if arguments.planning_timeout is not None and not by_search:
        raise UsageError("--planning-timeout requires --planner smt, pddl or llm")
    if arguments.planner == "llm":
        return _llm_planner(arguments, site)
    if arguments.planner == "pddl":
        return PddlPlanner(site, UnifiedPlanningEngine(arguments.pddl_engine))
    if by_search:
        return SmtPlanner(site)
    if composition is None:
        return RulePlanner()
    if composition not in module.compositions:
        near = did_you_mean(composition, module.compositions)
        hint = f"; did you mean `{near}`?" if near else ""
        raise AgentError(f"`{module.id}` has no composition `{composition}`{hint}")
    return CompositionPlanner(composition)


def _llm_planner(arguments: argparse.Namespace, site: Site) -> Planner:
    """Build the planner that asks a language model and falls back on rules or search.

    Raises:
        AgentError: The packages for language models are not installed.
    """
    try:
        from aeros.agent.planning.llm import LlmPlanner
        from aeros.agent.planning.llm_client import LlmEndpoint
    except ImportError as error:
        missing = f"({error.name} is missing)"
        raise AgentError(f"--planner llm needs `pip install 'aeros[llm]'` {missing}") from error
    endpoint = LlmEndpoint(arguments.llm_url, arguments.llm_model, os.environ.get(LLM_KEY))
    fallback = RulePlanner() if arguments.goal is None else SmtPlanner(site)
    # Leave time for the fallback planner.
    asked_within = 0.8 * min(arguments.planning_timeout or inf, float(site.limits.planning))
    return LlmPlanner(site, endpoint, fallback, asked_within)


def planning_timeout(arguments: argparse.Namespace, planner: Planner) -> float | None:
    """Return the time limit for one plan.

    Args:
        arguments: Parsed options of `aeros run`.
        planner: The planner.

    Returns:
        Seconds, while the plant's clock runs on; None for a planner that answers at once.
    """
    at_once = isinstance(planner, RulePlanner | CompositionPlanner)
    return None if at_once else arguments.planning_timeout or inf
