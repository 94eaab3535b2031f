"""Control flow of a composition as a directed graph, for checks and drawings."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from aeros.spec.model.composition import Composition, Part, Step
from aeros.spec.model.step_graph import If, Par, Seq

if TYPE_CHECKING:
    import networkx as nx

START: Final = "start"
DONE: Final = "done"
STOPPED: Final = "stopped"

FAILURE: Final = "failure"
LAST_FAILURE: Final = "last failure"


def control_flow_graph(composition: Composition) -> nx.DiGraph[str]:
    """Build the control-flow graph of a composition; an edge's `on` says when it is followed.

    Nodes: `start`, `done` and `stopped`; each step by `step/NAME`, handler by `handler/NAME`,
    condition by `if/TEXT@NUMBER`, and the two ends of a `par` by `fork@NUMBER` and `join@NUMBER`.

    Args:
        composition: the composition.

    Returns:
        The graph; each node but the first three has its part of the composition as `part`.
    """
    import networkx as nx  # takes 50 ms to import, which most modules need not pay

    graph: nx.DiGraph[str] = nx.DiGraph()
    graph.add_nodes_from((START, DONE, STOPPED))
    for name, handler in composition.handlers.items():
        graph.add_node(f"handler/{name}", part=handler)
        _add_failure(graph, handler, f"handler/{name}")
    for node, on in _add(graph, composition.body, [(START, "")]):
        graph.add_edge(node, DONE, on=on)
    return graph


_DanglingEdges = list[tuple[str, str]]
"""Nodes that lack an edge to the next node, and the condition of that edge."""


def _add(graph: nx.DiGraph[str], part: Part, loose: _DanglingEdges) -> _DanglingEdges:
    match part:
        case Step(id=name):
            node = f"step/{name}"
            _connect(graph, node, part, loose)
            _add_failure(graph, part, node)
            return [(node, "success")]
        case Seq(parts=parts):
            for inner in parts:
                loose = _add(graph, inner, loose)
            return loose
        case Par(branches=branches):
            fork, join = f"fork@{len(graph)}", f"join@{len(graph)}"
            _connect(graph, fork, part, loose)
            ends = [end for branch in branches for end in _add(graph, branch, [(fork, "")])]
            _connect(graph, join, part, ends)
            return [(join, "")]
        case If(text=text, then=then, otherwise=otherwise):
            node = f"if/{text}@{len(graph)}"
            _connect(graph, node, part, loose)
            then_ends = _add(graph, then, [(node, "then")])
            return then_ends if otherwise is None else then_ends + _add(graph, otherwise, [(node, "else")])


def _connect(graph: nx.DiGraph[str], node: str, part: Part, loose: _DanglingEdges) -> None:
    graph.add_node(node, part=part)
    for before, on in loose:
        graph.add_edge(before, node, on=on)


def _add_failure(graph: nx.DiGraph[str], step: Step, node: str) -> None:
    """Add the edges of a failed step: to the handler between two tries and back, and to the end."""
    if step.last_handler is None:
        graph.add_edge(node, STOPPED, on=FAILURE)
    else:
        graph.add_edge(node, f"handler/{step.last_handler}", on=LAST_FAILURE)
        graph.add_edge(f"handler/{step.last_handler}", STOPPED, on="")
    if step.between_tries is not None:
        graph.add_edge(node, f"handler/{step.between_tries}", on=FAILURE)
        graph.add_edge(f"handler/{step.between_tries}", node, on="success")
    elif step.retry:
        graph.add_edge(node, node, on=FAILURE)
