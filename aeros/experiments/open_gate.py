"""A gate that allows every action, and a site without policy: what an architecture does without AEROS.

For simulations only: nothing here decides whether an action is safe.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property

from aeros.runtime.gate.compiled.rules import MonitorRules
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import Caller, Decision, DecisionKind
from aeros.runtime.gate.joint_rules import ActiveAction
from aeros.runtime.gate.port import Gate
from aeros.runtime.ports import Readings
from aeros.skill import Action


class OpenGate(Gate):
    """Gate that allows every action as it is asked for, whatever else is under way."""

    def __init__(self, configuration: Configuration) -> None:
        # No decision, so nothing to compile.
        self._site = configuration.site

    @cached_property
    def monitor_rules(self) -> MonitorRules:
        """Rules of a site that the monitor is to watch."""
        return MonitorRules(self._site)

    def with_configuration(self, configuration: Configuration) -> OpenGate:
        """Implement `Gate.with_configuration`."""
        return OpenGate(configuration)

    def decide(
        self, caller: Caller, readings: Readings, action: Action, now: float, usage: Mapping[str, int]
    ) -> Decision:
        """Implement `Gate.decide`: allows the action as it is."""
        return Decision(DecisionKind.ALLOW, action, ())

    def decide_jointly(
        self, decision: Decision, readings: Readings, now: float, others: Sequence[ActiveAction]
    ) -> Decision:
        """Implement `Gate.decide_jointly`: returns `decision` as it is."""
        return decision


def without_policy(configuration: Configuration) -> Configuration:
    """Remove every rule from the site: nothing is decided, monitored or planned around.

    Args:
        configuration: modules under a site.

    Returns:
        The same modules, at a site without rules, blocks, quotas, histories and motion settings.
    """
    site = replace(
        configuration.site, rules=(), joint_rules=(), blocks=(), quotas=(), histories=(), motion=None
    )
    return replace(configuration, site=site)
