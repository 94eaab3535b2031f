"""Giving up: the rule by which the agent ends a run whose failures chance does not explain, and its history.

Failures of skills in one measured state, since each of them last succeeded, are a *streak*.  If a failure of
skill k is expected with probability q_k, and k failed n_k times, chance does that with probability

    L = prod over k of prod for i < n_k of (4 q_k + i) / (4 + i)

(Beta-binomial: q_k counts as `PRIOR_TRIES` results, as memory weighs a declared probability.)  The failure
that brings L below `LEAST_CHANCE`, and is at least number `LEAST_FAILURES` of its skill, ends the run.  So a
skill that is expected to fail in 2 % of its tries is given up after 4 failures, one of 5 % after 6, one of
10 % after 8, one of 30 % after 21, and one of 50 % only after 75, which is more than a task's budget.

Finished plans are judged alike.  A plan that is carried out without reaching the goal, and leaves the same
predicates as the time before, is expected to do so with the probability of the least likely of its successes
(`success_probability`); n such times in a row have a factor as above.  Where each success was certain, or no
step ran, no probability says that the plan may end otherwise: then time `MOST_FINISHED` is the last.

The agent uses `is_beyond_chance`.  `RunRule` follows the same rule through the states of a transition system:
a state then ends with a `RunHistory`.  Assumes that a failure changes no quantity by more than its
uncertainty, as the agent counts failures of several skills together only where nothing has changed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import lru_cache
from math import prod
from typing import Any, Final, NamedTuple

from aeros.spec.closed_loop.outcome_probabilities import outcome_probabilities
from aeros.spec.expr.effects import value_after
from aeros.spec.model.ecm import Ecm, Outcome, Skill

LEAST_CHANCE: Final = Fraction(1, 1000)
"""Probability by chance below which a streak has another cause."""

LEAST_FAILURES: Final = 3
"""Failures of the step in the streak before it can be given up: twice may be a bad look."""

PRIOR_TRIES: Final = 4
"""Number of results that a declared probability counts as."""

MOST_FINISHED: Final = 3
"""Times that the same plan may be carried out, and leave the same state, where no other end is declared."""

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


def success_probability(skill: Skill, is_measured: Callable[[Outcome], bool]) -> Fraction:
    """Compute the probability that a success of a skill has the effects that were measured.

    Args:
        skill: the skill.
        is_measured: tells if all effects of an outcome were measured.

    Returns:
        The share of the measured outcomes in the probability of all successes, in [0, 1]; 1 if a success has
        no probability.
    """
    shares = outcome_probabilities(skill.outcomes.values())
    successes = [(outcome, share) for outcome, share in shares if not outcome.failure]
    whole = sum((share for _, share in successes), Fraction(0))
    measured = sum((share for outcome, share in successes if is_measured(outcome)), Fraction(0))
    return measured / whole if whole else Fraction(1)


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


class FinishedStreak(NamedTuple):
    """Times in a row that a plan was carried out without reaching the goal, and left the same predicates.

    Attributes:
        times: their number.
        chance: probability of that by chance, in [0, 1].
    """

    times: int = 0
    chance: Fraction = Fraction(1)

    def with_finish(self, expected: Fraction) -> FinishedStreak:
        """Count another time.

        Args:
            expected: probability of the least likely of the successes of the plan, in [0, 1].

        Returns:
            The longer streak.
        """
        part = (PRIOR_TRIES * expected + self.times) / (PRIOR_TRIES + self.times)
        return FinishedStreak(self.times + 1, self.chance * part)

    @property
    def is_useless(self) -> bool:
        """True if carrying out the plan once more is no use."""
        return self.times >= MOST_FINISHED and (self.chance == 1 or self.chance < LEAST_CHANCE)


@dataclass(frozen=True, slots=True)
class AgentBeliefs:
    """The outcomes that the agent expects, whatever the probabilities of the loop are.

    Attributes:
        skills: skills by name, with the probabilities that the agent expects.
        names: the skill that the agent runs, where the loop has another name for it.
        hidden: state variables of the loop that the agent does not measure.
        in_any_state: failures in all states are one streak, and the third finish of a plan is the last, so
            that a run ends no later than the agent's own.
        counted_skill: a skill whose tries are counted; empty for none.
        most_tries: number of its tries after which the run ends at the next; None for no limit.
    """

    skills: Mapping[str, Skill]
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
    return AgentBeliefs(ecm.callable_skills)


class RunHistory(NamedTuple):
    """Everything that the rule remembers of a run.

    Attributes:
        failures: predicates before them, skill and number of the failures of each streak.
        verdicts: skill and outcome of each verdict.
        plan: the present plan, by the indices of its rules; empty between plans.
        planned_in: predicates in which it was made.
        least_likely: probability of the least likely of its successes.
        finished: each plan that was carried out without the goal, the predicates after the last time, and
            the times in a row that it left them.
        not_started: rules whose step could not start where the plan was made, and the predicates.
        tries: tries of the counted skill.
        gave_up: the last step gave the run up.
    """

    failures: frozenset[tuple[tuple[Any, ...], str, int]] = frozenset()
    verdicts: frozenset[tuple[str, str]] = frozenset()
    plan: tuple[int, ...] = ()
    planned_in: tuple[Any, ...] = ()
    least_likely: Fraction = Fraction(1)
    finished: frozenset[tuple[tuple[int, ...], tuple[Any, ...], FinishedStreak]] = frozenset()
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
            failures=joint,
            verdicts=verdicts,
            least_likely=min(self.least_likely, after.least_likely),
            tries=max(self.tries, after.tries),
            gave_up=gave_up,
        )


class RunRule:
    """The rule of giving up in the states of a loop, whose last value is a `RunHistory`.

    Args:
        beliefs: the outcomes that the agent expects.
        names: names of the state variables, in the order of a state.
        predicates: places of the predicates in a state.
        choices: skills of which another may be tried instead, so that giving one up does not end the run.
    """

    def __init__(
        self,
        beliefs: AgentBeliefs,
        names: Iterable[str],
        predicates: Sequence[int],
        choices: Iterable[str],
    ) -> None:
        self._beliefs = beliefs
        self._failure = {name: failure_probability(skill) for name, skill in beliefs.skills.items()}
        self._places = {name: place for place, name in enumerate(names)}
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

    def after_step(
        self, before: Sequence[Any], skill: str, outcome: Outcome, after: Sequence[Any]
    ) -> RunHistory:
        """Note how a step ended.

        Args:
            before: the state before it.
            skill: name of the skill.
            outcome: the outcome that was measured.
            after: the values after it.

        Returns:
            The history after it.
        """
        history: RunHistory = before[-1]
        name = self._name(skill)
        if name == self._beliefs.counted_skill and self._beliefs.most_tries is not None:
            history = history._replace(tries=history.tries + 1)
        if not outcome.failure:
            kept = frozenset(one for one in history.failures if one[1] != name)
            likely = success_probability(
                self._beliefs.skills[name], lambda one: self._is_measured(one, before, after)
            )
            return history._replace(failures=kept, least_likely=min(history.least_likely, likely))
        if skill in self._choices:
            return history
        if outcome.verdict:
            verdict = (name, outcome.id)
            gave_up = verdict in history.verdicts
            history = history._replace(verdicts=history.verdicts | {verdict}, gave_up=gave_up)
        here = self._predicates_of(before)
        streak = {failed: times for state, failed, times in history.failures if state == here}
        streak[name] = streak.get(name, 0) + 1
        expected = self._failure
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
        return (*state[:-1], state[-1]._replace(plan=plan, planned_in=here, least_likely=Fraction(1)))

    def finished(self, state: tuple[Any, ...]) -> tuple[Any, ...]:
        """Note that the plan was carried out without reaching the goal.

        Args:
            state: state after it.

        Returns:
            The state with its history.
        """
        history: RunHistory = state[-1]
        plan, here = history.plan, self._predicates_of(state)
        before = (one for one in history.finished if one[:2] == (plan, here))
        streak = next((one[2] for one in before), FinishedStreak()).with_finish(history.least_likely)
        if streak.is_useless or (self._beliefs.in_any_state and streak.times >= MOST_FINISHED):
            return (*state[:-1], history._replace(gave_up=True))
        others = frozenset(one for one in history.finished if one[0] != plan)
        return (*state[:-1], history._replace(finished=others | {(plan, here, streak)}))

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

    def _is_measured(self, outcome: Outcome, before: Sequence[Any], after: Sequence[Any]) -> bool:
        """Tell if the effects of an outcome that the agent expects hold in a state."""
        places = self._places
        effects = ((places[name], effect) for name, effect in outcome.effects.items())
        return all(after[place] == value_after(effect, before[place]) for place, effect in effects) and all(
            one.low <= after[places[one.name]] <= one.high for one in outcome.ranges if one.name in places
        )

    def _name(self, skill: str) -> str:
        return self._beliefs.names.get(skill, skill)

    def _predicates_of(self, state: Sequence[Any]) -> tuple[Any, ...]:
        return tuple([state[place] for place in self._predicates])
