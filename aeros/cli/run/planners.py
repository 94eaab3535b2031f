"""Planner of a run and its time limit, as the options select them."""

from __future__ import annotations

import argparse
import os
from math import inf
from typing import TYPE_CHECKING, Final

from aeros.agent.errors import AgentError
from aeros.agent.planning.base import Planner, RulePlanner
from aeros.agent.planning.classical import UnifiedPlanningEngine
from aeros.agent.planning.compositions import CompositionPlanner
from aeros.agent.planning.pddl import PddlPlanner
from aeros.agent.planning.smt import SmtPlanner
from aeros.distribution import install_command
from aeros.exit_codes import UsageError
from aeros.spec.diagnostics.codes import did_you_mean
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.site import Site

if TYPE_CHECKING:
    from aeros.agent.planning.llm_client import LlmEndpoint

LLM_KEY: Final = "AEROS_LLM_KEY"
"""Environment variable that holds the key of the language model's API."""


def require_planner_options(arguments: argparse.Namespace) -> None:
    """Check the options of the planner.

    Args:
        arguments: Parsed options of `aeros run`.

    Raises:
        UsageError: Options contradict each other.
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
    if arguments.planning_timeout is not None and not _is_by_search(arguments):
        raise UsageError("--planning-timeout requires --planner smt, pddl or llm")


def _is_by_search(arguments: argparse.Namespace) -> bool:
    return arguments.goal is not None or arguments.planner in ("smt", "pddl", "llm")


def build_planner(
    arguments: argparse.Namespace, module: Ecm, site: Site, *, follows_rules: bool = True
) -> Planner:
    """Build the planner that the options select; without options, the task's planning rules.

    Args:
        arguments: Parsed options of `aeros run`.
        module: The module of the task.
        site: The site in force.
        follows_rules: True if planning rules lead to the goal of each task that is asked for.

    Returns:
        The planner.

    Raises:
        UsageError: Options contradict each other.
        AgentError: A package is missing, or the composition does not exist.
    """
    require_planner_options(arguments)
    composition = arguments.composition
    if arguments.planner == "llm":
        return _llm_planner(arguments, site, follows_rules=follows_rules and arguments.goal is None)
    if arguments.planner == "pddl":
        return PddlPlanner(site, UnifiedPlanningEngine(arguments.pddl_engine))
    if _is_by_search(arguments):
        return SmtPlanner(site)
    if composition is None:
        return RulePlanner()
    if composition not in module.compositions:
        near = did_you_mean(composition, module.compositions)
        hint = f"; did you mean `{near}`?" if near else ""
        raise AgentError(f"`{module.id}` has no composition `{composition}`{hint}")
    return CompositionPlanner(composition)


def _llm_planner(arguments: argparse.Namespace, site: Site, *, follows_rules: bool) -> Planner:
    """Build the planner that asks a language model and falls back on rules or search.

    Raises:
        AgentError: The packages for language models are not installed.
    """
    endpoint = llm_endpoint(arguments)
    from aeros.agent.planning.llm import LlmPlanner

    fallback = RulePlanner() if follows_rules else SmtPlanner(site)
    return LlmPlanner(site, endpoint, fallback, llm_timeout(arguments, site))


def llm_endpoint(arguments: argparse.Namespace) -> LlmEndpoint:
    """Return the address of the language model that the options name.

    Args:
        arguments: Parsed options of `aeros run`, with --llm-url and --llm-model.

    Returns:
        The address, with the key of the environment.

    Raises:
        AgentError: The packages for language models are not installed.
    """
    try:
        from aeros.agent.planning.llm_client import LlmEndpoint
    except ImportError as error:
        missing = f"({error.name} is missing)"
        raise AgentError(f"--planner llm needs {install_command('llm')} {missing}") from error
    return LlmEndpoint(arguments.llm_url, arguments.llm_model, os.environ.get(LLM_KEY))


def llm_timeout(arguments: argparse.Namespace, site: Site) -> float:
    """Return the time limit for a language model; it leaves time for another planner.

    Args:
        arguments: Parsed options of `aeros run`.
        site: The site in force.

    Returns:
        Seconds.
    """
    return 0.8 * min(arguments.planning_timeout or inf, float(site.limits.planning))


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
