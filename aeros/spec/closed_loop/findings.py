"""Answers of an engine about the loop of a task, with a path for each fault that it finds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Protocol

from aeros.spec.closed_loop.invocation import State
from aeros.spec.closed_loop.transition_system import TransitionSystem
from aeros.spec.model.ecm import PlanningRule, TaskInvariant

MAX_SHOWN: Final = 12
"""Number of variables of which all values are shown."""


@dataclass(frozen=True, slots=True)
class LoopPath:
    """Path from a start of a loop to a state.

    Attributes:
        start: values of the variables at the start.
        labels: the skill and the measured outcome of each move on the way, in order.
        end: values at the end.
        inside: the composition inside which the end is; empty if it is between two moves.
    """

    start: State
    labels: tuple[str, ...]
    end: State
    inside: str = ""


@dataclass(frozen=True, slots=True)
class BlockedStep:
    """First try of a step that is due where a skill for it cannot start.

    Attributes:
        path: path to the state.
        rule: the rule whose step is due.
        skill: the skill, or composition, whose precondition does not hold.
    """

    path: LoopPath
    rule: PlanningRule
    skill: str


class LoopFindings(Protocol):
    """Answers of an engine about the loop of one task."""

    @property
    def system(self) -> TransitionSystem:
        """The loop."""

    @property
    def has_choices(self) -> bool:
        """True if the agent chooses between skills somewhere."""

    def blocked_step(self) -> BlockedStep | None:
        """Find a step that is due where a skill for it cannot start.

        Returns:
            One; None if there is none.
        """

    def dead_end(self) -> LoopPath | None:
        """Find a state before a plan from which the goal is out of reach.

        Returns:
            A path to one; None if there is none.
        """

    def violation(self, invariant: TaskInvariant) -> LoopPath | None:
        """Find a state that violates an invariant.

        Args:
            invariant: an invariant of the task.

        Returns:
            A path to one; None if there is none.
        """

    def starts_at_goal(self) -> bool:
        """Tell whether the goal holds at every start.

        Returns:
            True if it does.
        """


def format_path(system: TransitionSystem, path: LoopPath) -> str:
    """Describe a path for people.

    Args:
        system: the loop.
        path: the path.

    Returns:
        One line for the start, for each move with a label, and for the state at the end.  Of more than
        `MAX_SHOWN` variables, the start names false ones by their number, and the end those that changed.
    """
    start, end = (_values(system, state) for state in (path.start, path.end))
    shown_start, shown_end = list(start.values()), list(end.values())
    if len(start) > MAX_SHOWN:
        false = [name for name, value in system.named(path.start).items() if value is False]
        shown_start = [text for name, text in start.items() if name not in false]
        shown_start.append(f"and {len(false)} truth values false")
        shown_end = [text for name, text in end.items() if text != start[name]]
        shown_end.append("all else as at the start")
    inside = [f"{path.inside}, on its way"] if path.inside else []
    return "\n".join(
        [
            "for example:",
            f"start with {', '.join(shown_start)}",
            *path.labels,
            *inside,
            f"then {', '.join(shown_end)}",
        ]
    )


def _values(system: TransitionSystem, state: State) -> dict[str, str]:
    """Format the value of each variable as a manifest writes it."""
    return {name: system.variables.format(name, value) for name, value in system.named(state).items()}
