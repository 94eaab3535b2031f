"""Interface of execution architectures: a class that pursues one task, in a context that is the same for all.

Anybody can enter a class of their own: write a class with `pursue`, and name it as `package.module:Class`.
It is constructed anew for each trial, with the options of the condition as keyword arguments.

    class Mine:
        def pursue(self, context: TrialContext) -> ArchitectureReport:
            for step in context.plan():
                if context.run(step).failed:
                    return ArchitectureReport(reason=f"{step} failed")
            return ArchitectureReport()

The harness measures steps, actions and whether the goal is reached; the architecture does not report them.
Its exact prediction needs nothing more if all that it does follows from its context: `exact_prediction.py`
runs its own code against every declared outcome.  An architecture that drives `TrialContext.runtime` itself
predicts its results itself (`SelfPredicting`).
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Protocol, runtime_checkable

from aeros.agent.execution.supervisor import StepAssessment
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import PlanStep
from aeros.agent.world.world import WorldModel
from aeros.distribution import install_command
from aeros.runtime.ports import Runtime
from aeros.spec.closed_loop.giving_up import AgentBeliefs
from aeros.spec.closed_loop.markov_chain import Prediction
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.model.ecm import Ecm, Task
from aeros.spec.model.site import Site


@dataclass(frozen=True, slots=True)
class ArchitectureReport:
    """An architecture's report of its own work.

    Attributes:
        retries: further tries of a step after its first.
        recoveries: runs of a skill that helps between two tries.
        replans: plans made after the first.
        reason: why it gave up; empty where it did not.
        planning_timeouts: plans that were not ready in time.
    """

    retries: int = 0
    recoveries: int = 0
    replans: int = 0
    reason: str = ""
    planning_timeouts: int = 0

    def findings(self) -> dict[str, Any]:
        """Return the report under the names that findings of trials have.

        Returns:
            JSON values by name.
        """
        return {
            "retries": self.retries,
            "recoveries": self.recoveries,
            "replans": self.replans,
            "reason": self.reason,
            "late": self.planning_timeouts,
        }


@dataclass(frozen=True, slots=True)
class Budget:
    """Budget of a trial, which its harness keeps, whatever the architecture does.

    Attributes:
        tries: most tries of the skill that fails; None for any number.
        seconds: plant time after which no step begins and nothing counts as reached, s; None for any time.
    """

    tries: int | None = None
    seconds: float | None = None


NO_BUDGET: Final = Budget()
"""A trial may take as long as its architecture wants."""


class BudgetSpentError(Exception):
    """The budget of the trial allows no further step; the trial ends."""

    def __init__(self) -> None:
        super().__init__("the budget of the trial is spent")


class RunningStep(Protocol):
    """A skill that was begun and has not ended."""

    def wait(self, seconds: float) -> StepAssessment | None:
        """Let plant time go on until the skill has ended.

        Args:
            seconds: longest time to wait, s.

        Returns:
            The measured outcome, and whether the step failed; None if it is still under way.
        """

    def halt(self) -> None:
        """Halt the skill, and wait until it has ended."""


class TrialContext(Protocol):
    """Context of one trial, the same for each architecture: skills, plant, seed and planning rules."""

    @property
    def task(self) -> RoutedTask:
        """The task with its goal and planning rules, and the module that provides it."""

    @property
    def seed(self) -> int:
        """The seed of the trial, for random choices of the architecture."""

    @property
    def runtime(self) -> Runtime:
        """The runtime's port, for architectures that run several skills at once, or an agent."""

    def world(self) -> WorldModel:
        """Return the state as it is measured now.

        Returns:
            The latest readings as a world model.
        """

    def is_goal_reached(self) -> bool:
        """Measure the state and evaluate the task's goal.

        Returns:
            True if the goal holds.
        """

    def plan(self) -> tuple[PlanStep, ...]:
        """Plan from the state that is measured now, by the task's planning rules.

        Returns:
            The steps, in order.
        """

    def run(self, step: PlanStep) -> StepAssessment:
        """Run the skill of a step once, if it may start now; the gate decides every action.

        Args:
            step: module, skill and inputs.

        Returns:
            The measured outcome, and whether the step failed.

        Raises:
            BudgetSpentError: the trial's budget allows no further step.
        """

    def begin(self, step: PlanStep) -> RunningStep | StepAssessment:
        """Begin the skill of a step, if it may start now, and do not wait until it has ended.

        Args:
            step: module, skill and inputs.

        Returns:
            The skill under way; its assessment if it ended at once.

        Raises:
            BudgetSpentError: the trial's budget allows no further step.
        """


class Architecture(Protocol):
    """Protocol of execution architectures: anything that can pursue a task."""

    def pursue(self, context: TrialContext) -> ArchitectureReport:
        """Pursue the task of a trial once, to its end.

        Args:
            context: the task, and the skills, plans and readings that the architecture may use.

        Returns:
            The architecture's report of its own work.
        """


@dataclass(frozen=True, slots=True)
class TrialModel:
    """Declared behaviour of a trial's plant.

    Attributes:
        ecm: the module as it ran.
        task: the task, one of the module's.
        site: the site.
        beliefs: failures that an architecture with the module expects, if not those that `ecm` declares: the
            manifest that it has need not be right about the plant.
    """

    ecm: Ecm
    task: Task
    site: Site
    beliefs: AgentBeliefs | None = None


MAX_CALLS: Final = 10_000
"""Most calls to the context in one trial; they end an architecture that never gives up."""


class CallLimitError(Exception):
    """An architecture made more than `MAX_CALLS` calls to its context."""

    def __init__(self) -> None:
        super().__init__(f"stopped after {MAX_CALLS} calls without finishing")


@runtime_checkable
class SelfPredicting(Protocol):
    """Protocol of architectures that predict their exact results themselves."""

    def predict(self, model: TrialModel) -> Prediction:
        """Predict the results of `pursue` exactly.

        Args:
            model: manifest, task and site of the trial.

        Returns:
            The probability of success and the expected counts.

        Raises:
            StateSpaceError: no exact prediction is possible; the message says why.
        """


@runtime_checkable
class PredictsBudgets(Protocol):
    """Protocol of architectures that predict their exact results within a budget of tries, too."""

    def predict_within(self, model: TrialModel, counted_skill: str, most_tries: int) -> Prediction:
        """Predict the results of `pursue` exactly, if the trial ends before one try too many.

        Args:
            model: manifest, task and site of the trial.
            counted_skill: the skill whose tries the budget limits.
            most_tries: number of its tries in the budget.

        Returns:
            The probability of success and the expected counts.

        Raises:
            StateSpaceError: no exact prediction is possible; the message says why.
        """


BUILT_IN: Final[Mapping[str, str]] = {
    "aeros": "aeros.experiments.architectures.aeros_agent:AerosAgent",
    "behaviortree_cpp": "aeros.experiments.architectures.behaviortree_cpp:BehaviorTreeCpp",
    "behaviour_tree": "aeros.experiments.architectures.behaviour_tree:BehaviourTree",
    "expert_tree": "aeros.experiments.architectures.expert_tree:ExpertTree",
    "flat": "aeros.experiments.architectures.flat:FlatPipeline",
    "progprompt": "aeros.experiments.architectures.progprompt:ProgPrompt",
}
"""Classes of the architectures that come with AEROS, by name."""


def load_class(name: str) -> type[Architecture]:
    """Import the class of an architecture.

    Args:
        name: a name of `BUILT_IN`, or `package.module:Class`.

    Returns:
        The class, which has a method `pursue`.

    Raises:
        MisuseError: there is no such class, or it has no method `pursue`.
    """
    module, _, attribute = BUILT_IN.get(name, name).partition(":")
    try:
        found = getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError, ValueError) as error:
        if name in BUILT_IN:
            raise MisuseError(f"`{name}` needs {install_command('experiments')} ({error})") from error
        known = ", ".join(BUILT_IN)
        raise MisuseError(
            f"there is no architecture `{name}` ({error}); there are {known}, or name PACKAGE.MODULE:CLASS"
        ) from error
    if not callable(getattr(found, "pursue", None)):
        raise MisuseError(f"`{name}` has no method `pursue`")
    made: type[Architecture] = found
    return made


def build_architecture(name: str, options: Mapping[str, Any]) -> Architecture:
    """Construct an architecture with its options.

    Args:
        name: a name of `BUILT_IN`, or `package.module:Class`.
        options: keyword arguments of its constructor.

    Returns:
        The new architecture.

    Raises:
        MisuseError: there is no such class, or it does not accept the options.
    """
    try:
        return load_class(name)(**options)
    except TypeError as error:
        raise MisuseError(f"`{name}` does not take the options {dict(options)}: {error}") from error
