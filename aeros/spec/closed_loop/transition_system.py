"""The agent's loop on one task as a finite transition system over the task's predicates.

It mirrors rules 1 to 3 of `aeros.agent.task_loop`, and the tries and recoveries of
`aeros.agent.execution.plan_executor`, for the planner that plans by the task's rules.  Each move of the
system is a line of that loop.  Differential tests compare the two.

Where a rule names a capability, each try of its step is run by a provider whose precondition holds.  The
agent chooses which, and proofs assume nothing about that choice.  Predictions assume that all are equally
likely, as they are to an agent without memory.

Assumes that the effects of an outcome happen, that nothing else changes but predicates by definition, as
`aeros.spec.consequences` says, and that every predicate is measured in time; the supervisor records a broken
assumption where that is not so.  A predicate that may be either is branched on: nothing decides which, so the
goal must be within reach of both, and no probability is predicted.  Assumes that no submission is refused,
denied or halted, except that a skill is halted when its hold-condition breaks.  That is a failed try like any
other (`aeros.spec.model.hold_conditions`).  So every recovery is repeatable, and no request is denied twice.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import partial
from graphlib import CycleError, TopologicalSorter
from itertools import product
from typing import Any, Final, Literal, TypeAlias

from aeros.spec.closed_loop.composed_run import ComposedRun, Role, RunTooLargeError
from aeros.spec.closed_loop.giving_up import AgentBeliefs, RunRule
from aeros.spec.closed_loop.invocation import Invocation, State, StateCondition, UnsettledError
from aeros.spec.closed_loop.loop_stops import stop_in_loop
from aeros.spec.closed_loop.loop_variables import (
    LoopVariables,
    StateSpaceError,
    is_quantity,
    recoveries_of,
    skills_of,
)
from aeros.spec.consequences.consequences import (
    known_definitions,
    uncertain_predicates,
    with_consequences,
)
from aeros.spec.consequences.durations import may_be_late
from aeros.spec.expr import terms as t
from aeros.spec.model.ecm import Alternative, Ecm, PlanningRule, Skill, Task
from aeros.spec.model.site import Site

MAX_PLAN_STEPS: Final = 100
"""Largest number of steps in an accepted plan; `aeros.agent.planning.task_graph` has the same."""


@dataclass(frozen=True, slots=True)
class LoopState:
    """A state of the loop: its phase, the measured predicates and the rest of the plan.

    Attributes:
        phase: `plan` (about to plan), `try`, `recover` (between two tries) or `reset` (after the last try) of
            the first step of `remaining_rules`, `reached` (the goal is measured), `rejected` (no plan is
            accepted here, and another would be the same), or `given up` (by `giving_up.py`).
        state: a value for each predicate.
        remaining_rules: the rules of the current plan that are still to be run, by index.
        tries: failed tries of the current step.
    """

    phase: Literal["plan", "try", "recover", "reset", "reached", "rejected", "given up"]
    state: State
    remaining_rules: tuple[int, ...] = ()
    tries: int = 0
    _hash: int = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        # Computed once: states and plans of long tasks are long, and nodes are looked up many times.
        object.__setattr__(self, "_hash", hash((self.phase, self.state, self.remaining_rules, self.tries)))

    def __hash__(self) -> int:
        return self._hash


@dataclass(frozen=True, slots=True)
class Transition:
    """A move from one state of the loop to another.

    Attributes:
        target: the state after the move.
        probability: probability of the move (0 to 1) for the agent's choice.
        role: role of the skill that is submitted, as in the agent's report; None where no skill is.
        label: that skill and the outcome that is measured then.
        choice: the provider that the agent chooses, where it has a choice.
        counts: expected number of skills submitted, for each of `ROLES`, if a composition is run; else None.
        through: states on the way, if a composition is run.
        case: of moves with the same case from one state, for the same choice, nothing decides which is made;
            empty for a move that outcomes of their probability lead to.
        is_open: its probability is not known: what `undecided` says holds instead.
        undecided: if positive, the probability of all moves for the same choice that have it together,
            beyond those of each: nothing is known of how they share it.
        seconds: duration of the outcome, s; None if a composition is run, or no skill.
    """

    target: LoopState
    probability: Fraction = Fraction(1)
    role: Role | None = None
    label: str = ""
    choice: str = ""
    counts: tuple[Fraction, ...] | None = None
    through: frozenset[State] = frozenset()
    case: str = ""
    undecided: Fraction = Fraction(0)
    is_open: bool = False
    seconds: Fraction | None = field(default=None, compare=False)


class _RulePlans:
    """Plans that the agent makes by the rules of a task, and the notes of them in the history of a run."""

    task: Task
    _rule: RunRule | None
    _skills: Mapping[str, Skill]
    _unless: list[StateCondition]
    _looked_up: list[tuple[int, int]]
    _decided: list[int]
    _most_retries: int
    _tried_too_often: set[int]
    _providers: list[tuple[str, ...]]
    _recovery_skills: dict[str, tuple[str, ...]]
    _rejections: dict[tuple[int, ...], str | None]
    _goal: StateCondition
    _steps: list[list[_Way]]

    def blocked_step(self, node: LoopState) -> tuple[PlanningRule, str] | None:
        """Find a skill that is due for its first try and cannot start.

        Args:
            node: state of the loop.

        Returns:
            The rule of the due step, and the skill of it whose precondition does not hold; None if there is
            none.
        """
        if node.phase != "try" or node.tries or not node.remaining_rules or self._goal(node.state):
            return None
        index = node.remaining_rules[0]
        if self._unless[index](node.state):
            return None
        name = next((way.name for way in self._steps[index] if not way.can_start(node.state)), None)
        return None if name is None else (self.task.rules[index], name)

    def rejection(self, plan: tuple[int, ...]) -> str | None:
        """Give the reason for which the agent rejects a plan; results are cached.

        Args:
            plan: indices of the plan's rules.

        Returns:
            The reason, or None if the plan is accepted.
        """
        if plan not in self._rejections:
            self._rejections[plan] = self._rejection(plan)
        return self._rejections[plan]

    def recovery_edges(self, index: int) -> list[tuple[str, str]]:
        """List what may run after a failure of a rule's step.

        Args:
            index: index of the rule.

        Returns:
            Pairs of a skill that the step may run, and a skill that may run after it failed.
        """
        helpers = (
            one for name in recoveries_of(self.task.rules[index]) for one in self._recovery_skills[name]
        )
        return [*product(self._providers[index], helpers)]

    def plan(self, state: State) -> tuple[int, ...]:
        """Plan by the task's rules.

        Args:
            state: values of the predicates.

        Returns:
            Indices of the rules whose `unless` does not hold, in order.
        """
        plan = [index for index, place in self._looked_up if not state[place]]
        plan += [index for index in self._decided if not self._unless[index](state)]
        return tuple(sorted(plan))

    def _compute_plan(self, state: State) -> LoopState:
        plan = self.plan(state)
        if self.rejection(plan):
            return LoopState("rejected", state)
        return LoopState("try", state if self._rule is None else self._rule.planned(state, plan), plan)

    def _plan_again(self, state: State) -> LoopState:
        return LoopState("plan", state if self._rule is None else self._rule.planned(state, ()))

    def _finished(self, state: State) -> LoopState:
        """Return the node after a plan that was carried out and has not reached the goal."""
        return self._plan_again(state if self._rule is None else self._rule.finished(state))

    def _not_started(self, state: State, index: int) -> LoopState:
        return self._plan_again(state if self._rule is None else self._rule.not_started(state, index))

    def _rejection(self, plan: tuple[int, ...]) -> str | None:
        if not plan:
            return "no rule applies, so the plan is empty"
        if len(plan) > MAX_PLAN_STEPS:
            return f"the plan has {len(plan)} steps; at most {MAX_PLAN_STEPS} are allowed"
        if not self._tried_too_often.isdisjoint(plan):
            return f"a step has more than the {self._most_retries} retries that this site allows"
        recovered = [edge for index in plan for edge in self.recovery_edges(index)]
        for _, recovery in recovered:
            if any(declared.default_value is None for declared in self._skills[recovery].inputs.values()):
                return f"`{recovery}` runs with default inputs after a failure, but an input has no default"
        return "a failure leads back to itself" if _is_cyclic(recovered) else None


class TransitionSystem(_RulePlans):
    """The agent's loop on one task.

    The constructor raises `StateSpaceError` if a variable has infinitely many values and no cells, or an
    outcome leaves too many variables at several values.

    Attributes:
        ecm: the module, whose outcomes have their consequences.
        task: the task.
        variables: the state variables that the loop depends on.
        names: their names, in the order of every state.
        stop: describes the stop of a part of a composition as a skill that only fails.
    """

    def __init__(self, ecm: Ecm, task: Task, site: Site, beliefs: AgentBeliefs | None = None) -> None:
        self._with_beliefs = partial(TransitionSystem, ecm, task, site)
        self._beliefs = beliefs
        ecm = with_consequences(ecm, site)
        self.ecm, self.task = ecm, task
        self.variables = LoopVariables(ecm, task, site)
        self.names = tuple(self.variables.variables)
        self._skills, definitions = ecm.callable_skills, known_definitions(ecm)
        self._rule = None if beliefs is None else self._run_rule(beliefs)
        self.stop = partial(stop_in_loop, skills=self._skills, state=site.state, definitions=definitions)
        self._invocations: list[Invocation] = []
        settable = {
            name for skill in skills_of(ecm, task) for one in skill.outcomes.values() for name in one.effects
        }
        self._most_retries = site.limits.retries
        self._tried_too_often = {n for n, rule in enumerate(task.rules) if rule.retry > self._most_retries}
        self._goal = self.condition(task.goal)
        self._unless = [self.condition(rule.satisfied_condition) for rule in task.rules]
        places = [condition.single_predicate_index for condition in self._unless]
        self._looked_up = [(index, place) for index, place in enumerate(places) if place is not None]
        self._decided = [index for index, place in enumerate(places) if place is None]
        self._settable = settable
        self._uncertain = uncertain_predicates(definitions)
        self._steps = [[self._way(one, rule) for one in ecm.alternatives(rule.skill)] for rule in task.rules]
        self._providers = [ecm.providers(rule.skill) for rule in task.rules]
        self._recoveries = {
            phase: [self._helpers(ecm, name) for name in names]
            for phase, names in (
                ("recover", [rule.between_tries for rule in task.rules]),
                ("reset", [rule.on_failure for rule in task.rules]),
            )
        }
        self._recovery_skills = {
            name: ecm.providers(name) for rule in task.rules for name in recoveries_of(rule)
        }
        self._rejections: dict[tuple[int, ...], str | None] = {}

    def condition(self, term: t.Term) -> StateCondition:
        """Make a term a condition on the states of this system.

        Args:
            term: condition over the predicates.

        Returns:
            The condition.
        """
        return StateCondition(term, self.names)

    @property
    def inexact_reason(self) -> str:
        """Reason that the probability of a move explored so far is not known; empty if all are known."""
        return _inexact_reason(self._invocations, [way for ways in self._steps for way in ways])

    def start(self, values: Mapping[str, Any]) -> State:
        """Make the state in which a run starts.

        Args:
            values: value of each state variable of the loop, and perhaps of others.

        Returns:
            The values in the order of `names`; with beliefs the history of the run follows.
        """
        state = tuple(values[name] for name in self.names)
        return state if self._rule is None else self._rule.begin(state)

    def named(self, state: State) -> dict[str, Any]:
        """Name the values of a state.

        Args:
            state: a value for each state variable.

        Returns:
            The values by name, in the order of `names`.
        """
        return dict(zip(self.names, state, strict=True))

    def never_giving_up(self) -> TransitionSystem:
        """Make the system of an agent that tries until its plans are used up.

        Returns:
            A system in which success is at least as likely.
        """
        return self._with_beliefs()

    def giving_up_soonest(self) -> TransitionSystem:
        """Make the system of an agent that gives up no later than this one, in whatever state a step failed.

        Returns:
            A system in which success is at most as likely.
        """
        return self._with_beliefs(self._beliefs and replace(self._beliefs, in_any_state=True))

    def _run_rule(self, beliefs: AgentBeliefs) -> RunRule:
        measured = [
            place
            for place, (name, one) in enumerate(self.variables.variables.items())
            if not (is_quantity(one) or name in beliefs.hidden or beliefs.in_any_state)
        ]
        choices = {
            one.name
            for rule in self.task.rules
            for several in [self.ecm.alternatives(rule.skill)]
            for one in several
            if len({beliefs.names.get(each.name, each.name) for each in several}) > 1
        }
        helped = (self.ecm.providers(name) for rule in self.task.rules for name in recoveries_of(rule))
        choices.update(name for several in helped if len(several) > 1 for name in several)
        return RunRule(beliefs, self.names, measured, choices)

    def _is_over(self, state: State) -> bool:
        """Tell if nothing more starts."""
        return self._goal(state) or (self._rule is not None and self._rule.has_ended(state))

    def _invocation(self, skill: str, inputs: Mapping[str, Any]) -> Invocation:
        made = self._invocation_of(self._skills[skill], inputs)
        self._invocations.append(made)
        return made

    def _invocation_of(self, skill: Skill, inputs: Mapping[str, Any]) -> Invocation:
        try:
            found = (skill, inputs, self.names, self._settable, self.variables.after, self._rule)
            return Invocation(*found)
        except UnsettledError as error:
            raise StateSpaceError(str(error)) from error

    def _helpers(self, ecm: Ecm, name: str | None) -> list[Invocation]:
        return [] if name is None else [self._invocation(one, {}) for one in ecm.providers(name)]

    def _way(self, alternative: Alternative, rule: PlanningRule) -> _Way:
        if alternative.composition is None:
            return _SkillWay(self._invocation(alternative.name, rule.inputs))
        composition = alternative.composition
        run = ComposedRun(
            composition,
            self._invocation,
            self.condition,
            self._is_over,
            lambda part: self._invocation_of(self.stop(part, composition), {}),
            lambda part: may_be_late(part, composition.handlers, self._skills),
            self._uncertain,
        )
        return _ComposedWay(alternative.name, self.condition(composition.precondition), run)

    def transitions(self, node: LoopState) -> list[Transition]:
        """List the moves from a state of the loop.

        Args:
            node: state of the loop.

        Returns:
            Every move; none where the loop has ended.
        """
        if node.phase in ("reached", "rejected", "given up"):
            return []
        if self._goal(node.state):
            return [Transition(LoopState("reached", node.state))]
        if self._is_over(node.state):
            return [Transition(LoopState("given up", node.state))]
        if node.phase == "plan":
            return [Transition(self._compute_plan(node.state))]
        if not node.remaining_rules:
            return [Transition(self._finished(node.state))]
        if node.phase == "reset":
            return self._recovery_transitions(node)
        if self._unless[node.remaining_rules[0]](node.state):
            return [Transition(LoopState("try", node.state, node.remaining_rules[1:]))]
        follow = self._recovery_transitions if node.phase == "recover" else self._attempt_transitions
        return follow(node)

    def _attempt_transitions(self, node: LoopState) -> list[Transition]:
        index, rest = node.remaining_rules[0], node.remaining_rules[1:]
        able = [way for way in self._steps[index] if way.can_start(node.state)]
        if not able:
            if node.tries > 0:
                return [Transition(self._failed(index, node.state))]
            return [Transition(self._not_started(node.state, index))]
        if self._rule is not None and any(self._rule.is_spent(node.state, way.name) for way in able):
            return [Transition(LoopState("given up", node.state))]
        last = node.tries >= self.task.rules[index].retry
        role: Role = "retry" if node.tries else "step"
        moves = []
        for way, move in [(one, move) for one in able for move in one.moves(node.state, role)]:
            state = move.state
            if self._rule is not None and move.is_failure and not move.is_verdict:
                state = self._rule.continued(state) if self._unless[index](state) else state
            if not move.is_failure or (last and self._unless[index](state)):
                target = LoopState("try", state, rest)
            elif self._rule is not None and move.is_verdict:
                target = self._plan_again(state)
            elif last:
                target = self._failed(index, state)
            else:
                target = LoopState("recover", state, node.remaining_rules, node.tries + 1)
            moves.append(move.transition(target, len(able), role, way.name))
            if target.phase == "recover" and self._recoveries["reset"][index]:
                # The agent's memory may leave out the tries that are left.
                given_up = self._failed(index, state)
                moves.append(Transition(given_up, Fraction(0), role, move.label, way.name))
        return moves

    def _failed(self, index: int, state: State) -> LoopState:
        """Return the node after the last try of a rule's step has failed."""
        if not self._recoveries["reset"][index]:
            return self._plan_again(state)
        return LoopState("reset", state, (index,), self.task.rules[index].retry + 1)

    def _recovery_transitions(self, node: LoopState) -> list[Transition]:
        """List the moves of a recovery; one that cannot start is skipped."""

        def after(state: State, *, is_verdict: bool = False) -> LoopState:
            if node.phase == "reset" or is_verdict:
                return self._plan_again(state)
            return LoopState("try", state, node.remaining_rules, node.tries)

        helpers = self._recoveries[node.phase][node.remaining_rules[0]]
        able = [one for one in helpers if one.can_start(node.state)]
        if not able:
            return [Transition(after(node.state))]
        if self._rule is not None and any(self._rule.is_spent(node.state, one.name) for one in able):
            return [Transition(LoopState("given up", node.state))]
        return [
            Transition(
                after(state, is_verdict=self._rule is not None and bool(outcome.verdict)),
                probability / len(able),
                "recovery",
                f"{one.name} → {outcome.id}",
                one.name if len(helpers) > 1 else "",
                case=_case_name(number, case),
                seconds=outcome.known_duration,
            )
            for one in able
            for number, case in enumerate(one.cases(node.state))
            for state, outcome, probability in case
        ]


@dataclass(frozen=True, slots=True)
class _Ending:
    """One way in which a try may end."""

    state: State
    is_failure: bool
    probability: Fraction
    label: str
    counts: tuple[Fraction, ...] | None = None
    through: frozenset[State] = frozenset()
    case: str = ""
    undecided: Fraction = Fraction(0)
    is_open: bool = False
    is_verdict: bool = False
    seconds: Fraction | None = None

    def transition(self, target: LoopState, choices: int, role: Role, way: str) -> Transition:
        """Return the move to where the loop goes on; each of the agent's choices is as likely as another."""
        shares = (self.probability / choices, self.undecided / choices)
        found = (target, shares[0], role, self.label, way, self.counts, self.through, self.case)
        return Transition(*found, shares[1], self.is_open, self.seconds)


def _case_name(number: int, case: Sequence[object]) -> str:
    return str(number) if len(case) > 1 else ""


@dataclass(frozen=True, slots=True)
class _SkillWay:
    """An alternative that is one skill."""

    invocation: Invocation

    @property
    def name(self) -> str:
        return self.invocation.name

    def can_start(self, state: State) -> bool:
        return self.invocation.can_start(state)

    def moves(self, state: State, _: Role) -> Iterator[_Ending]:
        for number, case in enumerate(self.invocation.cases(state)):
            for after, outcome, probability in case:
                yield _Ending(
                    *(after, outcome.failure, probability, f"{self.name} → {outcome.id}"),
                    case=_case_name(number, case),
                    is_verdict=bool(outcome.verdict),
                    seconds=outcome.known_duration,
                )


@dataclass(frozen=True, slots=True)
class _ComposedWay:
    """An alternative that is a composition; one try runs it to its end."""

    name: str
    can_start: StateCondition
    run: ComposedRun

    def moves(self, state: State, role: Role) -> Iterator[_Ending]:
        try:
            done, failed, through = self.run.run(state, role)
        except RunTooLargeError as error:
            raise StateSpaceError(f"`{self.name}` comes through too many states") from error
        known = sum((one.probability for ends in (done, failed) for one in ends.values()), Fraction(0))
        is_known = self.run.is_settled and not self.run.is_open
        undecided = 1 - known if is_known else Fraction(1)
        only_fails = is_known and self.run.is_success_known
        for ends, is_failure, word in ((done, False, "done"), (failed, True, "failed")):
            for after, weight in ends.items():
                share = weight.probability
                counts = tuple(one / share if share else one for one in weight.counts)
                # Where nothing decides between some of them, the goal must be within reach of all.
                case = "" if self.run.is_settled else word
                label = f"{self.name} → {word}"
                opened = Fraction(0) if only_fails and not is_failure else undecided
                yield _Ending(
                    after, is_failure, share, label, counts, through, case, opened, self.run.is_open
                )


_Way: TypeAlias = _SkillWay | _ComposedWay


def _is_cyclic(edges: list[tuple[str, str]]) -> bool:
    after: dict[str, set[str]] = {}
    for source, target in edges:
        after.setdefault(target, set()).add(source)
    try:
        TopologicalSorter(after).prepare()
    except CycleError:
        return True
    return False


def _inexact_reason(invocations: Sequence[Invocation], ways: Sequence[_Way]) -> str:
    runs = [way.run for way in ways if isinstance(way, _ComposedWay)]
    if not all(run.is_exact for run in runs):
        return "which of several steps fails first depends on how long they take"
    if any(run.is_open for run in runs):
        return "a part may be stopped in its midst, which depends on how long its steps take"
    return next((one.unsettled for one in invocations if one.unsettled), "")
