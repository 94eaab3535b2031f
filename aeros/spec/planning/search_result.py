"""What a search for plans keeps out of, and what it may say instead of a plan."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeAlias

from aeros.spec.closed_loop.invocation import State
from aeros.spec.planning.domain import GroundSkill

PlanPath: TypeAlias = list[tuple[State, GroundSkill]]
"""The steps of a plan, each with the state that it is to start in."""


class PlanUndecidedError(Exception):
    """Whether there is a plan was not found out; the message says why."""


@dataclass
class AvoidSet:
    """States without a way to the goal, and choices that may lead from a state to such a one."""

    states: set[State] = field(default_factory=set)
    pairs: set[tuple[State, GroundSkill]] = field(default_factory=set)
