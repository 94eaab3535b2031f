"""Layered layout of a diagram by Sugiyama's method: positions of nodes, edge labels and edges.

Every edge gets a waypoint in each row that it passes, and its label is one of them, so labels get room as
nodes do and nothing overlaps.  `networkx.multipartite_layout` knows no sizes and no labels, and needs NumPy.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from statistics import fmean
from typing import Final

Size = tuple[float, float]
Point = tuple[float, float]
Place = str | tuple[int, int]
"""A node by name, or a waypoint by the number of its edge and its row."""

_GAP_X: Final = 28.0
_GAP_Y: Final = 22.0
_SWEEPS: Final = 24


@dataclass(frozen=True)
class LayoutEdge:
    """An edge to be laid out.

    Attributes:
        source: Name of the node where it starts.
        target: Name of the node where it ends.
        label: Width and height of its label in pixels; (0, 0) for none.
    """

    source: str
    target: str
    label: Size


@dataclass(frozen=True)
class DiagramLayout:
    """Positions of a diagram's parts, in pixels from the upper left corner.

    Attributes:
        nodes: Centre (x, y) of each node, by name.
        labels: Centre (x, y) of each label, by the number of its edge.
        edge_paths: Points (x, y) of each edge, from source to target, in the order of the edges.
        size: Width and height of the diagram.
    """

    nodes: Mapping[str, Point]
    labels: Mapping[int, Point]
    edge_paths: tuple[tuple[Point, ...], ...]
    size: Size


def layered_layout(
    ranks: Mapping[str, int], sizes: Mapping[str, Size], edges: Sequence[LayoutEdge]
) -> DiagramLayout:
    """Lay a diagram out in rows from top to bottom.

    Args:
        ranks: row of each node, from 0; labels stand in rows of their own between those.
        sizes: width and height of each node in pixels.
        edges: edges between the nodes; several may join the same two, or a node with itself.

    Returns:
        The positions.  Nodes and labels do not overlap, and no two edges end at the same point.
    """
    rows: defaultdict[int, list[Place]] = defaultdict(list)
    for name, rank in ranks.items():
        rows[2 * rank].append(name)
    boxes: dict[Place, Size] = {name: sizes[name] for name in ranks}
    labels: dict[int, Place] = {}
    chains: list[list[Place]] = []
    for number, edge in enumerate(edges):
        start, end = 2 * ranks[edge.source], 2 * ranks[edge.target]
        step = 1 if end >= start else -1
        waypoints: list[Place] = []
        for row in range(start + step, end, step) if start != end else (start + 1,):
            waypoints.append((number, row))
            rows[row].append((number, row))
            boxes[number, row] = (0.0, 0.0)
        boxes[waypoints[0]] = edge.label
        if edge.label != (0, 0):
            labels[number] = waypoints[0]
        chains.append([edge.source, *waypoints, edge.target])
    x = _x_positions(rows, boxes, chains)
    left = min(x[place] - width / 2 for place, (width, _) in boxes.items()) - _GAP_X
    right = max(x[place] + width / 2 for place, (width, _) in boxes.items()) + _GAP_X
    centres: dict[Place, Point] = {}
    bottom = _GAP_Y
    for row in sorted(rows):
        height = max(boxes[place][1] for place in rows[row])
        centres |= {place: (x[place] - left, bottom + height / 2) for place in rows[row]}
        bottom += height + _GAP_Y
    return DiagramLayout(
        {name: centres[name] for name in ranks},
        {number: centres[place] for number, place in labels.items()},
        _edge_paths([[centres[place] for place in chain] for chain in chains], edges, sizes),
        (right - left, bottom),
    )


def _x_positions(
    rows: Mapping[int, list[Place]], boxes: Mapping[Place, Size], chains: Sequence[Sequence[Place]]
) -> dict[Place, float]:
    """Place each row near the means of its neighbours, after sweeps that sort it by those in the row before.

    Source: Sugiyama, Tagawa and Toda, 1981 (barycentres).
    """
    neighbours: dict[Place, list[Place]] = {place: [] for place in boxes}
    for chain in chains:
        for place, other in pairwise(chain):
            neighbours[place].append(other)
            neighbours[other].append(place)
    x = dict.fromkeys(boxes, 0.0)
    for sweep in range(2 * _SWEEPS):
        row_before: set[Place] = set()
        for row in sorted(rows, reverse=sweep % 2 == 1):
            is_sorting = sweep < _SWEEPS
            wanted = {
                place: fmean([x[one] for one in near] or [x[place]])
                for place in rows[row]
                for near in [[one for one in neighbours[place] if not is_sorting or one in row_before]]
            }
            if is_sorting:
                rows[row].sort(key=wanted.__getitem__)
                row_before = set(rows[row])
            x |= _separate([(place, wanted[place], boxes[place][0]) for place in rows[row]])
    return x


def _separate(row: Sequence[tuple[Place, float, float]]) -> dict[Place, float]:
    """Move the places of a row apart, each as near to its wanted position as the others allow.

    Args:
        row: place, wanted position and width, from left to right.

    Returns:
        The least-squares positions with gaps between: isotonic regression by pooling adjacent violators.
    """
    offsets = [0.0]
    for (_, _, width), (_, _, next_width) in pairwise(row):
        offsets.append(offsets[-1] + (width + next_width) / 2 + _GAP_X)
    pools: list[list[float]] = []
    for (_, wanted, _), offset in zip(row, offsets, strict=True):
        pools.append([wanted - offset])
        while len(pools) > 1 and fmean(pools[-2]) > fmean(pools[-1]):
            pools[-2:] = [pools[-2] + pools[-1]]
    means = [fmean(pool) for pool in pools for _ in pool]
    return {place: mean + offset for (place, _, _), mean, offset in zip(row, means, offsets, strict=True)}


def _edge_paths(
    chains: list[list[Point]], edges: Sequence[LayoutEdge], sizes: Mapping[str, Size]
) -> tuple[tuple[Point, ...], ...]:
    """Move the ends of edges to the borders of nodes, side by side in the order of where they lead."""
    paths = [list(chain) for chain in chains]
    borders: defaultdict[tuple[str, bool], list[tuple[float, int, int]]] = defaultdict(list)
    for number, (chain, edge) in enumerate(zip(chains, edges, strict=True)):
        for end, after, name in ((0, 1, edge.source), (-1, -2, edge.target)):
            borders[name, chain[after][1] > chain[end][1]].append((chain[after][0], number, end))
    for (name, is_below), ends in borders.items():
        width, height = sizes[name]
        for position, (_, number, end) in enumerate(sorted(ends), 1):
            x, y = chains[number][end]
            aside = width * (position / (len(ends) + 1) - 0.5)
            paths[number][end] = (x + aside, y + height / 2 * (1 if is_below else -1))
    return tuple(map(tuple, paths))
