"""Connected components of masks."""

from __future__ import annotations

import networkx as nx
import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from aeros.perception.components import connected_components, largest_component

MASKS = st.tuples(st.integers(1, 9), st.integers(1, 9)).flatmap(lambda shape: arrays(np.bool_, shape))


def drawn(*rows: str) -> NDArray[np.bool_]:
    return np.array([[sign == "#" for sign in row] for row in rows])


def test_components_are_numbered_in_the_order_of_their_first_pixels() -> None:
    labels, count = connected_components(drawn("#..#", "#.##", "....", "##.#"))
    assert count == 4
    assert labels.tolist() == [[1, 0, 0, 2], [1, 0, 2, 2], [0, 0, 0, 0], [3, 3, 0, 4]]


def test_arms_that_meet_below_are_one_component() -> None:
    labels, count = connected_components(drawn("#.#.#", "#.#.#", "#####"))
    assert count == 1
    assert labels.max() == 1


@given(MASKS)
def test_components_are_those_of_the_graph_of_neighbours(mask: NDArray[np.bool_]) -> None:
    graph = nx.grid_2d_graph(*mask.shape)
    graph.remove_nodes_from([place for place in list(graph) if not mask[place]])
    expected = {frozenset(one) for one in nx.connected_components(graph)}
    labels, count = connected_components(mask)
    found = {
        frozenset(zip(*(part.tolist() for part in np.nonzero(labels == number)), strict=True))
        for number in range(1, count + 1)
    }
    assert found == expected
    assert ((labels > 0) == mask).all()
    largest = largest_component(mask)
    assert largest.sum() == max(map(len, expected), default=0)
    assert (mask | ~largest).all()


def test_of_equal_components_the_first_is_the_largest() -> None:
    assert largest_component(drawn("##.##")).tolist() == [[True, True, False, False, False]]


def test_an_empty_mask_has_no_component() -> None:
    mask = np.zeros((3, 4), np.bool_)
    assert connected_components(mask)[1] == 0
    assert not largest_component(mask).any()
