"""Runs of a composition inside the agent's loop, where it is an alternative of a capability.

It mirrors `aeros.agent.execution.plan_executor` on a graph of steps: from a state, every state in which the
graph may end, with its probability and the expected number of skills submitted on the way.  Equal states are
merged after each step, so paths that meet are followed once.

The branches of a `par` do not interfere, so together they succeed as if one ran after the other.  Where one
fails, the others may have come to any point.  Where the goal is reached in the midst of it, nothing more
starts, but what runs goes on, so the branches may end at any point, too.  Every such state is listed, with
probability 0: how likely it is depends on how long steps take.  What is missing of 1 is the probability of
all these states together.  So a loop with such a graph is proved, and its success is predicted within bounds.

A part under `hold` or within `timeout` may be stopped before each of its steps and after each, done or not.
These failures have probability 0, too.  A condition that a step itself ends breaks with the probability of
that.  A part whose steps cannot take longer than its `timeout`, by their declared durations, is never late;
of any other, nothing says how likely it is to be late.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import product
from operator import add, contains
from typing import Final, Literal

from aeros.spec.closed_loop.giving_up import RunHistory
from aeros.spec.closed_loop.invocation import Invocation, State, StateCondition, UnsettledError
from aeros.spec.closed_loop.loop_variables import StateSpaceError
from aeros.spec.expr import terms as t
from aeros.spec.model.composition import Composition, Part, Step, handler_cycle
from aeros.spec.model.hold_conditions import predicates_of
from aeros.spec.model.step_graph import (
    FailingPart,
    Fallback,
    HeldPart,
    If,
    Par,
    RetriedPart,
    Seq,
    StoppablePart,
    TimedPart,
    steps_of,
    walk_parts,
)

Role = Literal["step", "retry", "recovery"]
ROLES: Final[tuple[Role, ...]] = ("step", "retry", "recovery")

MAX_STATES: Final = 20_000
"""Largest number of states on the way of one run."""


@dataclass(frozen=True, slots=True)
class Weight:
    """Probability of a state, and expected numbers of submissions on the paths to it.

    Attributes:
        probability: probability that the run comes to the state (0 to 1).
        counts: for each role in `ROLES`, the sum over these paths of probability times submissions.
    """

    probability: Fraction
    counts: tuple[Fraction, ...] = (Fraction(0),) * len(ROLES)

    def __add__(self, other: Weight) -> Weight:
        return Weight(self.probability + other.probability, tuple(map(add, self.counts, other.counts)))

    def scaled(self, share: Fraction) -> Weight:
        """Multiply by the probability of an outcome.

        Args:
            share: probability (0 to 1).

        Returns:
            The product.
        """
        return Weight(self.probability * share, tuple(one * share for one in self.counts))

    def submitted(self, role: Role) -> Weight:
        """Count one submission on each path.

        Args:
            role: role of the skill that is submitted.

        Returns:
            The weight with one more submission.
        """
        counts = list(self.counts)
        counts[ROLES.index(role)] += self.probability
        return Weight(self.probability, tuple(counts))


Weights = dict[State, Weight]
NOTHING: Final = Weight(Fraction(0))


class RunTooLargeError(Exception):
    """A run comes through more than `MAX_STATES` states."""


class HandlerCycleError(StateSpaceError):
    """The handlers of a composition lead back to each other, so it may run for ever.

    Attributes:
        composition: the composition.
    """

    def __init__(self, composition: Composition) -> None:
        super().__init__(f"the handlers of `{composition.id}` lead back to each other")
        self.composition = composition


class _SkillRuns:
    """Runs of single skills on the way of a composition, and what they leave of the parts around them.

    Args:
        invoke: makes the invocation of a skill by its name, with constant inputs.
        is_over: tells whether the goal is reached, after which nothing more starts.
    """

    def __init__(
        self,
        invoke: Callable[[str, Mapping[str, object]], Invocation],
        is_over: Callable[[State], bool],
    ) -> None:
        self._invoke = invoke
        self._is_over = is_over
        self._invocations: dict[int, list[Invocation]] = {}
        self._stops: list[set[State]] = []
        self._held: list[tuple[StateCondition, Weights]] = []
        self._through: set[State] = set()
        self._starts: set[State] = set()

    def _still_held(self, ends: Weights) -> Weights:
        """Keep the states in which all conditions around hold, or the goal is reached."""
        for holds, unheld in self._held:
            broken = {one: weight for one, weight in ends.items() if not (self._is_over(one) or holds(one))}
            _add(unheld, broken)
            ends = {one: weight for one, weight in ends.items() if one not in broken}
        return ends

    def _try(self, step: Step, before: Weights, role: Role, done: Weights, unable: Weights) -> Weights:
        """Add the states after a success to `done`; return those after a failure."""
        failing: Weights = {}
        succeeded: Weights = {}
        for state, weight in before.items():
            able = [one for one in self._invocations_of(step) if one.can_start(state)]
            if self._is_over(state):
                _add(done, {state: weight})
            elif not able:
                _add(unable, {state: weight})
            if able:
                self._starts.add(state)
            for one in able if not self._is_over(state) else ():
                for stops in self._stops:
                    stops.update(_stopped(one, state))
                for after, outcome, share in one.after(state):
                    self._pass(after)
                    ended = weight.submitted(role).scaled(share / len(able))
                    _add(failing if outcome.failure else succeeded, {after: ended})
        _add(done, self._still_held(succeeded))
        return self._still_held(failing)

    def _invocations_of(self, step: Step) -> list[Invocation]:
        if id(step) not in self._invocations:
            self._invocations[id(step)] = [self._invoke(name, step.inputs) for name in step.runs]
        return self._invocations[id(step)]

    def _pass(self, state: State) -> None:
        self._through.add(state)
        if len(self._through) > MAX_STATES:
            raise RunTooLargeError


class ComposedRun(_SkillRuns):
    """Runs of one composition.

    Args:
        composition: the composition.
        invoke: makes the invocation of a skill by its name, with constant inputs.
        condition: makes a term a condition on states.
        is_over: tells whether the goal is reached, after which nothing more starts.
        stop: makes the invocation that stands for the stop of a part.
        is_late: tells whether a part may take longer than its time.
        uncertain: predicates that may be unknown although everything is measured: a branch whose condition
            reads one of them may fail, with probability 0.

    Raises:
        HandlerCycleError: its handlers lead back to each other.

    Attributes:
        is_exact: False once a parallel branch could fail, or the goal could be reached before all branches
            end: the probability of what follows is not known.
        is_open: True once a part could come to its time-out, or one order of parallel branches could end a
            condition around them: the probabilities are those of runs in which that does not happen.
        is_success_known: False if in the last run the goal could be reached before all branches ended. Else
            the probability of each state of a success is known, and what is missing of 1 is that of failures.
    """

    def __init__(
        self,
        composition: Composition,
        invoke: Callable[[str, Mapping[str, object]], Invocation],
        condition: Callable[[t.Term], StateCondition],
        is_over: Callable[[State], bool],
        stop: Callable[[StoppablePart[Step]], Invocation],
        is_late: Callable[[TimedPart[Step]], bool],
        uncertain: Collection[str] = (),
    ) -> None:
        if handler_cycle(composition):
            raise HandlerCycleError(composition)
        super().__init__(invoke, is_over)
        self._composition = composition
        self._condition = condition
        self._stop = stop
        self._is_late = is_late
        self._uncertain = {*uncertain}
        self._conditions: dict[int, StateCondition] = {}
        self._losses: dict[int, Invocation] = {}
        self._may_go_on = False
        self.is_exact = True
        self.is_success_known = True
        self.is_open = False

    @cached_property
    def is_settled(self) -> bool:
        """True if no outcome of it leaves a predicate at either value."""
        steps = (*steps_of(self._composition.body), *self._composition.handlers.values())
        return all(one.is_settled for step in steps for one in self._invocations_of(step))

    def run(self, state: State, role: Role) -> tuple[Weights, Weights, frozenset[State]]:
        """Run the composition from a state.

        Args:
            state: a value for each predicate.
            role: role of the first try of each of its steps.

        Returns:
            The states in which it has succeeded, those in which it has failed, and those on the way.

        Raises:
            RunTooLargeError: there are too many states on the way.
        """
        self._through = set()
        self.is_success_known = True
        failed: Weights = {}
        done = self._part(self._composition.body, {state: Weight(Fraction(1))}, role, failed)
        return done, failed, frozenset(self._through)

    def _part(self, part: Part, before: Weights, role: Role, failed: Weights) -> Weights:
        match part:
            case Step():
                return self._step(part, before, role, failed)
            case Seq(parts=parts):
                for one in parts:
                    before = self._part(one, before, role, failed)
                return before
            case If():
                return self._if(part, before, role, failed)
            case Par():
                return self._par(part, before, role, failed)
            case Fallback(parts=parts):
                return self._in_turn([(one, role) for one in parts], before, failed)
            case RetriedPart(part=one, retry=retry):
                again: list[tuple[Part, Role]] = [(one, "retry")] * retry
                return self._in_turn([(one, role), *again], before, failed)
            case StoppablePart():
                return self._stoppable(part, before, role, failed)
            case FailingPart():
                # Once the goal is reached, nothing starts, and nothing fails.
                done = {state: weight for state, weight in before.items() if self._is_over(state)}
                _add(failed, {state: weight for state, weight in before.items() if state not in done})
                return done

    def _in_turn(self, parts: Sequence[tuple[Part, Role]], before: Weights, failed: Weights) -> Weights:
        """Run parts, each where the one before has failed."""
        done: Weights = {}
        outer = self._may_go_on
        for number, (part, role) in enumerate(parts, 1):
            lost: Weights = {}
            self._may_go_on = outer or number < len(parts)
            _add(done, self._part(part, before, role, lost))
            self._may_go_on = outer
            if lost and any(isinstance(one, Par) for one in walk_parts(part)):
                # The probability of a failure of a `par` is not known, so neither is that of what follows.
                self.is_exact = self.is_success_known = False
            before = lost
        _add(failed, before)
        return done

    def _if(self, part: If[Step], before: Weights, role: Role, failed: Weights) -> Weights:
        holds = self._decider(part, part.condition)
        done = {state: weight for state, weight in before.items() if self._is_over(state)}
        left = {state: weight for state, weight in before.items() if state not in done}
        if not self._uncertain.isdisjoint(t.variables_of(part.condition)):
            _add(failed, dict.fromkeys(left, NOTHING))
        then = {state: weight for state, weight in left.items() if holds(state)}
        other = {state: weight for state, weight in left.items() if state not in then}
        _add(done, self._part(part.then, then, role, failed))
        if part.otherwise is None:
            _add(failed, other)
        else:
            _add(done, self._part(part.otherwise, other, role, failed))
        return done

    def _decider(self, part: If[Step] | HeldPart[Step], term: t.Term) -> StateCondition:
        if id(part) not in self._conditions:
            self._conditions[id(part)] = self._condition(term)
        return self._conditions[id(part)]

    def _stoppable(self, part: StoppablePart[Step], before: Weights, role: Role, failed: Weights) -> Weights:
        done = {state: weight for state, weight in before.items() if self._is_over(state)}
        kept = {state: weight for state, weight in before.items() if state not in done}
        around, unheld, lost = len(self._held), dict[State, Weight](), dict[State, Weight]()
        if isinstance(part, HeldPart):
            holds = self._decider(part, predicates_of(part.condition))
            _add(failed, {state: weight for state, weight in kept.items() if not holds(state)})
            kept = {state: weight for state, weight in kept.items() if holds(state)}
            self._held.append((holds, unheld))
        elif isinstance(part, TimedPart) and self._is_late(part):
            self.is_open = True
        self._stops.append(set(kept))
        _add(done, self._part(part.part, kept, role, lost))
        del self._held[around:]
        _add(failed, lost)
        _add(failed, unheld)
        if id(part) not in self._losses:
            self._losses[id(part)] = self._stop(part)
        for state in self._stops.pop():
            for after, _, _ in self._losses[id(part)].after(state):
                self._pass(after)
                _add(failed, {after: NOTHING})
        return done

    def _par(self, part: Par[Step], before: Weights, role: Role, failed: Weights) -> Weights:
        done: Weights = {}
        around, failing = self._held, dict[State, Weight]()
        for state, weight in before.items():
            # What the other branches have done decides, too, if a condition around all of them holds.
            self._held = []
            outer, alone = (self._through, self._starts), []
            for branch in part.branches:
                self._through, self._starts, lost = {state}, set(), dict[State, Weight]()
                ends = self._part(branch, {state: weight}, role, lost)
                visited = {*self._through, *ends, *lost}
                # Where a step starts that changes something, the branch may have come to its end, or not.
                ended = ends.keys() - (self._starts if len(visited) > 1 else set())
                alone.append((visited, lost, ended))
            self._through, self._starts = outer
            if any(lost for _, lost, _ in alone):
                self.is_exact = False
            points = [sorted(visited, key=repr) for visited, _, _ in alone]
            together = {combined: _merged(state, combined) for combined in product(*points)}
            for merged in together.values():
                self._pass(merged)
                # One order of the branches may break the condition, and another may not.
                self.is_open |= not all(holds(merged) for holds, _ in around)
            for stops in self._stops:
                stops.update(together.values())
            underway = {
                merged
                for combined, merged in together.items()
                if not all(map(contains, [ended for *_, ended in alone], combined))
            }
            self._starts |= underway
            if any(map(self._is_over, underway)):
                # Where the goal is reached on the way, each branch may stop at any point, or go on.
                self.is_exact = self.is_success_known = False
                _add(done, dict.fromkeys(together.values(), NOTHING))
                share = NOTHING
            else:
                share = weight
            for at, (_, lost, _) in enumerate(alone):
                others = [points[number] if number != at else list(lost) for number in range(len(points))]
                _add(failing, {_merged(state, combined): NOTHING for combined in product(*others)})
            ends, self._held = {state: share}, around
            for branch in part.branches:
                ends = self._part(branch, ends, role, {})
            _add(done, ends)
        _add(failed, self._still_held(failing))
        return done

    def _step(self, step: Step, before: Weights, role: Role, failed: Weights) -> Weights:
        done: Weights = {}
        lost: Weights = {}
        for number in range(step.retry + 1):
            failing = self._try(
                step, before, role if number == 0 else "retry", done, lost if number else failed
            )
            if step.last_handler is not None or self._may_go_on:
                # The agent's memory may leave out the tries that are left.
                _add(lost, dict.fromkeys(failing, NOTHING))
            before = failing
            if number < step.retry and step.between_tries is not None:
                handler = self._composition.handlers[step.between_tries]
                before = self._step(handler, failing, "recovery", lost)
        _add(lost, before)
        if step.last_handler is not None:
            over = {state: weight for state, weight in lost.items() if self._is_over(state)}
            _add(failed, over)
            lost = {state: weight for state, weight in lost.items() if state not in over}
            handler = self._composition.handlers[step.last_handler]
            _add(failed, self._step(handler, lost, "recovery", failed))
        else:
            _add(failed, lost)
        return done


def _stopped(invocation: Invocation, state: State) -> list[State]:
    """List the states that a stop in the midst of a skill may leave.

    Raises:
        StateSpaceError: there are too many.
    """
    try:
        return invocation.stopped(state)
    except UnsettledError as error:
        raise StateSpaceError(str(error)) from error


def _add(into: Weights, more: Mapping[State, Weight]) -> None:
    for state, weight in more.items():
        into[state] = into[state] + weight if state in into else weight


def _merged(base: State, states: Iterable[State]) -> State:
    """Apply to a state what each branch has changed of it."""
    merged = list(base)
    for state in states:
        for place, new in enumerate(state):
            old = base[place]
            if new != old:
                merged[place] = merged[place].with_branch(old, new) if isinstance(new, RunHistory) else new
    return tuple(merged)
