"""Results of a search for plans, and the states that it must avoid."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeAlias

from aeros.spec.closed_loop.invocation import State
from aeros.spec.planning.domain import GroundSkill

PlanPath: TypeAlias = list[tuple[State, GroundSkill]]
"""The steps of a plan, each with the state that it is to start in."""


class PlanUndecidedError(Exception):
    """A search that neither found a plan nor proved that there is none; the message says why."""


@dataclass
class AvoidSet:
    """States and choices from which the goal may become unreachable.

    Attributes:
        states: states without a path to the goal.
        pairs: pairs of a state and a choice that may lead from it to such a state.
    """

    states: set[State] = field(default_factory=set)
    pairs: set[tuple[State, GroundSkill]] = field(default_factory=set)
