"""Check of a given plan by the declarations of skills alone.

The plan is accepted iff each step can start after any successes of the steps before it, no outcome of a step
(failures and their recoveries included) leads to a state from which the goal cannot be reached, conditions
are known where they are evaluated, and the goal is reached at the end. As in the agent's loop, nothing more
is done once the goal is reached, and a step that fails for good ends the plan. Other executors run every step
of a plan: `every_step` checks the steps after the goal, too, and asks for the goal after the last of them.

Where each step has one outcome, a success, a plan that reaches the goal is itself the proof that the goal can
be reached from each state on the way, so nothing is searched.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from aeros.spec.closed_loop.invocation import State
from aeros.spec.diagnostics.codes import did_you_mean
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import Environment
from aeros.spec.model.step_graph import If, Par, Part, Seq, steps_of
from aeros.spec.planning.domain import GroundSkill, PartialCondition, PlanningDomain
from aeros.spec.planning.pddl import action_name
from aeros.spec.planning.strong_cyclic import StrongCyclicStrategy
from aeros.spec.planning.unreachability import unreachability_reasons


class UnreadablePlanError(Exception):
    """Text that is not a plan; the message says where and why."""


def read_plan(text: str) -> tuple[str, ...]:
    """Read a plan as classical planners write it: `(step argument …)`, one per line; `;` starts a comment.

    Args:
        text: text of the plan.

    Returns:
        The steps, without brackets.

    Raises:
        UnreadablePlanError: a line is not a step.
    """
    steps = []
    for number, line in enumerate(text.splitlines(), 1):
        step = line.partition(";")[0].strip()
        if not step:
            continue
        if not (step.startswith("(") and step.endswith(")") and step[1:-1].split()):
            raise UnreadablePlanError(f"line {number}: expected a step in brackets, as in `(module.skill)`")
        steps.append(" ".join(step[1:-1].split()))
    return tuple(steps)


@dataclass(frozen=True, eq=False)
class PlannedStep:
    """A step of a plan to be checked.

    Attributes:
        name: name for messages.
        choices: skills with inputs, any of which may run.
        rejected_choices: reason that the step can run nothing; empty if it can.
        retry: number of repetitions of a failed attempt.
        recovery_choices: skills that may run between two attempts.
        last_choices: skills that may run after the last attempt has failed.
        skip_condition: the step is skipped if this is measured as true.
        alternatives: where some of `choices` cannot start, one of the others runs; else all must be able to.
    """

    name: str
    choices: tuple[GroundSkill, ...]
    rejected_choices: str = ""
    retry: int = 0
    recovery_choices: tuple[GroundSkill, ...] = ()
    last_choices: tuple[GroundSkill, ...] = ()
    skip_condition: t.Term | None = None
    alternatives: bool = False


class _PlanProblemError(Exception):
    """The problems of the first step that has any."""

    def __init__(self, problems: list[str]) -> None:
        super().__init__()
        self.problems = problems


States = dict[State, None]


class _PlanSimulation:
    """Simulation of a plan on all states that the successes of its steps lead to.

    With `searches`, the goal is searched from each state on the way; without, `is_settled` says whether the
    result is the same: every step had one outcome, a success.
    """

    def __init__(
        self,
        strategy: StrongCyclicStrategy,
        known: Environment,
        plan: Part[PlannedStep],
        *,
        every_step: bool,
        searches: bool,
    ) -> None:
        self.is_settled = True
        self._strategy = strategy
        self._domain = strategy.domain
        self._known = known
        self._every_step = every_step
        self._searches = searches
        self._numbers = {id(step): number for number, step in enumerate(steps_of(plan), 1)}

    def simulate(self, part: Part[PlannedStep], states: States) -> States:
        """Compute the states in which `part` may end, from `states`.

        Raises:
            _PlanProblemError: the part cannot be carried out, or cannot be checked.
        """
        there: States = {}
        if not self._every_step:
            there = {state: None for state in states if self._domain.goal(state) is True}
        pending = {state: None for state in states if state not in there}
        if not pending:
            return states
        match part:
            case Seq(parts=parts):
                for one in parts:
                    pending = self.simulate(one, pending)
                return there | pending
            case If():
                return there | self._if(part, pending)
            case PlannedStep():
                return there | self._step(part, pending)
            case Par():
                raise _PlanProblemError(["parallel branches cannot be checked"])
            case _:
                raise _PlanProblemError(["alternatives and tries of a part cannot be checked"])

    def _if(self, part: If[PlannedStep], states: States) -> States:
        condition = self._condition(part.condition)
        found: States = {}
        for holds, way in ((True, part.then), (False, part.otherwise)):
            here = {state: None for state in states if condition(state) is holds}
            if here and way is None:
                shown = self._domain.format_state(next(iter(here)))
                raise _PlanProblemError(
                    [f"the plan does not say how to continue if `{part.text}` does not hold: {shown}"]
                )
            if here and way is not None:
                found |= self.simulate(way, here)
        unknown = next((state for state in states if condition(state) is None), None)
        if unknown is not None:
            shown = self._domain.format_state(unknown)
            raise _PlanProblemError([f"`if {part.text}`: the condition is unknown where {shown}"])
        return found

    def _step(self, step: PlannedStep, states: States) -> States:
        needless = None if step.skip_condition is None else self._condition(step.skip_condition)
        after: States = {}
        problems: list[str] = []
        for state in states:
            if needless is not None and needless(state) is True:
                after[state] = None
                continue
            unable = [choice for choice in step.choices if not self._domain.can_start(choice, state)]
            if step.alternatives and len(unable) < len(step.choices):
                unable = []
            problems += [self._start_problem(choice, state) for choice in unable]
            if not problems:
                problems += self._retry_problems(step, state, after)
        if problems:
            number = self._numbers[id(step)]
            raise _PlanProblemError(
                [f"step {number}, `{step.name}`: {text}" for text in dict.fromkeys(problems)]
            )
        return after

    def _retry_problems(self, step: PlannedStep, state: State, successes: States) -> Iterator[str]:
        """Yield the outcomes of any attempt or recovery from which the goal cannot be reached.

        Any failed attempt may be the last: the agent's memory may leave out those that are left.
        """
        here: States = {state: None}
        for left in range(step.retry, -1, -1):
            failed: States = {}
            for one in here:
                for then, is_failure, problem in self._outcomes(step.choices, one):
                    (failed if is_failure else successes)[then] = None
                    if problem:
                        yield problem
            for one in failed:
                yield from (problem for *_, problem in self._outcomes(step.last_choices, one) if problem)
            here = dict(failed) if left else {}
            for one in failed if left else ():
                for then, _, problem in self._outcomes(step.recovery_choices, one):
                    here[then] = None
                    if problem:
                        yield problem

    def _outcomes(self, choices: Sequence[GroundSkill], state: State) -> Iterator[tuple[State, bool, str]]:
        """Yield each state that `choices` may lead to, True for a failure, and the problem with it."""
        for choice in choices:
            if not self._domain.can_start(choice, state):
                continue
            after = self._domain.after(choice, state)
            self.is_settled &= len(after) == 1 and not after[0][1].failure
            for then, outcome, _ in after:
                yield then, outcome.failure, self._loss(then, outcome.id)

    def _loss(self, then: State, outcome: str) -> str:
        """Return the reason that the goal is lost in `then`; empty if it is not, or is not searched."""
        shown = self._domain.format_state
        if not self._searches:
            broken = self._domain.violated_invariant(then)
            return "" if broken is None else f"after `{outcome}`, `{broken}` does not hold: {shown(then)}"
        if self._strategy.solves(then):
            return ""
        # The reason first: states are long, and some readers cut.
        return f"after `{outcome}`, {unreachability_reasons(self._domain, then, risky=True)}: {shown(then)}"

    def _start_problem(self, choice: GroundSkill, state: State) -> str:
        shown, clause = self._domain.format_state(state), choice.skill.precondition
        if clause is None or self._domain.condition(clause.term, choice)(state) is True:
            return f"every action of a kind that it may ask for is denied where {shown}"
        return f"its precondition `{clause.text}` does not hold where {shown}"

    def _condition(self, term: t.Term) -> PartialCondition:
        return PartialCondition(term, self._domain.names, self._known)


def find_plan_problems(
    strategy: StrongCyclicStrategy,
    start: State,
    plan: Part[PlannedStep],
    known: Environment | None = None,
    *,
    every_step: bool = False,
) -> list[str]:
    """List the reasons not to follow a plan.

    Args:
        strategy: strategies of the planning domain.
        start: first state.
        plan: the plan.
        known: measured values, for conditions on variables that no outcome sets.
        every_step: the plan's executor goes on after the goal is reached.

    Returns:
        The reasons in words; empty iff the plan is accepted.

    Raises:
        PlanUndecidedError: a search for a strategy was given up.
    """
    steps = enumerate(steps_of(plan), 1)
    unusable = [
        f"step {n}, `{step.name}`: {step.rejected_choices}" for n, step in steps if step.rejected_choices
    ]
    if unusable:
        return unusable
    for searches in (False, True):
        simulation = _PlanSimulation(strategy, known or {}, plan, every_step=every_step, searches=searches)
        problems = _problems_of(simulation, strategy.domain, plan, start)
        if simulation.is_settled:
            break
    return problems


def _problems_of(
    simulation: _PlanSimulation, domain: PlanningDomain, plan: Part[PlannedStep], start: State
) -> list[str]:
    try:
        ends = simulation.simulate(plan, {start: None})
    except _PlanProblemError as found:
        return found.problems
    return [
        f"it ends, and the goal does not hold: {domain.format_state(state)}"
        for state in ends
        if domain.goal(state) is not True
    ]


def find_step_problems(
    strategy: StrongCyclicStrategy,
    start: State,
    steps: Sequence[str],
    providers: Mapping[str, Sequence[str]] | None = None,
    *,
    every_step: bool = False,
) -> list[str]:
    """List the reasons not to follow a sequence of steps, each attempted once.

    Args:
        strategy: strategies of the planning domain.
        start: first state.
        steps: labels of choices, their PDDL action names, or capabilities.
        providers: labels of the choices that provide a capability, by its name MODULE.CAPABILITY. A step that
            names one runs a provider that can start then.
        every_step: the steps' executor goes on after the goal is reached.

    Returns:
        The reasons in words; empty iff the plan is accepted.

    Raises:
        PlanUndecidedError: a search for a strategy was given up.
    """
    labels = _choices_by_label(strategy.domain)
    capabilities = {name.casefold(): provided_by for name, provided_by in (providers or {}).items()}
    planned = []
    for step in steps:
        provided_by = capabilities.get(step.casefold(), ())
        found = [_choice_by_name(strategy.domain, labels, name) for name in provided_by or (step,)]
        problem = next((one for one in found if isinstance(one, str)), "")
        choices = tuple(one for one in found if not isinstance(one, str))
        planned.append(PlannedStep(step, () if problem else choices, problem, alternatives=bool(provided_by)))
    return find_plan_problems(strategy, start, Seq(tuple(planned)), every_step=every_step)


def _choices_by_label(domain: PlanningDomain) -> dict[str, GroundSkill]:
    labels = {choice.label.casefold(): choice for choice in domain.choices}
    for choice in domain.choices:
        labels |= dict.fromkeys((action_name(choice, o).casefold() for o in choice.skill.outcomes), choice)
    return labels


def _choice_by_name(
    domain: PlanningDomain, labels: Mapping[str, GroundSkill], step: str
) -> GroundSkill | str:
    if step.casefold() in labels:
        return labels[step.casefold()]
    if step in domain.excluded_skills:
        return domain.excluded_skills[step]
    near = did_you_mean(step, [choice.label for choice in labels.values()])
    return "no such skill" + (f"; did you mean `{near}`?" if near else "")
