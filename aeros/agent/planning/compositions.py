"""Compositions of modules as task graphs, and the planner that proposes them."""

from __future__ import annotations

from collections.abc import Mapping

from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import Part, PlanStep, TaskGraph
from aeros.agent.world.world import WorldModel
from aeros.spec.model import composition as spec
from aeros.spec.model.composition import Composition
from aeros.spec.model.ecm import Ecm, owner_of
from aeros.spec.model.step_graph import Seq, map_graph_steps, without_marks


class CompositionUnavailableError(Exception):
    """A composition that does not exist or cannot be run now; the message says why."""


class CompositionPlanner:
    """Planner that proposes one composition of the task's module and ignores the task's planning rules."""

    def __init__(self, composition: str) -> None:
        self._composition = composition

    @property
    def name(self) -> str:
        """Name in the audit record."""
        return f"composition {self._composition}"

    def plan(self, routed: RoutedTask, world: WorldModel, modules: Mapping[str, Ecm]) -> TaskGraph:
        """Propose the composition if its precondition is measured as true.

        Args:
            routed: task to plan for.
            world: current state.
            modules: active modules by id.

        Returns:
            The composition as a plan.

        Raises:
            CompositionUnavailableError: it does not exist, or its precondition is not measured as true.
        """
        composition = modules[routed.module].compositions.get(self._composition)
        if composition is None:
            raise CompositionUnavailableError(f"`{routed.module}` has no composition `{self._composition}`")
        if world.evaluate(composition.precondition) is not True:
            why = world.unmet_reason(composition.precondition)
            raise CompositionUnavailableError(f"the precondition of `{composition.id}` is not met: {why}")
        return composition_to_graph(composition, routed.module)


def chosen_composition(modules: Mapping[str, Ecm], module: str, name: str, alternative: str) -> Part | None:
    """Return the graph of a composition that was chosen for a step.

    Args:
        modules: active modules by id.
        module: id of the module that asks for it.
        name: capability that the step names.
        alternative: name of the alternative.

    Returns:
        The graph; None if the module is not active or has it no more.
    """
    for one in modules[module].alternatives(name) if module in modules else ():
        if one.name == alternative and one.composition is not None:
            return composition_to_graph(one.composition, module).body
    return None


def composition_to_graph(composition: Composition, module: str) -> TaskGraph:
    """Convert a composition to a task graph.

    Args:
        composition: composition of the module.
        module: id of the module.

    Returns:
        The task graph, with handlers and output references.
    """

    def planned(step: spec.Step) -> PlanStep:
        between, last = (
            None if name is None else planned(composition.handlers[name])
            for name in (step.between_tries, step.last_handler)
        )
        flows = {name: (flow.step, flow.output) for name, flow in step.output_references.items()}
        return PlanStep(
            *owner_of(step.skill, module),
            step.inputs,
            step.retry,
            between,
            last,
            needs_recovery=between is not None,
            id=step.id,
            flows=flows,
        )

    body = without_marks(map_graph_steps(composition.body, planned))
    return TaskGraph(body.parts if isinstance(body, Seq) else (body,))
