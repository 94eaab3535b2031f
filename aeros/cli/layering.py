"""Where nodes, labels and arrows of a drawing go: layers from top to bottom, by Sugiyama's method.

An arrow is cut where it passes a layer, and its label is one of its cuts, so that labels get room as
nodes do and nothing lies on anything else.  Within a layer the order is by barycentres (Sugiyama,
Tagawa and Toda, 1981); then each thing is placed as near to what it is tied to as order and sizes
allow, which is a least-squares problem that pooling adjacent violators solves.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Final

Size = tuple[float, float]
Point = tuple[float, float]

_GAP_X: Final = 28.0
_GAP_Y: Final = 22.0
_SWEEPS: Final = 24


@dataclass(frozen=True)
class Tie:
    """One arrow: between which nodes, and the size of its label, (0, 0) where it has none."""

    source: str
    target: str
    label: Size


@dataclass(frozen=True)
class Layout:
    """In pixels: the centre of each node, of each label by the number of its arrow, and each arrow's way."""

    nodes: Mapping[str, Point]
    labels: Mapping[int, Point]
    ways: tuple[tuple[Point, ...], ...]
    size: Size


@dataclass
class _Layers:
    """What lies in each layer, from left to right; a cut of an arrow is called by its place on the way."""

    rows: defaultdict[int, list[str]] = field(default_factory=lambda: defaultdict(list))
    sizes: dict[str, Size] = field(default_factory=dict)
    joined: list[tuple[str, str]] = field(default_factory=list)

    def put(self, name: str, row: int, size: Size) -> None:
        self.rows[row].append(name)
        self.sizes[name] = size


def laid_out(ranks: Mapping[str, int], sizes: Mapping[str, Size], ties: Sequence[Tie]) -> Layout:
    """The layout of nodes in the layers that `ranks` gives; labels have layers between those."""
    layers = _Layers()
    rows = {name: 2 * rank for name, rank in ranks.items()}
    for name, row in rows.items():
        layers.put(name, row, sizes[name])
    chains = [_cut(number, tie, rows, layers) for number, tie in enumerate(ties)]
    neighbours = _neighbours(layers)
    for sweep in range(_SWEEPS):
        _order(layers, neighbours, downward=sweep % 2 == 0)
    x = _abscissas(layers, neighbours)
    y, height = _ordinates(layers)
    row_of = {name: row for row, names in layers.rows.items() for name in names}
    centres = {name: (x[name], y[row_of[name]]) for name in layers.sizes}
    left = min(x[name] - size[0] / 2 for name, size in layers.sizes.items()) - _GAP_X
    right = max(x[name] + size[0] / 2 for name, size in layers.sizes.items()) + _GAP_X
    moved = {name: (at[0] - left, at[1]) for name, at in centres.items()}
    labels = {
        number: moved[_place(number, _labelled(tie, rows))]
        for number, tie in enumerate(ties)
        if tie.label != (0, 0)
    }
    ways = _ways([[moved[one] for one in chain] for chain in chains], ties, layers.sizes)
    return Layout({name: moved[name] for name in ranks}, labels, ways, (right - left, height))


def _place(number: int, row: int) -> str:
    return f"{number} passes {row}"


def _labelled(tie: Tie, rows: Mapping[str, int]) -> int:
    """The layer where the label of an arrow goes: next to where it comes from."""
    return rows[tie.source] + (-1 if rows[tie.target] < rows[tie.source] else 1)


def _cut(number: int, tie: Tie, rows: Mapping[str, int], layers: _Layers) -> list[str]:
    """The way of an arrow from node to node, with a place in every layer that it passes.

    Along a layer, or back to itself, it passes the one below.
    """
    start, end, label = rows[tie.source], rows[tie.target], _labelled(tie, rows)
    passed = [label] if start == end else list(range(start, end, 1 if end > start else -1))[1:]
    for row in passed:
        layers.put(_place(number, row), row, tie.label if row == label else (0.0, 0.0))
    chain = [tie.source, *(_place(number, row) for row in passed), tie.target]
    layers.joined += pairwise(chain)
    return chain


def _neighbours(layers: _Layers) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {name: [] for name in layers.sizes}
    for one, other in layers.joined:
        found[one].append(other)
        found[other].append(one)
    return found


def _order(layers: _Layers, neighbours: Mapping[str, Sequence[str]], *, downward: bool) -> None:
    """Sort each layer by the mean position of what it is tied to in the layer before."""
    before: dict[str, float] = {}
    for row in sorted(layers.rows, reverse=not downward):
        names = layers.rows[row]
        place = {name: position / len(names) for position, name in enumerate(names)}
        for name in names:
            mean = _mean([before[one] for one in neighbours[name] if one in before])
            place[name] = place[name] if mean is None else mean
        names.sort(key=place.__getitem__)
        before = {name: (position + 0.5) / len(names) for position, name in enumerate(names)}


def _mean(numbers: Sequence[float]) -> float | None:
    return sum(numbers) / len(numbers) if numbers else None


def _abscissas(layers: _Layers, neighbours: Mapping[str, Sequence[str]]) -> dict[str, float]:
    x: dict[str, float] = {}
    for names in layers.rows.values():
        x |= dict(zip(names, _apart(names, [0.0] * len(names), layers.sizes), strict=True))
    for sweep in range(_SWEEPS):
        for row in sorted(layers.rows, reverse=sweep % 2 == 1):
            names = layers.rows[row]
            wanted = [_mean([x[one] for one in neighbours[name]]) for name in names]
            near = [x[name] if want is None else want for name, want in zip(names, wanted, strict=True)]
            x |= dict(zip(names, _apart(names, near, layers.sizes), strict=True))
    return x


def _apart(names: Sequence[str], wanted: Sequence[float], sizes: Mapping[str, Size]) -> list[float]:
    """Positions nearest to the wanted ones, in this order and with gaps between: isotonic regression."""
    offsets = [0.0]
    for one, other in pairwise(names):
        offsets.append(offsets[-1] + (sizes[one][0] + sizes[other][0]) / 2 + _GAP_X)
    pools: list[tuple[float, int]] = []  # mean and number of what moves together
    for want, offset in zip(wanted, offsets, strict=True):
        mean, count = want - offset, 1
        while pools and pools[-1][0] > mean:
            above, more = pools.pop()
            mean, count = (mean * count + above * more) / (count + more), count + more
        pools.append((mean, count))
    means = (mean for mean, count in pools for _ in range(count))
    return [mean + offset for mean, offset in zip(means, offsets, strict=True)]


def _ordinates(layers: _Layers) -> tuple[dict[int, float], float]:
    """The middle of each layer, and the height of all."""
    top, middles = _GAP_Y, {}
    for row in sorted(layers.rows):
        tallest = max(layers.sizes[name][1] for name in layers.rows[row])
        middles[row] = top + tallest / 2
        top += tallest + _GAP_Y
    return middles, top


def _ways(
    chains: list[list[Point]], ties: Sequence[Tie], sizes: Mapping[str, Size]
) -> tuple[tuple[Point, ...], ...]:
    """The points of each arrow, from the border of one node to that of the other.

    The ends at one border stand side by side, in the order of where they come from.
    """
    ways = [list(chain) for chain in chains]
    borders: defaultdict[tuple[str, bool], list[tuple[float, int, int]]] = defaultdict(list)
    for number, (chain, tie) in enumerate(zip(chains, ties, strict=True)):
        for end, name in ((0, tie.source), (-1, tie.target)):
            beside = chain[1 if end == 0 else -2]
            borders[name, beside[1] > chain[end][1]].append((beside[0], number, end))
    for (name, below), ends in borders.items():
        width, height = sizes[name]
        for position, (_, number, end) in enumerate(sorted(ends), 1):
            x, y = chains[number][end]
            across = width * (position / (len(ends) + 1) - 0.5)
            ways[number][end] = (x + across, y + height / 2 * (1 if below else -1))
    return tuple(map(tuple, ways))
