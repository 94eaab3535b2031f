"""The gate as everything around it sees it: one interface, whatever decides behind it.

The executor, experiments and tools are written against `Gate`.  `gate.CompiledGate` decides by the policy of
a site; `experiments.open_gate.OpenGate` allows everything.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from aeros.runtime.gate.compiled.rules import MonitorRules
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import Caller, Decision
from aeros.runtime.gate.joint_rules import ActiveAction
from aeros.runtime.ports import Readings
from aeros.skill import Action


class Gate(Protocol):
    """A gate that decides actions under one configuration, without input, output or a clock of its own."""

    @property
    def monitor_rules(self) -> MonitorRules:
        """The rules that monitors decide at every control tick of the actions that the gate allowed."""

    def with_configuration(self, configuration: Configuration) -> Gate:
        """Make a gate of the same kind for another configuration."""

    def decide(
        self, caller: Caller, readings: Readings, action: Action, now: float, usage: Mapping[str, int]
    ) -> Decision:
        """Decide whether one action may be executed now.

        Args:
            caller: the active module's skill that asks, with its inputs (SI).
            readings: value (SI) and time (s) of each state variable that is measured, by vocabulary name.
            action: the action that the skill asks for, parameters in SI.
            now: time of the decision on the clock of the readings, s.
            usage: for each quota on this kind of action, how many were executed in its window until now.

        Returns:
            ALLOW with the action, ATTENUATE with a reduced one, or DENY with every reason.
        """

    def decide_jointly(
        self, decision: Decision, readings: Readings, now: float, active_actions: Sequence[ActiveAction]
    ) -> Decision:
        """Decide an action together with those that are under way.

        Args:
            decision: what `decide` returned for the action by itself.
            readings: the readings that `decide` was given.
            now: the time that `decide` was given, s.
            others: the actions that are under way.

        Returns:
            `decision`, or a denial where the action may not begin while `active_actions` are under way.
        """
