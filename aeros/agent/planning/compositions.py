"""A module's composition as a task graph, and the planner that proposes it."""

from __future__ import annotations

from collections.abc import Mapping

from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import PlanStep, TaskGraph
from aeros.agent.world.world import WorldModel
from aeros.spec.model import composition as spec
from aeros.spec.model.composition import Composition
from aeros.spec.model.model import Ecm
from aeros.spec.model.step_graph import Seq, map_graph_steps


class CompositionUnavailableError(Exception):
    """There is no such composition, or it cannot be run here and now; the message says why."""


class CompositionPlanner:
    """Proposes a composition of the task's module, whatever planning rules the task has."""

    def __init__(self, composition: str) -> None:
        self._composition = composition

    @property
    def name(self) -> str:
        """As shown in the audit record."""
        return f"composition {self._composition}"

    def plan(self, routed: RoutedTask, world: WorldModel, modules: Mapping[str, Ecm]) -> TaskGraph:
        """The composition, where its precondition is measured; raises `CompositionUnavailableError`."""
        composition = modules[routed.module].compositions.get(self._composition)
        if composition is None:
            raise CompositionUnavailableError(f"`{routed.module}` has no composition `{self._composition}`")
        if world.evaluate(composition.precondition) is not True:
            why = world.unmet_reason(composition.precondition)
            raise CompositionUnavailableError(
                f"the precondition of `{composition.id}` is not measured: {why}"
            )
        return composition_to_graph(composition, routed.module)


def composition_to_graph(composition: Composition, module: str) -> TaskGraph:
    """`composition` of `module` as a task graph."""

    def planned(step: spec.Step) -> PlanStep:
        handler = None if step.handler is None else planned(composition.handlers[step.handler])
        flows = {name: (flow.step, flow.output) for name, flow in step.output_references.items()}
        return PlanStep(module, step.skill, step.inputs, step.retry, handler=handler, id=step.id, flows=flows)

    body = map_graph_steps(composition.body, planned)
    return TaskGraph(body.parts if isinstance(body, Seq) else (body,))
