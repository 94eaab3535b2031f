"""A module's composition as a task graph, and the planner that proposes it."""

from __future__ import annotations

from collections.abc import Mapping

from aeros.agent.planning.routing import Routed
from aeros.agent.planning.task_graph import Step, TaskGraph
from aeros.agent.world.world import World
from aeros.spec.model import composition as spec
from aeros.spec.model.composition import Composition
from aeros.spec.model.model import Ecm
from aeros.spec.model.step_graph import Seq, map_steps


class UncomposedError(Exception):
    """There is no such composition, or it cannot be run here and now; the message says why."""


class CompositionPlanner:
    """Proposes a composition of the task's module, whatever planning rules the task has."""

    def __init__(self, composition: str) -> None:
        self._composition = composition

    @property
    def name(self) -> str:
        """As shown in the audit record."""
        return f"composition {self._composition}"

    def plan(self, routed: Routed, world: World, modules: Mapping[str, Ecm]) -> TaskGraph:
        """The composition, where its precondition is measured; raises `UncomposedError`."""
        composition = modules[routed.module].compositions.get(self._composition)
        if composition is None:
            raise UncomposedError(f"`{routed.module}` has no composition `{self._composition}`")
        if world.evaluate(composition.precondition) is not True:
            why = world.why_not(composition.precondition)
            raise UncomposedError(f"the precondition of `{composition.id}` is not measured: {why}")
        return graph_of(composition, routed.module)


def graph_of(composition: Composition, module: str) -> TaskGraph:
    """`composition` of `module` as a task graph."""

    def planned(step: spec.Step) -> Step:
        handler = None if step.handler is None else planned(composition.handlers[step.handler])
        flows = {name: (flow.step, flow.output) for name, flow in step.flows.items()}
        return Step(module, step.skill, step.inputs, step.retry, handler=handler, id=step.id, flows=flows)

    body = map_steps(composition.body, planned)
    return TaskGraph(body.parts if isinstance(body, Seq) else (body,))
