"""Resolved composition graphs: steps over a module's skills, in sequence, in parallel and by condition.

A graph consists of the parts of `step_graph`. A step runs its skill. After a failure outcome the handler
`between_tries` runs, if there is one, and the step is tried again while `retry` lasts. If that handler fails
for good, or no try is left, the step has failed: the handler `on_failure` runs, if there is one, and then the
whole composition stops as failed. `par` succeeds when all its branches have.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.expr import terms as t
from aeros.spec.model import step_graph

STOP_ON_FAILURE = "stop"
"""Value of `on_failure` with which the composition stops as failed and reports it."""


@dataclass(frozen=True)
class OutputReference:
    """Reference of an input to the output of an earlier step.

    Attributes:
        step: id of the earlier step.
        output: name of its output.
        span: place in the manifest.
    """

    step: str
    output: str
    span: SourceSpan


@dataclass(frozen=True)
class Step:
    """One invocation of a skill, in a body or as a handler.

    Attributes:
        id: name of the step in its composition.
        skill: the skill, or a capability; `MODULE.NAME` if it is of another module.
        span: place in the manifest.
        inputs: constants in SI, with defaults.
        output_references: the output that each other input takes, by name of the input.
        retry: number of further tries after a failure.
        between_tries: the handler that runs between two tries; None for none.
        on_failure: the handler that runs after the last try has failed, `STOP_ON_FAILURE`, or None if nothing
            is declared.
        choices: the skills any of which may run, if `skill` is a capability.
        is_nested: True for a step of another composition, which stands here as a whole.
    """

    id: str
    skill: str
    inputs: Mapping[str, Any]
    output_references: Mapping[str, OutputReference]
    retry: int
    between_tries: str | None
    on_failure: str | None
    span: SourceSpan
    choices: tuple[str, ...] = ()
    is_nested: bool = False

    @property
    def runs(self) -> tuple[str, ...]:
        """The skills any of which may run."""
        return self.choices or (self.skill,)

    @property
    def last_handler(self) -> str | None:
        """Name of the handler that runs after the last try, if the step has one."""
        return None if self.on_failure == STOP_ON_FAILURE else self.on_failure

    @property
    def handlers(self) -> tuple[str, ...]:
        """Names of the handlers that a failure may lead to directly, in the order in which they run."""
        names = (self.between_tries, self.last_handler)
        return tuple(dict.fromkeys(name for name in names if name is not None))


Part: TypeAlias = step_graph.Part[Step]


@dataclass(frozen=True)
class Composition:
    """Named graph of steps with its precondition.

    Attributes:
        id: name of the composition in its module.
        body: the graph.
        span: place in the manifest.
        precondition: condition on the state that must be measured before it starts.
        precondition_span: None if there is no precondition.
        handlers: handlers by name; a skill named under `on_failure` is a handler of that name.
    """

    id: str
    precondition: t.Term
    precondition_span: SourceSpan | None
    body: Part
    handlers: Mapping[str, Step]
    span: SourceSpan


def handlers_of(step: Step, handlers: Mapping[str, Step]) -> Iterator[Step]:
    """Yield the handlers that a failure of a step may lead to.

    Args:
        step: step of a body, or a handler.
        handlers: all handlers of the composition, by name.

    Yields:
        Each of them once, in the order they run.
    """
    seen: set[str] = set()
    pending = list(reversed(step.handlers))
    while pending:
        name = pending.pop()
        if name not in seen:
            seen.add(name)
            yield handlers[name]
            pending += reversed(handlers[name].handlers)


def handler_cycle(composition: Composition) -> list[str]:
    """Find a cycle of handlers, each of which handles the failure of the one before.

    Args:
        composition: the composition.

    Returns:
        Names of the handlers on the cycle, the first repeated at the end; empty if there is no cycle.
    """
    edges = [(name, inner) for name, one in composition.handlers.items() for inner in one.handlers]
    if not edges:
        return []
    import networkx as nx

    graph: nx.DiGraph[str] = nx.DiGraph(edges)
    try:
        cycle = [source for source, _ in nx.find_cycle(graph)]
    except nx.NetworkXNoCycle:
        return []
    return [*cycle, cycle[0]]


def count_runs(composition: Composition) -> int:
    """Count the steps of a composition and those that their failures lead to, each as often as it is used.

    Args:
        composition: the composition; its handlers form no cycle.

    Returns:
        The number.
    """
    counts: dict[str, int] = {}

    def runs(step: Step) -> int:
        names = (name for name in (step.between_tries, step.last_handler) if name is not None)
        return 1 + sum(counted(name) for name in names)

    def counted(name: str) -> int:
        if name not in counts:
            counts[name] = runs(composition.handlers[name])
        return counts[name]

    return sum(map(runs, step_graph.steps_of(composition.body)))


def nested(name: str, composition: Composition, span: SourceSpan) -> tuple[Part, dict[str, Step]]:
    """Make a part of another composition of a whole composition.

    Args:
        name: name of the part; the steps and handlers in it are called `NAME.STEP` and `NAME.HANDLER`.
        composition: the composition.
        span: place of the step that stands for it.

    Returns:
        The part, which fails where the precondition of the composition does not hold, and its handlers.
    """

    def renamed(step: Step) -> Step:
        flows = {
            key: replace(flow, step=f"{name}.{flow.step}") for key, flow in step.output_references.items()
        }
        between, last = (
            handler if handler in (None, STOP_ON_FAILURE) else f"{name}.{handler}"
            for handler in (step.between_tries, step.on_failure)
        )
        return replace(
            step,
            id=f"{name}.{step.id}",
            output_references=flows,
            between_tries=between,
            on_failure=last,
            is_nested=True,
        )

    body = step_graph.map_graph_steps(composition.body, renamed)
    if composition.precondition_span is not None:
        text = composition.precondition_span.text
        body = step_graph.NestedIf(composition.precondition, text, body, None, span, is_precondition=True)
    handlers = {f"{name}.{key}": renamed(one) for key, one in composition.handlers.items()}
    return step_graph.as_nested(body), handlers
