"""Bounded search for the shortest plan: Z3 decides if a plan of n steps exists, with n growing.

A step is a choice and the outcome that the plan counts on, which must be measured as a success. The plan
found is simulated in the domain before it is returned.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

from aeros.spec.backends.solver_process import SolverSession
from aeros.spec.backends.solver_results import SatResult
from aeros.spec.closed_loop.invocation import State
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.expr import terms as t
from aeros.spec.expr.constants import constant_term, equality_condition
from aeros.spec.expr.effects import Increment, value_after
from aeros.spec.expr.lower import with_constants
from aeros.spec.expr.semantics import Environment
from aeros.spec.expr.types import BOOL, EnumType, RealType
from aeros.spec.expr.units import NUMBER
from aeros.spec.model.ecm import Outcome
from aeros.spec.planning.domain import GroundSkill, PartialCondition, PlanningDomain
from aeros.spec.planning.search_result import AvoidSet, PlanPath, PlanUndecidedError

MAX_PLAN_LENGTH: Final = 40
"""Maximum length of a plan, steps."""


def bounded_plan(domain: PlanningDomain, start: State, avoided: AvoidSet, min_steps: int) -> PlanPath:
    """Find a plan from `start` with the fewest steps.

    Args:
        domain: planning domain.
        start: first state.
        avoided: states and pairs that the plan must avoid.
        min_steps: lower bound of the plan's length, if one is known.

    Returns:
        The plan; none with at least `min_steps` steps is shorter.

    Raises:
        PlanUndecidedError: there is no plan of up to `MAX_PLAN_LENGTH` steps, or the solver gives up.
    """
    encoding = _Encoding(domain, start)
    for length in range(MAX_PLAN_LENGTH + 1):
        encoding.exclude_avoid_set(length, avoided)
        if length >= min_steps:
            path = encoding.plan(length)
            if path is not None:
                return path
        encoding.add_step(length)
    raise PlanUndecidedError(
        f"no plan of up to {MAX_PLAN_LENGTH} steps was found, and none was proved to be missing"
    )


class _Encoding:
    """Encoding of the first steps of all plans from a start, as assumptions of one solver session."""

    def __init__(self, domain: PlanningDomain, start: State) -> None:
        self._domain = domain
        self._start = start
        self._edges = list(_edges(domain))
        members = tuple(map(str, range(max(len(self._edges), 1))))
        self._picks = [
            t.Variable(f"step {at}", EnumType("edge", members), t.VariableRole.STATE)
            for at in range(MAX_PLAN_LENGTH + 1)
        ]
        self._session = SolverSession(tuple(self._all_variables()))
        for name, value in zip(domain.names, start, strict=True):
            if value is None:
                self._session.assume(t.Not(self._is_known(name, 0)))
            else:
                self._session.assume(equality_condition(self._variable(name, 0), value))
                self._session.assume(self._is_known(name, 0))

    def _all_variables(self) -> Iterator[t.Variable]:
        yield from self._picks
        for at in range(MAX_PLAN_LENGTH + 2):
            for name in self._domain.names:
                yield self._variable(name, at)
                yield self._is_known(name, at)

    def _variable(self, name: str, at: int) -> t.Variable:
        one = self._domain.variables[name]
        return t.Variable(f"{name} after {at}", one.type, t.VariableRole.STATE)

    def _is_known(self, name: str, at: int) -> t.Variable:
        return t.Variable(f"{name} known after {at}", BOOL, t.VariableRole.STATE)

    def plan(self, length: int) -> PlanPath | None:
        """Return a plan of `length` steps, if there is one.

        Raises:
            PlanUndecidedError: the solver gave up.
        """
        answer = self._session.check_sat(self._encode_truth(self._domain.goal, length))
        if answer.result is SatResult.UNKNOWN:
            raise PlanUndecidedError(f"the solver gave up on plans of {length} steps: {answer.reason}")
        return self._replayed(answer.model, length) if answer.result is SatResult.SAT else None

    def _replayed(self, model: Mapping[str, Any], length: int) -> PlanPath:
        state, path = self._start, []
        for at in range(length):
            choice, outcome = self._edges[int(model[self._picks[at].name])]
            effects = {**outcome.known_effects, **dict.fromkeys(outcome.unsettled)}
            if not self._domain.can_start(choice, state):
                raise InternalError(f"`{choice.name}` does not start where the solver has it start")
            path.append((state, choice))
            pairs = zip(self._domain.names, state, strict=True)
            state = tuple(value_after(effects.get(name, value), value) for name, value in pairs)
        if self._domain.goal(state) is not True:
            raise InternalError("the goal does not hold where the solver has it reached")
        return path

    def add_step(self, at: int) -> None:
        """Assume that one more step follows the first `at`."""
        pick = self._picks[at]
        touching: dict[str, list[t.Term]] = {name: [] for name in self._domain.names}
        for number, (choice, outcome) in enumerate(self._edges):
            chosen = t.Compare("==", pick, constant_term(str(number), pick.type))
            then = [self._encode_truth(choice.condition, at), self._is_success(choice, at + 1)]
            for name, effect in outcome.known_effects.items():
                if name in touching:
                    touching[name].append(chosen)
                    then.append(self._encode_effect(name, effect, at + 1))
            for name in outcome.unsettled:
                if name in touching:
                    touching[name].append(chosen)
                    then.append(t.Not(self._is_known(name, at + 1)))
            self._session.assume(t.Implies(chosen, t.And(tuple(then))))
        for name, by in touching.items():
            same = t.And(
                (
                    t.Compare("==", self._variable(name, at), self._variable(name, at + 1)),
                    t.Compare("==", self._is_known(name, at), self._is_known(name, at + 1)),
                )
            )
            self._session.assume(t.Or((same, *by)))
        if not self._edges:
            self._session.assume(t.FALSE)

    def exclude_avoid_set(self, at: int, avoided: AvoidSet) -> None:
        """Assume that after `at` steps no invariant is broken and nothing of `avoided` occurs."""
        for condition in self._domain.invariants.values():
            self._session.assume(t.Not(self._encode_failure(condition, at)))
            if not self._domain.unsettled.isdisjoint(condition.reads):
                self._session.assume(self._encode_truth(condition, at))
        for state in avoided.states:
            self._session.assume(t.Not(self._encode_state(state, at)))
        pick = self._picks[at]
        for state, choice in avoided.pairs:
            for number, (one, _) in enumerate(self._edges):
                if one is choice:
                    chosen = t.Compare("==", pick, constant_term(str(number), pick.type))
                    self._session.assume(t.Not(t.And((self._encode_state(state, at), chosen))))

    # Conditions after a number of steps.

    def _encode_truth(self, condition: PartialCondition, at: int) -> t.Term:
        """Encode that `condition` is measured as true."""
        if condition.missing:
            return t.FALSE
        known = [self._is_known(name, at) for name in condition.reads]
        return t.And((*known, self._encode_condition(condition, at)))

    def _encode_failure(self, condition: PartialCondition, at: int) -> t.Term:
        if condition.missing:
            return t.FALSE
        known = [self._is_known(name, at) for name in condition.reads]
        return t.And((*known, t.Not(self._encode_condition(condition, at))))

    def _encode_condition(self, condition: PartialCondition, at: int) -> t.Term:
        moved: dict[str, t.Term] = {name: self._variable(name, at) for name in condition.reads}
        return t.substitute(with_constants(condition.term, condition.constants), moved)

    def _is_success(self, choice: GroundSkill, at: int) -> t.Term:
        """Encode that the measured outcome is a success: no measured failure has more effects."""
        outcomes = choice.skill.outcomes.values()
        measured = {one.id: self._encode_effects(one.effects, at) for one in outcomes}
        ways = []
        for one in choice.skill.success_outcomes:
            larger = choice.skill.failures_with_more_effects(one)
            ways.append(t.And((measured[one.id], *(t.Not(measured[o.id]) for o in larger))))
        return t.Or(tuple(ways))

    def _encode_effects(self, effects: Environment, at: int) -> t.Term:
        return t.And(tuple(self._encode_effect(name, effect, at) for name, effect in effects.items()))

    def _encode_effect(self, name: str, effect: Any, at: int) -> t.Term:
        """Encode that an effect of the step before is measured; an increment of an unknown number is not."""
        variable, is_known = self._variable(name, at), self._is_known(name, at)
        if not isinstance(effect, Increment):
            return t.And((is_known, equality_condition(variable, effect)))
        before, was_known = self._variable(name, at - 1), self._is_known(name, at - 1)
        then = t.Add(before, t.Literal(effect.amount, RealType(NUMBER)))
        return t.And((is_known, was_known, t.Compare("==", variable, then)))

    def _encode_state(self, state: State, at: int) -> t.Term:
        values = {name: v for name, v in zip(self._domain.names, state, strict=True) if v is not None}
        unknown = [name for name, v in zip(self._domain.names, state, strict=True) if v is None]
        return t.And(
            (self._encode_effects(values, at), *(t.Not(self._is_known(name, at)) for name in unknown))
        )


def _edges(domain: PlanningDomain) -> Iterator[tuple[GroundSkill, Outcome]]:
    """Yield each choice with each of its possible outcomes."""
    for choice in domain.choices:
        for outcome in choice.skill.outcomes.values():
            if outcome.probability != 0:
                yield choice, outcome
