"""Explanation of an unreachable goal: conditions that no skill establishes, from the goal backwards."""

from __future__ import annotations

from collections.abc import Iterator

from aeros.spec.closed_loop.invocation import State
from aeros.spec.expr import terms as t
from aeros.spec.expr.unparse import unparse
from aeros.spec.planning.domain import GroundSkill, PartialCondition, PlanningDomain
from aeros.spec.planning.shortest import DeleteRelaxation

_MAX_REASONS = 8


def unreachability_reasons(domain: PlanningDomain, state: State, *, risky: bool = False) -> str:
    """Explain why there is no plan from a state, when that is already known.

    Args:
        domain: planning domain.
        state: state without a plan.
        risky: True if plans that may lead to a dead end were excluded.

    Returns:
        The reasons in words.
    """
    broken = domain.violated_invariant(state)
    if broken is not None:
        return f"the invariant `{broken}` does not hold there"
    reachable = DeleteRelaxation(domain, state)
    if reachable.steps_to_goal is None:
        return "; ".join(_ReasonCollector(reachable).lines(domain.goal, "the goal"))
    if risky:
        return "every path from there may lead to a state from which the goal is out of reach"
    return "no order of skills reaches the goal: each undoes or violates a condition that another step needs"


class _ReasonCollector:
    """Collector of reasons for conditions that cannot become true, each reported once."""

    def __init__(self, reachable: DeleteRelaxation) -> None:
        self._reachable = reachable
        self._domain = reachable.domain
        self._asked: set[str] = set()
        self._reason_count = 0

    def lines(self, condition: PartialCondition, whose: str) -> Iterator[str]:
        parts = condition.term.operands if isinstance(condition.term, t.And) else (condition.term,)
        for part in parts:
            one = PartialCondition(part, self._domain.names, condition.constants)
            if not self._reachable.is_possible(one):
                yield from self._part(one, whose)
                return
        yield f"{whose} needs `{unparse(condition.term)}`, whose parts cannot hold at the same time"

    def _part(self, condition: PartialCondition, whose: str) -> Iterator[str]:
        self._reason_count += 1
        needs = f"{whose} needs `{unparse(condition.term)}`"
        ranged = next((name for name in condition.missing if name in self._domain.ranged), None)
        if ranged is not None:
            yield (
                f"{needs}: `{self._domain.ranged[ranged]}` leaves `{ranged}` in a range, and plans count on "
                "predicates that have a `definition` by it"
            )
            return
        if condition.missing:
            yield f"{needs}: `{condition.missing[0]}` is not measured, and no skill sets it"
            return
        if not condition.reads:
            yield f"{needs}, which does not hold now, and no skill changes it"
            return
        helpers = [choice for choice in self._domain.choices if self._could_establish(choice, condition)]
        if not helpers:
            yield f"{needs}, which no skill makes true{self._disturbance(condition)}"
            return
        names = ", ".join(dict.fromkeys(f"`{choice.name}`" for choice in helpers))
        yield f"{needs}, which only {names} could make true"
        for choice in helpers:
            if self._reason_count < _MAX_REASONS and choice.name not in self._asked:
                self._asked.add(choice.name)
                yield from self._start_obstacle(choice)

    def _disturbance(self, condition: PartialCondition) -> str:
        """Name a skill after which a predicate of the condition is not known any more."""
        for choice in self._domain.choices:
            for name in choice.skill.unsettled & frozenset(condition.reads):
                reading = choice.skill.disturbed[name]
                return f", and `{choice.name}` may change {reading}, which defines `{name}`"
        return ""

    def _start_obstacle(self, choice: GroundSkill) -> Iterator[str]:
        """Yield the reasons that `choice` can never start."""
        clause = choice.skill.precondition
        precondition = self._domain.condition(t.TRUE if clause is None else clause.term, choice)
        if self._reachable.is_possible(precondition):
            for kind, situation in choice.denied_reason:
                where = f"where `{unparse(situation)}`"
                yield f"the site and its permission deny every `{kind}` of `{choice.name}` {where}"
        else:
            yield from self.lines(precondition, f"`{choice.name}`")

    def _could_establish(self, choice: GroundSkill, condition: PartialCondition) -> bool:
        """Return True if the choice sets a variable that `condition` reads to an impossible value."""
        return any(
            name in condition.reads and bool(self._reachable.reached(name, effect))
            for outcome in choice.skill.outcomes.values()
            if outcome.probability != 0
            for name, effect in outcome.known_effects.items()
        )
