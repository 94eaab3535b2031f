"""Reactive nodes with conditions and one other child hold the conditions while it runs."""

from __future__ import annotations

from typing import Any

import pytest

from aeros.apps.trees.reactive_nodes import ReactiveForm, reactive_form
from aeros.apps.trees.tree_xml import TreeNode

DO = {"skill": "a"}


def node(tag: str, *conditions: str | None) -> ReactiveForm | str:
    children = [TreeNode("leaf", {"name": str(number)}, "t.xml", 1) for number in range(len(conditions))]
    return reactive_form(TreeNode(tag, {}, "t.xml", 1, children), conditions)


@pytest.mark.parametrize(
    ("tag", "conditions", "held", "part"),
    [
        ("ReactiveSequence", ("c", None), "c", {"hold": "c", "part": DO, "on_failure": "stop"}),
        ("WhileDoElse", ("c", None), "c", {"hold": "c", "part": DO, "on_failure": "stop"}),
        ("ReactiveSequence", (None,), "", DO),
        ("ReactiveFallback", (None,), "", DO),
        (
            "ReactiveSequence",
            ("c", "d", None, "e"),
            "(c) and (d)",
            {"seq": [{"hold": "(c) and (d)", "part": DO, "on_failure": "stop"}, {"check": "e"}]},
        ),
        (
            "ReactiveFallback",
            ("c", "d", None),
            "not ((c) or (d))",
            {"any": [{"hold": "not ((c) or (d))", "part": DO}, {"check": "(c) or (d)"}]},
        ),
        ("ReactiveFallback", (None, "e"), "", {"any": [DO, {"check": "e"}]}),
    ],
)
def test_conditions_are_held(
    tag: str, conditions: tuple[str | None, ...], held: str, part: dict[str, Any]
) -> None:
    found = node(tag, *conditions)
    assert isinstance(found, ReactiveForm)
    assert (found.held, found.child.attributes["name"]) == (held, str(conditions.index(None)))
    assert found.part(DO, stops=not found.goes_on) == part


@pytest.mark.parametrize(
    ("tag", "conditions", "reason"),
    [
        ("ReactiveSequence", (None, None), "it runs its children again from the first"),
        ("ReactiveFallback", ("c", None, "d", None), "it runs its children again from the first"),
        ("WhileDoElse", (None, None), "its first child is not a condition"),
        ("WhileDoElse", ("c", None, None), "it may change between its children without a bound"),
    ],
)
def test_nodes_that_no_part_carries_are_refused(
    tag: str, conditions: tuple[str | None, ...], reason: str
) -> None:
    found = node(tag, *conditions)
    assert isinstance(found, str)
    assert found.startswith(reason)
