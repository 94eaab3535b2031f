"""A gate that lets everything pass, and a site without policy: what an architecture does on its own.

For simulations alone: whatever decides there, nothing here does.
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
    """A gate that allows every action as it is asked for, whatever is under way."""

    def __init__(self, configuration: Configuration) -> None:
        # Nothing is compiled, as nothing is decided.
        self._site = configuration.site

    @cached_property
    def monitor_rules(self) -> MonitorRules:
        """See `Gate`."""
        return MonitorRules(self._site)

    def with_configuration(self, configuration: Configuration) -> OpenGate:
        """See `Gate`."""
        return OpenGate(configuration)

    def decide(
        self, caller: Caller, readings: Readings, action: Action, now: float, usage: Mapping[str, int]
    ) -> Decision:
        """Allow the action as it is."""
        return Decision(DecisionKind.ALLOW, action, ())

    def decide_jointly(
        self, decision: Decision, readings: Readings, now: float, others: Sequence[ActiveAction]
    ) -> Decision:
        """Return `decision` as it is."""
        return decision


def without_policy(configuration: Configuration) -> Configuration:
    """The same modules at a site that has no rule to decide, to monitor or to plan motions by."""
    site = replace(
        configuration.site, rules=(), joint_rules=(), blocks=(), quotas=(), histories=(), motion=None
    )
    return replace(configuration, site=site)
