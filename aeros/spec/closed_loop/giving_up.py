"""Giving up: the rule by which the agent ends a run whose failures chance does not explain, and its history.

Failures of skills in one measured state, since each of them last succeeded, are a *streak*.  If a failure of
skill k is expected with probability q_k, and k failed n_k times, chance does that with probability

    L = prod over k of prod for i < n_k of (4 q_k + i) / (4 + i)

(Beta-binomial: q_k counts as `PRIOR_TRIES` results, as memory weighs a declared probability.)  The failure
that brings L below `LEAST_CHANCE`, and is at least number `LEAST_FAILURES` of its skill, ends the run.  So a
skill that is expected to fail in 2 % of its tries is given up after 4 failures, one of 5 % after 6, one of
10 % after 8, one of 30 % after 21, and one of 50 % only after 75, which is more than a task's budget.

The agent uses `is_beyond_chance`.  `RunRule` follows the same rule through the states of a transition system:
a state then ends with a `RunHistory`.  Assumes that a failure changes no quantity by more than its
uncertainty, as the agent counts failures of several skills together only where nothing has changed.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import lru_cache
from math import prod
from typing import Any, Final, NamedTuple

from aeros.spec.closed_loop.outcome_probabilities import outcome_probabilities
from aeros.spec.model.ecm import Ecm, Outcome, Skill

LEAST_CHANCE: Final = Fraction(1, 1000)
"""Probability by chance below which a streak has another cause."""

LEAST_FAILURES: Final = 3
"""Failures of the step in the streak before it can be given up: twice may be a bad look."""

PRIOR_TRIES: Final = 4
"""Number of results that a declared probability counts as."""

MOST_FINISHED: Final = 3
"""Times that the same plan may be carried out, and leave the same state, before the run ends."""

MOST_NOT_STARTED: Final = 2
"""Times that a plan may begin with a step that cannot start in the state in which the plan was made."""


def failure_probability(skill: Skill) -> Fraction:
    """Add up the probabilities of the failures of a skill.

    Args:
        skill: the skill.

    Returns:
        A probability in [0, 1].
    """
    shares = outcome_probabilities(skill.outcomes.values())
    return sum((share for outcome, share in shares if outcome.failure), Fraction(0))


@lru_cache(1024)
def chance_of_failures(expected: Fraction, times: int) -> Fraction:
    """Compute the probability that a skill fails several times in a row by chance.

    Args:
        expected: expected probability of a failure, in [0, 1].
        times: number of failures.

    Returns:
        The factor of one skill in L.
    """
    parts = ((PRIOR_TRIES * expected + more) / (PRIOR_TRIES + more) for more in range(times))
    return prod(parts, start=Fraction(1))


def chance_of_streak(failures: Iterable[tuple[Fraction, int]]) -> Fraction:
    """Compute L.

    Args:
        failures: for each skill the expected probability of a failure, and the number of its failures.

    Returns:
        A probability in [0, 1].
    """
    return prod((chance_of_failures(*one) for one in failures), start=Fraction(1))


def is_beyond_chance(times: int, failures: Iterable[tuple[Fraction, int]]) -> bool:
    """Decide if another try of a skill that has just failed is no use.

    Args:
        times: number of its failures in the streak.
        failures: of all skills in the streak, as for `chance_of_streak`.

    Returns:
        True if chance does not explain the streak.
    """
    return times >= LEAST_FAILURES and chance_of_streak(failures) < LEAST_CHANCE


@dataclass(frozen=True, slots=True)
class AgentBeliefs:
    """The failures that the agent expects, whatever the probabilities of the loop are.

    Attributes:
        failure: expected probability of a failure, by skill.
        names: the skill that the agent runs, where the loop has another name for it.
        hidden: state variables of the loop that the agent does not measure.
        in_any_state: failures in all states are one streak, so that a run ends no later than the agent's own.
        counted_skill: a skill whose tries are counted; empty for none.
        most_tries: number of its tries after which the run ends at the next; None for no limit.
    """

    failure: Mapping[str, Fraction]
    names: Mapping[str, str] = field(default_factory=dict)
    hidden: frozenset[str] = frozenset()
    in_any_state: bool = False
    counted_skill: str = ""
    most_tries: int | None = None


def declared_beliefs(ecm: Ecm) -> AgentBeliefs:
    """Make the beliefs of an agent that expects what a module declares.

    Args:
        ecm: the module as the agent has it.

    Returns:
        The beliefs.
    """
    return AgentBeliefs({name: failure_probability(skill) for name, skill in ecm.callable_skills.items()})


class RunHistory(NamedTuple):
    """Everything that the rule remembers of a run.

    Attributes:
        failures: predicates before them, skill and number of the failures of each streak.
        verdicts: skill and outcome of each verdict.
        plan: the present plan, by the indices of its rules; empty between plans.
        planned_in: predicates in which it was made.
        finished: plans that were carried out without the goal, the predicates after them and how often.
        not_started: rules whose step could not start where the plan was made, and the predicates.
        tries: tries of the counted skill.
        gave_up: the last step gave the run up.
    """

    failures: frozenset[tuple[tuple[Any, ...], str, int]] = frozenset()
    verdicts: frozenset[tuple[str, str]] = frozenset()
    plan: tuple[int, ...] = ()
    planned_in: tuple[Any, ...] = ()
    finished: frozenset[tuple[tuple[int, ...], tuple[Any, ...], int]] = frozenset()
    not_started: frozenset[tuple[int, tuple[Any, ...]]] = frozenset()
    tries: int = 0
    gave_up: bool = False

    def with_branch(self, before: RunHistory, after: RunHistory) -> RunHistory:
        """Add what another branch of a `par` did, at a point that both may have come to together.

        Args:
            before: history before the `par`, from which this one comes, too.
            after: history at a point of the other branch.

        Returns:
            A history with the failures of both. Nothing says which came first, so the run counts as given up
            wherever it may have been.
        """
        mine, others = self.failures - before.failures, after.failures - before.failures
        joint = (self.failures & after.failures) | mine | others
        is_long = any(one[2] >= LEAST_FAILURES for one in joint)
        gave_up = self.gave_up or after.gave_up or (bool(mine) and bool(others) and is_long)
        verdicts = self.verdicts | after.verdicts
        return self._replace(
            failures=joint, verdicts=verdicts, tries=max(self.tries, after.tries), gave_up=gave_up
        )


class RunRule:
    """The rule of giving up in the states of a loop, whose last value is a `RunHistory`.

    Args:
        beliefs: the failures that the agent expects.
        predicates: places of the predicates in a state.
        choices: skills of which another may be tried instead, so that giving one up does not end the run.
    """

    def __init__(self, beliefs: AgentBeliefs, predicates: Sequence[int], choices: Iterable[str]) -> None:
        self._beliefs = beliefs
        self._predicates = tuple(predicates)
        self._choices = frozenset(choices)

    def has_ended(self, state: Sequence[Any]) -> bool:
        """Tell if the run was given up.

        Args:
            state: a state with its history.

        Returns:
            True if nothing more starts.
        """
        history: RunHistory = state[-1]
        return history.gave_up

    def is_spent(self, state: Sequence[Any], skill: str) -> bool:
        """Tell if another try of a skill is more than the run may make.

        Args:
            state: a state with its history.
            skill: name of the skill.

        Returns:
            True if the run ends before it.
        """
        history: RunHistory = state[-1]
        beliefs = self._beliefs
        return beliefs.most_tries is not None and (
            self._name(skill) == beliefs.counted_skill and history.tries >= beliefs.most_tries
        )

    def after_step(self, before: Sequence[Any], skill: str, outcome: Outcome) -> RunHistory:
        """Note how a step ended.

        Args:
            before: the state before it.
            skill: name of the skill.
            outcome: the outcome that was measured.

        Returns:
            The history after it.
        """
        history: RunHistory = before[-1]
        name = self._name(skill)
        if name == self._beliefs.counted_skill and self._beliefs.most_tries is not None:
            history = history._replace(tries=history.tries + 1)
        if not outcome.failure:
            kept = frozenset(one for one in history.failures if one[1] != name)
            return history._replace(failures=kept)
        if skill in self._choices:
            return history
        if outcome.verdict:
            verdict = (name, outcome.id)
            gave_up = verdict in history.verdicts
            history = history._replace(verdicts=history.verdicts | {verdict}, gave_up=gave_up)
        here = self._predicates_of(before)
        streak = {failed: times for state, failed, times in history.failures if state == here}
        streak[name] = streak.get(name, 0) + 1
        expected = self._beliefs.failure
        if is_beyond_chance(streak[name], [(expected[failed], times) for failed, times in streak.items()]):
            return history._replace(failures=frozenset(), gave_up=True)
        others = {one for one in history.failures if one[:2] != (here, name)}
        return history._replace(failures=frozenset(others | {(here, name, streak[name])}))

    def continued(self, state: tuple[Any, ...]) -> tuple[Any, ...]:
        """Take back that the run is given up, as the failed step is done all the same.

        Args:
            state: state after the step.

        Returns:
            The state with its history.
        """
        return (*state[:-1], state[-1]._replace(gave_up=False))

    def begin(self, state: tuple[Any, ...]) -> tuple[Any, ...]:
        """Add the history of a run that begins to a state.

        Args:
            state: a value for each state variable.

        Returns:
            The state with its history.
        """
        return (*state, RunHistory())

    def planned(self, state: tuple[Any, ...], plan: tuple[int, ...]) -> tuple[Any, ...]:
        """Note a new plan.

        Args:
            state: state in which it is made.
            plan: indices of its rules; empty where the plan before has ended.

        Returns:
            The state with its history.
        """
        here = self._predicates_of(state) if plan else ()
        return (*state[:-1], state[-1]._replace(plan=plan, planned_in=here))

    def finished(self, state: tuple[Any, ...]) -> tuple[Any, ...]:
        """Note that the plan was carried out without reaching the goal.

        Args:
            state: state after it.

        Returns:
            The state with its history.
        """
        history: RunHistory = state[-1]
        key = (history.plan, self._predicates_of(state))
        times = 1 + next((one[2] for one in history.finished if one[:2] == key), 0)
        if times >= MOST_FINISHED:
            return (*state[:-1], history._replace(gave_up=True))
        others = frozenset(one for one in history.finished if one[:2] != key)
        return (*state[:-1], history._replace(finished=others | {(*key, times)}))

    def not_started(self, state: tuple[Any, ...], rule: int) -> tuple[Any, ...]:
        """Note that a step could not start.

        Args:
            state: the state.
            rule: index of its rule.

        Returns:
            The state with its history.
        """
        history: RunHistory = state[-1]
        key = (rule, self._predicates_of(state))
        if key[1] != history.planned_in:
            return state
        if key in history.not_started:
            return (*state[:-1], history._replace(gave_up=True))
        return (*state[:-1], history._replace(not_started=history.not_started | {key}))

    def _name(self, skill: str) -> str:
        return self._beliefs.names.get(skill, skill)

    def _predicates_of(self, state: Sequence[Any]) -> tuple[Any, ...]:
        return tuple([state[place] for place in self._predicates])
