"""Diagram of a composition: its control flow, with outcomes and conditions on the edges."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

from aeros.apps.drawings.drawing import Diagram, Edge, Node, Shape
from aeros.spec.expr.units import format_number
from aeros.spec.flow.control_flow import (
    DONE,
    FAILURE,
    LAST_FAILURE,
    NO_TRY_LEFT,
    START,
    STOPPED,
    STOPPED_MIDWAY,
    control_flow_graph,
)
from aeros.spec.model.composition import Composition, Step
from aeros.spec.model.ecm import Ecm, Skill
from aeros.spec.model.step_graph import HeldPart, If, RetriedPart, StoppablePart, TimedPart, steps_of

_BARS: Final = {
    "fork": "at the same time",
    "join": "when all have succeeded",
    "tolerated": "a failure is tolerated",
}
FAILURES = (FAILURE, LAST_FAILURE, NO_TRY_LEFT, STOPPED_MIDWAY)


def composition_drawing(ecm: Ecm, composition: Composition) -> Diagram:
    """Draw the control flow of a composition from its start to `done` or `stopped as failed`.

    A failure edge is drawn if some outcome of the step is a failure.  Outcomes of probability 0 are left out.

    Args:
        ecm: The module that declares the composition.
        composition: The composition.

    Returns:
        The diagram.
    """
    graph = control_flow_graph(composition)
    edges: list[tuple[str, str, str, bool]] = []
    for before, after, data in graph.edges(data=True):
        part = graph.nodes[before].get("part")
        on: str = data["on"]
        label = _label(part, on, after, ecm.callable_skills) if isinstance(part, Step) else on
        if label is not None:
            edges.append((before, after, label, on in FAILURES))
    reached = {name for before, after, _, _ in edges for name in (before, after)}
    body = [name for name in graph if name.partition("/")[0] not in (START, DONE, STOPPED, "handler")]
    handlers = [f"handler/{name}" for name in composition.handlers]
    order = [START, *body, *handlers, DONE, STOPPED]
    ids = {name: f"n{index}" for index, name in enumerate(name for name in order if name in reached)}
    return Diagram(
        f"{ecm.id}: composition {composition.id}",
        tuple(_node(ids[name], name, graph.nodes[name].get("part"), composition) for name in ids),
        tuple(
            Edge(ids[before], ids[after], label, dashed)
            for before, after, label, dashed in sorted(
                edges, key=lambda edge: (order.index(edge[0]), not edge[3])
            )
        ),
    )


def _label(step: Step, on: str, after: str, skills: Mapping[str, Skill]) -> str | None:
    """Return the outcomes that lead from a step to `after`, as text; None if there is no such outcome."""
    outcomes = [one for name in step.runs for one in skills[name].outcomes.values()]
    likely = [one for one in outcomes if one.probability != 0]
    if not on:
        return ""
    names = " or ".join(dict.fromkeys(one.id for one in likely if one.failure == (on in FAILURES)))
    if not names:
        return None
    if step.retry and (on == LAST_FAILURE or (on == FAILURE and not _is_next_try(step, after))):
        return f"{names}, after {step.retry + 1} tries"
    return names


def _is_next_try(step: Step, after: str) -> bool:
    """Tell if a node is the step itself, or the handler between two of its tries."""
    return after in (f"step/{step.id}", f"handler/{step.id}", f"handler/{step.between_tries}")


def _node(id_: str, name: str, part: object, composition: Composition) -> Node:
    match part:
        case Step():
            return Node(id_, tuple(_step_text(part)), "state" if name.startswith("handler/") else "step")
        case If():
            return Node(id_, (f"if {part.text}",), "choice")
        case RetriedPart():
            return Node(id_, (f"at most {part.retry + 1} tries",), "bar")
        case HeldPart():
            return Node(id_, (f"while {part.condition.text}: {_steps_text(part)}",), "bar")
        case TimedPart():
            return Node(id_, (f"within {format_number(part.timeout)} s: {_steps_text(part)}",), "bar")
    ends: dict[str, tuple[str, Shape]] = {
        START: (composition.id, "start"),
        DONE: ("done", "goal"),
        STOPPED: ("stopped as failed", "stuck"),
    }
    if name not in ends:
        return Node(id_, (_BARS[name.partition("@")[0]],), "bar")
    text, shape = ends[name]
    precondition = composition.precondition_span
    note = (f"where {precondition.text}",) if name == START and precondition is not None else ()
    return Node(id_, (text, *note), shape)


def _steps_text(part: StoppablePart[Step]) -> str:
    """List the steps that a part may stop."""
    return ", ".join(step.id for step in steps_of(part.part))


def _step_text(step: Step) -> Iterator[str]:
    yield step.id if step.id == step.skill else f"{step.id}: {step.skill}"
    for name, flow in step.output_references.items():
        yield f"{name} from {flow.step}.{flow.output}"
    if step.retry:
        yield f"at most {step.retry + 1} tries"
