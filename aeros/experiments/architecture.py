"""What an execution architecture is: a class that pursues a task once, with the means that all are given.

A benchmark others can enter: write a class with `pursue`, and name it as `package.module:Class`.  It is
constructed for each trial anew, with the options of the condition as keyword arguments.

    class Mine:
        def pursue(self, means: Means) -> Told:
            for step in means.plan():
                if means.run(step).failed:
                    return Told(reason=f"{step} failed")
            return Told()

Steps, actions, and whether the goal is reached are measured by the harness and not told by it.  Its exact
prediction needs nothing more, if all that it does follows from what it is given (`exact.py`): its own code
is then run against the declared outcomes, all of them.  One that drives `TrialContext.runtime` itself says
what is to be expected of it (`SelfPredicting`).
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
from aeros.runtime.ports import Runtime
from aeros.spec.closed_loop.markov_chain import Prediction
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.model.model import Ecm, Site, Task


@dataclass(frozen=True, slots=True)
class ArchitectureReport:
    """What an architecture says of its own work; `reason`: why it gave up, empty where it did not.

    retries: further tries of a step; recoveries: runs of a skill that helps between two tries.
    replans: plans made after the first; late: plans that did not come in time.
    """

    retries: int = 0
    recoveries: int = 0
    replans: int = 0
    reason: str = ""
    planning_timeouts: int = 0

    def findings(self) -> dict[str, int | str]:
        """Return what is kept of it in a trial, by the names that trial files have."""
        return {
            "retries": self.retries,
            "recoveries": self.recoveries,
            "replans": self.replans,
            "reason": self.reason,
            "late": self.planning_timeouts,
        }


class TrialContext(Protocol):
    """What a trial gives to each architecture alike: skills, plant, seed, and what planners know."""

    @property
    def task(self) -> RoutedTask:
        """The task, with its goal and planning rules, and the module that provides it."""

    @property
    def seed(self) -> int:
        """Of the trial; for whatever an architecture chooses by chance."""

    @property
    def runtime(self) -> Runtime:
        """The runtime's port, for architectures that run several skills at once, or an agent."""

    def world(self) -> WorldModel:
        """What is measured now."""

    def is_goal_reached(self) -> bool:
        """Whether the goal is measured as true now."""

    def plan(self) -> tuple[PlanStep, ...]:
        """The plan that the task's planning rules make of what is measured now."""

    def run(self, step: PlanStep) -> StepAssessment:
        """Run the step's skill once, if it may start now, every action decided by the gate."""


class Architecture(Protocol):
    """Anything that can pursue a task."""

    def pursue(self, context: TrialContext) -> ArchitectureReport:
        """Pursue the task of `context` once, to the end."""


@dataclass(frozen=True, slots=True)
class TrialModel:
    """What a trial's plant is declared to do: the manifest as it ran, and the task in it."""

    ecm: Ecm
    task: Task
    site: Site


MAX_CALLS: Final = 10_000
"""What an architecture may ask of its means in one trial; one that never gives up is ended by it."""


class CallLimitError(Exception):
    """An architecture has asked more than that."""

    def __init__(self) -> None:
        super().__init__(f"it does not end: it has asked {MAX_CALLS} times for something")


@runtime_checkable
class SelfPredicting(Protocol):
    """An architecture that says itself what is exactly to be expected of it."""

    def predict(self, model: TrialModel) -> Prediction:
        """What `pursue` comes to; raises `StateSpaceError`."""


BUILT_IN: Final[Mapping[str, str]] = {
    "aeros": "aeros.experiments.architectures.aeros_agent:AerosAgent",
    "behaviour_tree": "aeros.experiments.architectures.behaviour_tree:BehaviourTree",
    "flat": "aeros.experiments.architectures.flat:FlatPipeline",
    "progprompt": "aeros.experiments.architectures.progprompt:ProgPrompt",
}
"""Those that come with AEROS, by name."""


def load_class(name: str) -> type[Architecture]:
    """The class of a shipped name or of `package.module:Class`; raises `MisuseError` where there is none."""
    module, _, attribute = BUILT_IN.get(name, name).partition(":")
    try:
        found = getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError, ValueError) as error:
        if name in BUILT_IN:
            raise MisuseError(f"`{name}` needs `pip install 'aeros[experiments]'` ({error})") from error
        known = ", ".join(BUILT_IN)
        raise MisuseError(
            f"there is no architecture `{name}` ({error}); there are {known}, or name PACKAGE.MODULE:CLASS"
        ) from error
    if not callable(getattr(found, "pursue", None)):
        raise MisuseError(f"`{name}` has no method `pursue`")
    made: type[Architecture] = found
    return made


def build_architecture(name: str, options: Mapping[str, Any]) -> Architecture:
    """An architecture with these options; raises `MisuseError` where it does not take them."""
    try:
        return load_class(name)(**options)
    except TypeError as error:
        raise MisuseError(f"`{name}` does not take the options {dict(options)}: {error}") from error
