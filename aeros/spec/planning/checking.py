"""A plan that somebody else made, judged by what skills declare, on its own.

It is accepted iff each step can start whatever successes the steps before it had, no outcome of a step,
failures included, leads where the goal cannot be reached any more, and the goal is reached at the end.
As in the agent's loop, nothing more is done once it is reached.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from aeros.spec.closed_loop.invocation import State
from aeros.spec.diagnostics import did_you_mean
from aeros.spec.planning.cyclic import Strategy
from aeros.spec.planning.domain import Choice, Domain
from aeros.spec.planning.pddl import action_name
from aeros.spec.planning.reasons import lacking


class UnreadablePlanError(Exception):
    """It is no plan; the message says where and why."""


def read_plan(text: str) -> tuple[str, ...]:
    """The steps of a plan as classical planners write them: `(step argument …)`, one a line; `;` comments."""
    steps = []
    for number, line in enumerate(text.splitlines(), 1):
        step = line.partition(";")[0].strip()
        if not step:
            continue
        if not (step.startswith("(") and step.endswith(")") and step[1:-1].split()):
            raise UnreadablePlanError(f"line {number}: expected a step in brackets, as in `(module.skill)`")
        steps.append(" ".join(step[1:-1].split()))
    return tuple(steps)


@dataclass(frozen=True)
class _Walk:
    """A plan under way through the states that its steps' successes lead to."""

    domain: Domain
    strategy: Strategy

    def problems(self, start: State, steps: Sequence[str]) -> Iterator[str]:
        """What is wrong with the first step at which anything is."""
        states = {start: None}
        for number, step in enumerate(steps, 1):
            choice = self._named(step)
            if isinstance(choice, str):
                yield f"step {number}, `{step}`: {choice}"
                return
            pending = [state for state in states if self.domain.goal(state) is not True]
            found = [text for state in pending for text in self._step(choice, state)]
            if found:
                yield from (f"step {number}, `{step}`: {text}" for text in found)
                return
            states = {
                then: None
                for state in pending
                for then, outcome, _ in self.domain.after(choice, state)
                if not outcome.failure
            } | {state: None for state in states if state not in pending}
        for state in states:
            if self.domain.goal(state) is not True:
                yield f"it ends, and the goal does not hold: {self.domain.shown(state)}"

    def _step(self, choice: Choice, state: State) -> Iterator[str]:
        if not self.domain.can_start(choice, state):
            shown, clause = self.domain.shown(state), choice.skill.precondition
            if clause is None or self.domain.condition(clause.term, choice)(state) is True:
                yield f"every action of a kind that it may ask for is denied where {shown}"
            else:
                yield f"its precondition `{clause.text}` does not hold where {shown}"
            return
        for then, outcome, _ in self.domain.after(choice, state):
            if not self.strategy.solves(then):
                why = lacking(self.domain, then, risky=True)
                yield f"`{outcome.id}` leads to {self.domain.shown(then)}, and there {why}"

    def _named(self, step: str) -> Choice | str:
        labels = {choice.label.casefold(): choice for choice in self.domain.choices}
        for choice in self.domain.choices:
            labels |= dict.fromkeys(
                (action_name(choice, o).casefold() for o in choice.skill.outcomes), choice
            )
        if step.casefold() in labels:
            return labels[step.casefold()]
        if step in self.domain.left_out:
            return self.domain.left_out[step]
        near = did_you_mean(step, [choice.label for choice in labels.values()])
        return "no such skill" + (f"; did you mean `{near}`?" if near else "")


def problems_of(strategy: Strategy, start: State, steps: Sequence[str]) -> list[str]:
    """Why not to follow the plan from `start`; empty iff it is accepted.  Raises `NotDecidedError`."""
    return [*_Walk(strategy.domain, strategy).problems(start, steps)]
