"""Control flow of a composition as a directed graph, for checks and drawings."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from aeros.spec.model.composition import Composition, Part, Step
from aeros.spec.model.step_graph import FailingPart, Fallback, If, Par, RetriedPart, Seq, StoppablePart

if TYPE_CHECKING:
    import networkx as nx

START: Final = "start"
DONE: Final = "done"
STOPPED: Final = "stopped"

FAILURE: Final = "failure"
LAST_FAILURE: Final = "last failure"
NO_TRY_LEFT: Final = "no try is left"
STOPPED_MIDWAY: Final = "at any time until its end"


def control_flow_graph(composition: Composition) -> nx.DiGraph[str]:
    """Build the control-flow graph of a composition; an edge's `on` says when it is followed.

    Nodes: `start`, `done` and `stopped`; each step by `step/NAME`, handler by `handler/NAME`,
    condition by `if/TEXT@NUMBER`, the two ends of a `par` by `fork@NUMBER` and `join@NUMBER`, the beginning
    of a part that is retried by `tries@NUMBER`, that of one under `hold` or within `timeout` by
    `while@NUMBER`, and a tolerated failure by `tolerated@NUMBER`.

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
    lost: _DanglingEdges = []
    for name, handler in composition.handlers.items():
        lost += _add_failure(graph, handler, f"handler/{name}")
    for node, on in _add(graph, composition.body, [(START, "")], lost):
        graph.add_edge(node, DONE, on=on)
    for node, on in lost:
        graph.add_edge(node, STOPPED, on=on)
    return graph


_DanglingEdges = list[tuple[str, str]]
"""Nodes that lack an edge to the next node, and the condition of that edge."""


def _add(graph: nx.DiGraph[str], part: Part, loose: _DanglingEdges, lost: _DanglingEdges) -> _DanglingEdges:
    """Add a part after `loose`; add the edges of its failures to `lost` and return those of its success."""
    match part:
        case Step(id=name):
            node = f"step/{name}"
            _connect(graph, node, part, loose)
            lost += _add_failure(graph, part, node)
            return [(node, "success")]
        case Seq(parts=parts):
            for inner in parts:
                loose = _add(graph, inner, loose, lost)
            return loose
        case Par(branches=branches):
            fork, join = f"fork@{len(graph)}", f"join@{len(graph)}"
            _connect(graph, fork, part, loose)
            ends = [end for branch in branches for end in _add(graph, branch, [(fork, "")], lost)]
            _connect(graph, join, part, ends)
            return [(join, "")]
        case If(text=text, then=then, otherwise=otherwise):
            node = f"if/{text}@{len(graph)}"
            _connect(graph, node, part, loose)
            ends = _add(graph, then, [(node, "then")], lost)
            return ends if otherwise is None else ends + _add(graph, otherwise, [(node, "else")], lost)
        case Fallback(parts=parts):
            return _add_fallback(graph, parts, loose, lost)
        case RetriedPart(part=inner):
            node = f"tries@{len(graph)}"
            _connect(graph, node, part, loose)
            failed: _DanglingEdges = []
            ends = _add(graph, inner, [(node, "")], failed)
            for before, on in failed:
                graph.add_edge(before, node, on=on)
            lost.append((node, NO_TRY_LEFT))
            return ends
        case StoppablePart(part=inner):
            node = f"while@{len(graph)}"
            _connect(graph, node, part, loose)
            lost.append((node, STOPPED_MIDWAY))
            return _add(graph, inner, [(node, "")], lost)
        case FailingPart():
            lost += loose
            return []


def _add_fallback(
    graph: nx.DiGraph[str], parts: tuple[Part, ...], loose: _DanglingEdges, lost: _DanglingEdges
) -> _DanglingEdges:
    """Add alternatives, each after the failures of the one before."""
    ends: _DanglingEdges = []
    for part in parts:
        if part == Seq(()) and loose:
            # Success and failure of a step would be one edge.
            node = f"tolerated@{len(graph)}"
            _connect(graph, node, part, loose)
            loose = [(node, "")]
        failed: _DanglingEdges = []
        ends += _add(graph, part, loose, failed)
        loose = failed
    lost += loose
    return ends


def _connect(graph: nx.DiGraph[str], node: str, part: Part, loose: _DanglingEdges) -> None:
    graph.add_node(node, part=part)
    for before, on in loose:
        graph.add_edge(before, node, on=on)


def _add_failure(graph: nx.DiGraph[str], step: Step, node: str) -> _DanglingEdges:
    """Add the edges of a failed step to its handlers and back; return those of its failure."""
    lost = [(node, FAILURE)]
    if step.last_handler is not None:
        graph.add_edge(node, f"handler/{step.last_handler}", on=LAST_FAILURE)
        lost = [(f"handler/{step.last_handler}", "")]
    if step.between_tries is not None:
        graph.add_edge(node, f"handler/{step.between_tries}", on=FAILURE)
        graph.add_edge(f"handler/{step.between_tries}", node, on="success")
    elif step.retry:
        graph.add_edge(node, node, on=FAILURE)
    return lost
