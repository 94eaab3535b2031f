"""The gate's interface, as the executor, experiments and tools use it.

`gate.CompiledGate` decides by the policy of a site; `experiments.open_gate.OpenGate` allows everything.
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
        """The rules that monitors evaluate at every control tick for the actions that the gate allowed."""

    def with_configuration(self, configuration: Configuration) -> Gate:
        """Make a gate of the same kind for another configuration.

        Args:
            configuration: the configuration to enforce.

        Returns:
            The new gate; this one does not change.
        """

    def decide(
        self, caller: Caller, readings: Readings, action: Action, now: float, usage: Mapping[str, int]
    ) -> Decision:
        """Decide whether one action may be executed now.

        Args:
            caller: the active module's skill that asks, with its inputs (SI).
            readings: value (SI) and time (s) of each measured state variable, by vocabulary name.
            action: the requested action, parameters in SI.
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
            decision: the result of `decide` for the action by itself.
            readings: the readings that `decide` was given.
            now: the time that `decide` was given, s.
            active_actions: the actions that are under way.

        Returns:
            `decision`, or a denial if the action may not begin while `active_actions` are under way.
        """
