"""Leaves: their kinds, and nodes that consist of conditions alone as expressions."""

from __future__ import annotations

import pytest

from aeros.apps.trees.leaves import (
    ImportSettings,
    LeafBinder,
    TreeScope,
    blackboard_entry,
    declared_name,
    leaf_id,
)
from aeros.apps.trees.library import TreeLibrary
from aeros.apps.trees.tree_xml import TreeNode, parse_tree

LIBRARY = TreeLibrary(leaf_kinds={"Look": "Action", "Near": "Condition"})


def binder(**settings: object) -> LeafBinder:
    return LeafBinder(LIBRARY, ImportSettings(**settings))  # type: ignore[arg-type]


def node(text: str) -> TreeNode:
    return parse_tree(text.encode(), "t.xml")


def test_a_leaf_is_of_the_kind_that_is_bound_or_declared() -> None:
    one = binder(skills={"Near": "approach"}, conditions={"Safe": "not person_near"})
    texts = ["<Look/>", "<Near/>", "<Safe/>", "<Other/>", '<Condition ID="X"/>', "<Other><Look/></Other>"]
    assert [one.kind(node(text)) for text in texts] == ["Action", "Action", "Condition", "", "Condition", ""]
    assert binder(assume_actions=True).kind(node("<Other/>")) == "Action"


@pytest.mark.parametrize(
    ("text", "expression"),
    [
        ("<Near/>", "near"),
        ("<Sequence><Near/><AlwaysSuccess/></Sequence>", "(near) and (true)"),
        ("<Fallback><Inverter><Near/></Inverter><AlwaysFailure/></Fallback>", "(not (near)) or (false)"),
        ('<Condition ID="StateCondition" expression="x &lt; 1 m"/>', "x < 1 m"),
        ('<Near to="{goal}"/>', None),
        ("<Sequence><Near/><Look/></Sequence>", None),
        ("<Sequence _while='x'><Near/></Sequence>", None),
    ],
)
def test_conditions_become_an_expression(text: str, expression: str | None) -> None:
    assert binder().condition(node(text)) == expression


def test_ports_refer_to_the_blackboard_or_are_values() -> None:
    assert [blackboard_entry(one) for one in ("{goal}", " {goal} ", "goal", "{a}{b}", "1 m")] == [
        *("goal", "goal", None, None, None)
    ]
    outer = TreeScope({"goal": "home", "_own": "x"})
    assert [outer.resolve("p", one) for one in ("{goal}", "{other}", "{=}", "=", "5")] == [
        *("home", "{other}", "{p}", "{p}", "5")
    ]
    inner = outer.inner({"to": "{goal}", "by": "{other}"}, 1, is_remapped=False)
    assert [inner.resolve("to", one) for one in ("{=}", "{by}", "{@root}")] == ["home", "{other}", "{root}"]
    assert inner.resolve("p", "{goal}") == "{1\x1fgoal}"
    remapped = outer.inner({}, 2, is_remapped=True)
    assert [remapped.resolve("p", one) for one in ("{goal}", "{x}", "{_own}")] == [
        *("home", "{x}", "{2\x1f_own}")
    ]


def test_every_step_gets_an_id_of_its_own() -> None:
    one = binder()
    assert [one.new_id("a") for _ in range(3)] == ["a", "a_2", "a_3"]


def test_a_skill_of_another_module_keeps_its_name() -> None:
    assert [declared_name(leaf_id(one)) for one in ("wipe", "clean_table.wipe")] == [
        "wipe",
        "clean_table.wipe",
    ]
    assert [declared_name(one) for one in ("Pick-Up", "a-b-c", "a.b")] == ["pick_up", "a_b_c", "a.b"]
