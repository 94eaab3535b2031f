"""Graphs of steps: their text, walks over them, and what replaces their steps."""

from __future__ import annotations

from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.expr import terms as t
from aeros.spec.model.step_graph import (
    FailingPart,
    Fallback,
    If,
    NestedIf,
    Par,
    Part,
    RetriedPart,
    Seq,
    as_nested,
    children_of,
    map_graph_steps,
    steps_of,
    walk_parts,
    without_marks,
)
from tests.unit.agent.dumplings import SPAN


def _if(then: Part[str], otherwise: Part[str] | None) -> Part[str]:
    return If(t.TRUE, "near", then, otherwise, SPAN)


PAR: Part[str] = Par(("b", "c"), SPAN)
CHOICE: Part[str] = _if(PAR, Seq(()))
GRAPH: Part[str] = Seq(("a", CHOICE, "d"))

GRAPHS: st.SearchStrategy[Part[str]] = st.recursive(
    st.sampled_from("abcdef"),
    lambda parts: (
        st.builds(Seq, st.lists(parts, max_size=3).map(tuple))
        | st.builds(lambda inner: Par(inner, SPAN), st.lists(parts, max_size=3).map(tuple))
        | st.builds(_if, parts, st.none() | parts)
        | st.builds(lambda inner: Fallback(inner, SPAN), st.lists(parts, min_size=1, max_size=3).map(tuple))
        | st.builds(lambda inner, retry: RetriedPart(inner, retry, SPAN), parts, st.integers(1, 3))
        | st.just(FailingPart("near", SPAN))
    ),
    max_leaves=12,
)


def test_a_graph_is_written_with_signs() -> None:
    assert str(GRAPH) == "(a → (if near then (b ∥ c) else nothing) → d)"
    assert str(_if("a", None)) == "(if near then a)"
    assert str(Seq(())) == "nothing"


def test_a_part_comes_before_its_own_parts() -> None:
    assert list(walk_parts(GRAPH)) == [GRAPH, "a", CHOICE, PAR, "b", "c", Seq(()), "d"]
    assert list(walk_parts("a")) == ["a"]


def test_direct_parts_are_in_the_order_written() -> None:
    assert children_of(GRAPH) == ("a", CHOICE, "d")
    assert children_of(PAR) == ("b", "c")
    assert children_of(CHOICE) == (PAR, Seq(()))
    assert children_of(_if("a", None)) == ("a",)
    assert children_of("a") == ()


def test_steps_are_in_the_order_written() -> None:
    assert list(steps_of(GRAPH)) == ["a", "b", "c", "d"]
    assert list(steps_of(Seq(()))) == []


def test_alternatives_and_tries_are_shown_and_walked() -> None:
    either: Part[str] = Fallback(("a", RetriedPart("b", 2, SPAN), FailingPart("near", SPAN)), SPAN)
    assert str(either) == "(a or else (b, at most 3 tries) or else fail)"
    assert list(steps_of(either)) == ["a", "b"]
    assert [str(one) for one in walk_parts(either)][2:] == ["(b, at most 3 tries)", "b", "fail"]


def test_replaced_steps_keep_the_shape() -> None:
    seen: list[str] = []

    def number(step: str) -> int:
        seen.append(step)
        return len(seen)

    branches: Any = Par((2, 3), SPAN)
    choice: Any = If(t.TRUE, "near", branches, Seq(()), SPAN)
    assert map_graph_steps(GRAPH, number) == Seq((1, choice, 4))
    assert seen == ["a", "b", "c", "d"]
    assert map_graph_steps(_if("a", None), str.upper) == _if("A", None)


@given(GRAPHS)
def test_replacing_each_step_by_itself_changes_nothing(graph: Part[str]) -> None:
    assert map_graph_steps(graph, lambda step: step) == graph


@given(GRAPHS)
def test_steps_of_a_replaced_graph_are_the_replaced_steps(graph: Part[str]) -> None:
    assert list(steps_of(map_graph_steps(graph, str.upper))) == [step.upper() for step in steps_of(graph)]


@given(GRAPHS)
def test_a_nested_graph_differs_in_the_marks_of_its_choices_alone(graph: Part[str]) -> None:
    marked = as_nested(graph)
    assert str(marked) == str(graph)
    assert all(isinstance(one, NestedIf) for one in walk_parts(marked) if isinstance(one, If))
    assert as_nested(marked) == marked
    assert map_graph_steps(marked, lambda step: step) == marked
    assert without_marks(marked) == graph


@given(GRAPHS)
def test_steps_are_replaced_in_the_order_written(graph: Part[str]) -> None:
    seen: list[str] = []
    map_graph_steps(graph, seen.append)
    assert seen == list(steps_of(graph))
