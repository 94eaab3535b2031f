"""Exact prediction of an architecture: its own code, run against every declared outcome.

A trial is a Markov chain over the task's predicates whose moves are the architecture's.  Here it is
unrolled: `pursue` runs again and again, each time with another sequence of outcomes, until every sequence
has been run.  A sequence has the product of its outcomes' probabilities; together they sum to 1, in
fractions.  So the prediction follows from what the code does, not from a description of it.

Assumes what the shipped prediction does: outcomes are independent of each other and of the past, effects of
an outcome happen and nothing else changes, everything is measured in time, and nothing is denied or halted.
Also assumes that what an architecture does follows from its context; an architecture that differs from one
run to the next is not predicted.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any, Final, NoReturn

from aeros.agent.execution.supervisor import StepAssessment
from aeros.agent.planning.base import RulePlanner
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import PlanStep
from aeros.agent.world.world import WorldModel
from aeros.experiments.architecture import (
    MAX_CALLS,
    NO_BUDGET,
    Architecture,
    ArchitectureReport,
    Budget,
    BudgetSpentError,
    CallLimitError,
    PredictsBudgets,
    RunningStep,
    SelfPredicting,
    TrialModel,
)
from aeros.sim.symbolic.state import initial_values
from aeros.spec.closed_loop.invocation import Invocation
from aeros.spec.closed_loop.loop_variables import StateSpaceError
from aeros.spec.closed_loop.markov_chain import Prediction
from aeros.spec.closed_loop.transition_system import TransitionSystem
from aeros.spec.expr.doubles import to_doubles

MAX_SEQUENCES: Final = 20_000
"""Most sequences of outcomes of one prediction; they take a second or two."""


def predict(
    make: Callable[[], Architecture], model: TrialModel, budget: Budget = NO_BUDGET, counted_skill: str = ""
) -> Prediction:
    """Predict one trial exactly.

    Args:
        make: constructs the architecture; called once for each sequence of outcomes.
        model: manifest, task and site of the trial.
        budget: of the trial.
        counted_skill: the skill whose tries the budget limits.

    Returns:
        The probability of success and the expected counts.

    Raises:
        StateSpaceError: no exact prediction is possible; the message says why.
    """
    architecture = make()
    if budget.seconds is not None:
        raise StateSpaceError("the declared outcomes have no durations that a budget of time could count")
    if isinstance(architecture, SelfPredicting):
        if budget.tries is None:
            return architecture.predict(model)
        if not isinstance(architecture, PredictsBudgets):
            raise StateSpaceError("the prediction of this architecture knows no budget of tries")
        return architecture.predict_within(model, counted_skill, budget.tries)
    total = _ExpectedCounts()
    pending: list[tuple[int, ...]] = [()]
    tables = _ModelTables(model, counted_skill, budget.tries)
    for _ in range(MAX_SEQUENCES):
        if not pending:
            return total.prediction()
        prefix = pending.pop()
        context = _ModelContext(tables, prefix)
        try:
            report = make().pursue(context)
        except StateSpaceError:
            raise
        except BudgetSpentError as spent:
            report = ArchitectureReport(reason=str(spent))
        except CallLimitError as endless:
            raise StateSpaceError(str(endless)) from endless
        except Exception as error:
            raise StateSpaceError(f"it raises {type(error).__name__}: {error}") from error
        if len(context.widths) < len(prefix):
            raise StateSpaceError("the architecture is not deterministic")
        for place in range(len(prefix), len(context.widths)):
            before = tuple(context.chosen[:place])
            pending += [(*before, other) for other in range(1, context.widths[place])]
        total.add(context, report)
    raise StateSpaceError(f"it has more than {MAX_SEQUENCES} sequences of outcomes")


class _ExpectedCounts:
    """Expected counts, summed over sequences of outcomes."""

    def __init__(self) -> None:
        self._sums = {name: Fraction(0) for name in Prediction.__dataclass_fields__}

    def add(self, context: _ModelContext, report: ArchitectureReport) -> None:
        counts = {
            "success": int(context.is_goal_reached()),
            "invocations": len(context.widths),
            "retries": report.retries,
            "recoveries": report.recoveries,
            "replans": report.replans,
        }
        for name, count in counts.items():
            self._sums[name] += context.probability * count

    def prediction(self) -> Prediction:
        return Prediction(**self._sums)


class _ModelTables:
    """Tables that all sequences of one model share."""

    def __init__(self, model: TrialModel, counted_skill: str, max_tries: int | None) -> None:
        self.model = model
        self.counted_skill, self.max_tries = counted_skill, max_tries
        self.system = TransitionSystem(model.ecm, model.task, model.site)
        self.routed = RoutedTask(model.ecm.id, model.task)
        self.goal = self.system.condition(model.task.goal)
        values = initial_values(model.site, to_doubles(model.task.start))
        self.start = tuple(values[name] for name in self.system.names)
        self._invocations: dict[tuple[str, str], list[Invocation]] = {}

    def invocations(self, step: PlanStep) -> list[Invocation]:
        """Return the skill of `step` with its inputs, or each skill that provides the capability.

        Raises:
            StateSpaceError: a composition provides it.
        """
        key = f"{step.module}.{step.skill}", repr(sorted(step.inputs.items()))
        if key not in self._invocations:
            ecm = self.model.ecm
            name = step.skill if step.module == ecm.id else f"{step.module}.{step.skill}"
            providers = [ecm.callable_skills[one] for one in ecm.providers(name)]
            if not providers:
                raise StateSpaceError(f"`{name}` is provided by a composition")
            self._invocations[key] = [Invocation(one, step.inputs, self.system.names) for one in providers]
        return self._invocations[key]


class _ModelContext:
    """Context of a trial in which skills have the outcomes that `prefix` names, and the first ones after it.

    widths: number of possible outcomes at each run; chosen: the index of the one that happened.
    """

    def __init__(self, tables: _ModelTables, prefix: Sequence[int]) -> None:
        self._tables = tables
        self._prefix = prefix
        self._state = tables.start
        self._planner = RulePlanner()
        self.probability = Fraction(1)
        self.widths: list[int] = []
        self.chosen: list[int] = []
        self._asked = 0
        self._tries = 0

    @property
    def seed(self) -> NoReturn:
        raise StateSpaceError("the architecture uses its seed and has no `predict` method")

    @property
    def task(self) -> RoutedTask:
        return self._tables.routed

    @property
    def runtime(self) -> NoReturn:
        raise StateSpaceError("the architecture drives the runtime and has no `predict` method")

    def world(self) -> WorldModel:
        self._count()
        known: dict[str, Any] = dict(zip(self._tables.system.names, self._state, strict=True))
        return WorldModel(0.0, known, {}, known)

    def is_goal_reached(self) -> bool:
        self._count()
        return self._tables.goal(self._state)

    def plan(self) -> tuple[PlanStep, ...]:
        modules = {self._tables.model.ecm.id: self._tables.model.ecm}
        return self._planner.plan(self.task, self.world(), modules).steps

    def run(self, step: PlanStep) -> StepAssessment:
        self._count()
        able = [one for one in self._tables.invocations(step) if one.can_start(self._state)]
        if not able:
            return StepAssessment(None, True, False, f"the precondition of `{step.skill}` is not measured")
        if able[0].name == self._tables.counted_skill and self._tables.max_tries is not None:
            if self._tries >= self._tables.max_tries:
                raise BudgetSpentError
            self._tries += 1
        found = [one for one in able[0].after(self._state) if one[2]]
        place = len(self.widths)
        chosen = self._prefix[place] if place < len(self._prefix) else 0
        if chosen >= len(found):
            raise StateSpaceError("the architecture is not deterministic")
        self.widths.append(len(found))
        self.chosen.append(chosen)
        self._state, outcome, probability = found[chosen]
        self.probability *= probability
        return StepAssessment(outcome.id, outcome.failure, False, f"outcome `{outcome.id}`" * outcome.failure)

    def begin(self, step: PlanStep) -> RunningStep | StepAssessment:
        return self.run(step)

    def _count(self) -> None:
        self._asked += 1
        if self._asked > MAX_CALLS:
            raise CallLimitError
