"""Reasons against nodes of BehaviorTree.CPP that hold wherever they stand."""

from __future__ import annotations

import pytest

from aeros.apps.trees.supported_nodes import is_built_in, leaf_name, refusal_reason
from aeros.apps.trees.tree_xml import TreeNode


def node(tag: str, children: int = 0, **attributes: str) -> TreeNode:
    return TreeNode(tag, attributes, "t.xml", 1, [TreeNode("Leaf", {}, "t.xml", 1)] * children)


def test_built_in_nodes_are_known() -> None:
    names = ("Sequence", "AlwaysFailure", "Script", "RoundRobin", "Switch3", "MoveTo")
    assert [is_built_in(name) for name in names] == [True, True, True, True, True, False]


def test_a_leaf_has_one_name_in_both_forms() -> None:
    assert leaf_name(node("Action", ID="MoveTo")) == leaf_name(node("MoveTo", name="x")) == "MoveTo"


@pytest.mark.parametrize(
    ("one", "reason"),
    [
        (node("Sequence", 2, name="a", _uid="1"), ""),
        (node("MoveTo", goal="{g}"), ""),
        (node("SubTree", ID="T", _autoremap="true", port="1"), ""),
        (node("Sequence", 1, _while="x"), "`_while` is a script over a blackboard"),
        (node("MoveTo", _onSuccess="x:=1"), "`_onSuccess` is a script over a blackboard"),
        (node("Switch3", 4, variable="{x}"), "it reads a blackboard"),
        (node("IfThenElse", 4), "it has 4 children; it needs 2 to 3"),
        (node("Action", 1, ID="A"), "it has 1 children; it needs 0"),
        (node("Parallel", 2, threshold="1"), "`threshold` is not an attribute of it"),
        (node("Timeout", 2, msec="5"), "it has 2 children; it needs 1"),
        (node("Timeout", 1, seconds="5"), "`seconds` is not an attribute of it"),
        (node("ReactiveSequence", 0), "it has 0 children; it needs 1 or more"),
        (node("WhileDoElse", 4), "it has 4 children; it needs 2 to 3"),
    ],
)
def test_a_reason_is_given(one: TreeNode, reason: str) -> None:
    found = refusal_reason(one)
    assert found.startswith(reason)
    assert bool(found) is bool(reason)
