"""Laws of the layout: whatever the graph, nothing lies on anything else, and arrows meet their nodes."""

from __future__ import annotations

from itertools import combinations

from hypothesis import given
from hypothesis import strategies as st

from aeros.apps.drawings.layering import DiagramLayout, LayoutEdge, layered_layout

SIZES = st.tuples(st.floats(10, 300), st.floats(10, 90))


@st.composite
def graphs(draw: st.DrawFn) -> tuple[dict[str, int], dict[str, tuple[float, float]], list[LayoutEdge]]:
    names = [f"n{number}" for number in range(draw(st.integers(1, 8)))]
    ranks = {name: draw(st.integers(0, 4)) for name in names}
    sizes = {name: draw(SIZES) for name in names}
    label = st.just((0.0, 0.0)) | SIZES
    ties = st.builds(LayoutEdge, st.sampled_from(names), st.sampled_from(names), label)
    return ranks, sizes, draw(st.lists(ties, max_size=12))


@given(graphs())
def test_nothing_overlaps_and_all_of_it_is_on_the_page(
    graph: tuple[dict[str, int], dict[str, tuple[float, float]], list[LayoutEdge]],
) -> None:
    ranks, sizes, ties = graph
    layout = layered_layout(ranks, sizes, ties)
    boxes = [(layout.nodes[name], size) for name, size in sizes.items()]
    boxes += [(at, ties[number].label) for number, at in layout.labels.items()]
    assert set(layout.labels) == {number for number, tie in enumerate(ties) if tie.label != (0, 0)}
    for (x, y), (width, height) in boxes:
        assert width / 2 <= x <= layout.size[0] - width / 2
        assert height / 2 <= y <= layout.size[1] - height / 2
    for ((x0, y0), (w0, h0)), ((x1, y1), (w1, h1)) in combinations(boxes, 2):
        assert abs(x0 - x1) >= (w0 + w1) / 2 or abs(y0 - y1) >= (h0 + h1) / 2


@given(graphs())
def test_arrows_go_from_border_to_border_through_their_labels_and_no_two_share_an_end(
    graph: tuple[dict[str, int], dict[str, tuple[float, float]], list[LayoutEdge]],
) -> None:
    ranks, sizes, ties = graph
    layout = layered_layout(ranks, sizes, ties)
    ends = []
    for number, (tie, way) in enumerate(zip(ties, layout.edge_paths, strict=True)):
        for name, (x, y) in ((tie.source, way[0]), (tie.target, way[-1])):
            (cx, cy), (width, height) = layout.nodes[name], sizes[name]
            assert abs(abs(y - cy) - height / 2) < 1e-6
            assert abs(x - cx) < width / 2
            ends.append((x, y))
        assert number not in layout.labels or layout.labels[number] in way
    assert len(set(ends)) == len(ends)


def test_a_lower_rank_is_drawn_lower_and_a_chain_is_drawn_upright() -> None:
    layout: DiagramLayout = layered_layout(
        {"a": 0, "b": 1, "c": 2},
        {"a": (40, 20), "b": (90, 20), "c": (60, 20)},
        [LayoutEdge("a", "b", (30, 16)), LayoutEdge("b", "c", (0, 0))],
    )
    (x0, y0), (x1, y1), (x2, y2) = (layout.nodes[name] for name in "abc")
    assert y0 < layout.labels[0][1] < y1 < y2
    assert max(x0, x1, x2) - min(x0, x1, x2) < 1e-3
