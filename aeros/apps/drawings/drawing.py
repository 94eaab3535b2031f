"""Diagrams of nodes and labelled edges, as Mermaid, DOT or SVG.  Text is escaped and never markup."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from itertools import pairwise
from typing import Literal

from aeros.apps.drawings.layering import LayoutEdge, Point, Size, layered_layout
from aeros.spec.diagnostics.render import escape_invisible

Shape = Literal["step", "state", "start", "goal", "stuck", "choice", "bar"]
"""A choice is where conditions part the way; a bar is where parallel branches part or meet."""


@dataclass(frozen=True)
class Node:
    """One node of a diagram.

    Attributes:
        id: Name that edges refer to, unique in the diagram.
        lines: Lines of its text, from top to bottom.
        shape: The shape that is drawn around the text.
    """

    id: str
    lines: tuple[str, ...]
    shape: Shape = "step"


@dataclass(frozen=True)
class Edge:
    """One arrow of a diagram.

    Attributes:
        source: Id of the node where it starts.
        target: Id of the node where it ends.
        label: Text beside it; empty for none.
        dashed: True for a transition on failure.
    """

    source: str
    target: str
    label: str = ""
    dashed: bool = False


@dataclass(frozen=True)
class Diagram:
    """Nodes and the edges between them.

    Attributes:
        title: The diagram's title.
        nodes: Nodes in reading order, the first at the top.
        edges: Edges; their nodes are among `nodes`.
    """

    title: str
    nodes: tuple[Node, ...]
    edges: tuple[Edge, ...]


def mermaid(drawing: Diagram) -> str:
    """Render a diagram as a Mermaid flow chart.

    Args:
        drawing: The diagram.

    Returns:
        Mermaid source; all text in it is escaped.
    """
    brackets = {
        "step": ("[", "]"),
        "state": ("(", ")"),
        "start": ("([", "])"),
        "goal": ("[[", "]]"),
        "stuck": ("{{", "}}"),
        "choice": ("{", "}"),
        "bar": ("[/", "/]"),
    }
    rows = ["---", f"title: {json.dumps(drawing.title)}", "---", "flowchart TD"]
    for node in drawing.nodes:
        left, right = brackets[node.shape]
        rows.append(f'  {node.id}{left}"{"<br/>".join(map(_entities, node.lines))}"{right}')
    for edge in drawing.edges:
        arrow = "-.->" if edge.dashed else "-->"
        label = f'|"{_entities(edge.label)}"|' if edge.label else ""
        rows.append(f"  {edge.source} {arrow}{label} {edge.target}")
    return "\n".join(rows) + "\n"


def _entities(text: str) -> str:
    """Escape text for a Mermaid string: characters that Mermaid or HTML could interpret become entities."""
    return "".join(
        one if one.isalnum() or one in " _.,:=→/+-" else f"#{ord(one)};" for one in escape_invisible(text)
    )


def dot(drawing: Diagram) -> str:
    """Render a diagram in the DOT language of Graphviz.

    Args:
        drawing: The diagram.

    Returns:
        DOT source.
    """
    styles = {
        "step": "shape=box",
        "state": "shape=box, style=rounded",
        "start": "shape=box, style=rounded, penwidth=2",
        "goal": "shape=box, peripheries=2",
        "stuck": "shape=octagon",
        "choice": "shape=diamond",
        "bar": "shape=box, style=filled, fillcolor=gray85, height=0.2",
    }
    rows = [f"digraph {_quoted([drawing.title])} {{", "  node [fontname=sans]; edge [fontname=sans];"]
    rows += [f"  {node.id} [{styles[node.shape]}, label={_quoted(node.lines)}];" for node in drawing.nodes]
    for edge in drawing.edges:
        style = ", style=dashed" if edge.dashed else ""
        rows.append(f"  {edge.source} -> {edge.target} [label={_quoted([edge.label])}{style}];")
    return "\n".join([*rows, "}"]) + "\n"


def _quoted(lines: Iterable[str]) -> str:
    parts = (escape_invisible(line).replace("\\", "\\\\").replace('"', '\\"') for line in lines)
    return '"' + r"\n".join(parts) + '"'


_LINE, _GLYPH, _PAD = 18, 7.3, 12
_FILLS = {
    "step": "#fff",
    "state": "#fff",
    "start": "#e8f0fe",
    "goal": "#e6f4ea",
    "stuck": "#fce8e6",
    "choice": "#fef7e0",
    "bar": "#ddd",
}


def svg(drawing: Diagram) -> str:
    """Render a diagram as an SVG image in layers from top to bottom, each below its predecessors if possible.

    Args:
        drawing: The diagram.

    Returns:
        An SVG element; lengths in pixels.
    """
    sizes = {node.id: _size(node.lines) for node in drawing.nodes}
    edges = [
        LayoutEdge(one.source, one.target, _size([one.label]) if one.label else (0, 0))
        for one in drawing.edges
    ]
    layout = layered_layout(_layers_of(drawing), sizes, edges)
    width, height = layout.size
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}"'
        f' width="{width:.0f}" height="{height:.0f}" font-family="sans-serif" font-size="13">',
        f"<title>{escape(escape_invisible(drawing.title))}</title>",
        '<defs><marker id="head" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="8" markerHeight="8"'
        ' orient="auto"><path d="M0 0L8 4L0 8z" fill="#555"/></marker></defs>',
        f'<rect width="{width:.0f}" height="{height:.0f}" fill="#fff"/>',
    ]
    parts += [_arrow(edge, path) for edge, path in zip(drawing.edges, layout.edge_paths, strict=True)]
    parts += [_shape(node, layout.nodes[node.id], sizes[node.id]) for node in drawing.nodes]
    parts += [_label(drawing.edges[number].label, at) for number, at in layout.labels.items()]
    return "\n".join([*parts, "</svg>"]) + "\n"


def _size(lines: Sequence[str]) -> Size:
    return max(len(escape_invisible(line)) for line in lines) * _GLYPH + 2 * _PAD, len(lines) * _LINE + _PAD


def _layers_of(drawing: Diagram) -> dict[str, int]:
    """Return the layer of each node: its greatest distance from the first, or its least if there are cycles.

    Dashed arrows count only for nodes that no solid arrow reaches.
    """
    import networkx as nx  # 80 ms, which a run that draws nothing need not pay

    first = {node.id for node in drawing.nodes if node.shape == "start"} or {drawing.nodes[0].id}
    whole: nx.DiGraph[str] = nx.DiGraph()
    whole.add_edges_from((edge.source, edge.target) for edge in drawing.edges)
    solid: nx.DiGraph[str] = nx.DiGraph((one.source, one.target) for one in drawing.edges if not one.dashed)
    solid.add_nodes_from(first)
    solid = solid.subgraph(first.union(*(nx.descendants(solid, one) for one in first)))
    ranks: dict[str, int] = {}
    if nx.is_directed_acyclic_graph(solid):
        for rank, layer in enumerate(nx.topological_generations(solid)):
            ranks |= dict.fromkeys(layer, rank)
    ranks |= dict.fromkeys(first - ranks.keys(), 0)
    for source, target in nx.edge_bfs(whole, [*ranks]):
        ranks.setdefault(target, ranks[source] + 1)
    last = max(ranks.values())
    for node in drawing.nodes:
        if node.id not in ranks:
            last += 1
            ranks[node.id] = last
    return {node.id: ranks[node.id] for node in drawing.nodes}


def _arrow(edge: Edge, way: Sequence[Point]) -> str:
    """Draw a curve through the points, vertical at each."""
    (x, y), *_ = way
    path = f"M{x:.0f} {y:.0f}"
    for (x0, y0), (x1, y1) in pairwise(way):
        middle = (y0 + y1) / 2
        path += f"C{x0:.0f} {middle:.0f} {x1:.0f} {middle:.0f} {x1:.0f} {y1:.0f}"
    dash = ' stroke-dasharray="5 4"' if edge.dashed else ""
    return f'<path d="{path}" fill="none" stroke="#555"{dash} marker-end="url(#head)"/>'


def _label(text: str, at: Point) -> str:
    x, y = at
    wide = len(escape_invisible(text)) * _GLYPH
    ground = f'<rect x="{x - wide / 2:.0f}" y="{y - 8:.0f}" width="{wide:.0f}" height="16" fill="#fff"/>'
    return ground + _text(text, x, y)


def _shape(node: Node, at: Point, size: Size) -> str:
    (x, y), (width, height) = at, size
    radius = 2 if node.shape == "step" else 12
    rect = (
        f'<rect x="{x - width / 2:.0f}" y="{y - height / 2:.0f}" width="{width:.0f}" height="{height:.0f}"'
        f' rx="{radius}" fill="{_FILLS[node.shape]}" stroke="#222"/>'
    )
    middle = (len(node.lines) - 1) / 2
    lines = (_text(line, x, y + (i - middle) * _LINE) for i, line in enumerate(node.lines))
    return rect + "".join(lines)


def _text(text: str, x: float, y: float) -> str:
    shown = escape(escape_invisible(text))
    return f'<text x="{x:.0f}" y="{y + 4:.0f}" text-anchor="middle" fill="#111">{shown}</text>'
