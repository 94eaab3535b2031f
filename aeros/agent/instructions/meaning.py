"""Meaning of an instruction: requests in order, with their conditions, and prohibited tasks."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeAlias

from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import TaskGraph
from aeros.spec.diagnostics.codes import quoted
from aeros.spec.expr import terms as t
from aeros.spec.model.ecm import ActionCondition


@dataclass(frozen=True, slots=True)
class Errand:
    """One request of an instruction.

    Attributes:
        routed: the task that it asks for.
        condition: it is done only if this is measured as true at its turn; None for always.
        condition_text: the condition as the module declares it; empty if there is none.
        proposed_plan: unverified plan that came with the meaning, for its first plan; None if there is none.
        is_otherwise: True if it is done instead of the request before, whose condition is the opposite: the
            same measurement decides both.
    """

    routed: RoutedTask
    condition: t.Term | None = None
    condition_text: str = ""
    proposed_plan: TaskGraph | None = None
    is_otherwise: bool = False

    @property
    def goal_text(self) -> str:
        """The goal, after its condition if there is one."""
        goal = self.routed.task.goal_text
        if self.condition is None:
            return goal
        return f"{'otherwise, ' if self.is_otherwise else ''}if {self.condition_text}: {goal}"

    @property
    def formal_text(self) -> str:
        """Formal text: the task with its arguments, its goal and its condition."""
        text = f"{self.routed.formal_text}: {self.routed.task.goal_text}"
        if self.condition is None:
            return text
        return f"{text} ({'otherwise, ' if self.is_otherwise else ''}if {self.condition_text})"

    def otherwise(self, routed: RoutedTask) -> Errand:
        """Return the request that is done if the condition of this one does not hold.

        Args:
            routed: the task that it asks for.

        Returns:
            The request, which follows this one.
        """
        assert self.condition is not None  # noqa: S101 - the caller has checked
        text = self.condition_text
        is_plain = isinstance(self.condition, t.Not) and text.startswith("not (") and text.endswith(")")
        return Errand(
            routed,
            self.condition.operand if isinstance(self.condition, t.Not) else t.Not(self.condition),
            text.removeprefix("not (").removesuffix(")") if is_plain else f"not ({text})",
            is_otherwise=True,
        )


@dataclass(frozen=True, slots=True)
class Understanding:
    """Meaning of a whole instruction.

    Attributes:
        instruction: words of the user.
        errands: requests in the order in which they are done; at least one.
        prohibited: tasks that must not be done.
        source: who read it, for the audit record.
        account: for each phrase, the part of the meaning that it accounts for, if a model read it.
    """

    instruction: str
    errands: tuple[Errand, ...]
    prohibited: tuple[RoutedTask, ...] = ()
    source: str = "grammar"
    account: tuple[str, ...] = ()

    def __str__(self) -> str:
        return self.instruction

    @property
    def first(self) -> RoutedTask:
        """The task of the first request."""
        return self.errands[0].routed

    @property
    def formal_lines(self) -> tuple[str, ...]:
        """Formal text of each request in order, then of each prohibition."""
        return tuple(one.formal_text for one in self.errands) + tuple(
            f"never {routed.formal_text}" for routed in self.prohibited
        )


Spoken: TypeAlias = str | Understanding
"""An instruction: words of the user, or their meaning."""


def single_errand(understanding: Understanding) -> RoutedTask:
    """Return the task of an instruction that asks for exactly one, without a condition or prohibition.

    Args:
        understanding: meaning of the instruction.

    Returns:
        The task.

    Raises:
        InstructionError: it asks for more.
    """
    errands = understanding.errands
    if len(errands) == 1 and errands[0].condition is None and not understanding.prohibited:
        return errands[0].routed
    raise InstructionError(
        f"{quoted(understanding.instruction)} asks for more than one task: "
        f"{'; '.join(understanding.formal_lines)}; here, give an instruction for one task without conditions"
    )


def with_goal(understanding: Understanding, goal: ActionCondition) -> Understanding:
    """Replace the goal of the only task of an instruction.

    Args:
        understanding: meaning of the instruction.
        goal: the goal to pursue instead.

    Returns:
        The meaning with that goal.

    Raises:
        InstructionError: the instruction asks for several tasks.
    """
    if len(understanding.errands) != 1:
        raise InstructionError(
            f"a goal replaces that of one task, and {quoted(understanding.instruction)} asks for several"
        )
    (errand,) = understanding.errands
    task = replace(errand.routed.task, goal=goal.term, goal_text=goal.text)
    return replace(understanding, errands=(replace(errand, routed=replace(errand.routed, task=task)),))
