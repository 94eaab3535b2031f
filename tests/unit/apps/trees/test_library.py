"""Trees of several files, the main one, and what `TreeNodesModel` declares."""

from __future__ import annotations

import pytest

from aeros.apps.trees.library import TreeLibrary, called_trees, collect_trees, leaf_names
from aeros.apps.trees.tree_xml import TreeFileError, parse_tree


def library(*texts: str) -> TreeLibrary:
    return collect_trees(parse_tree(text.encode(), f"{number}.xml") for number, text in enumerate(texts))


LEAF = '<Action ID="A"/>'


def tree(name: str, body: str = LEAF) -> str:
    return f'<BehaviorTree ID="{name}">{body}</BehaviorTree>'


def test_the_main_tree_is_named_or_is_the_one_that_no_other_runs() -> None:
    assert library(f"<root>{tree('A')}</root>").first_tree == "A"
    assert library(f"<root>{tree('A')}{tree('B')}</root>").first_tree == ""
    both = tree("A") + tree("B", '<SubTree ID="A"/>')
    assert library(f"<root>{both}</root>").first_tree == "B"
    assert library(f'<root main_tree_to_execute="A">{both}</root>').first_tree == "A"
    assert library(f"<root><BehaviorTree>{LEAF}</BehaviorTree></root>").first_tree == "BehaviorTree"
    assert list(called_trees(library(f"<root>{both}</root>").trees["B"])) == ["A"]


def test_explicit_nodes_are_compact_ones() -> None:
    inner = '<Decorator ID="ForceSuccess"><Action ID="AlwaysSuccess"/></Decorator>'
    body = f'<Control ID="Sequence" name="x">{inner}</Control>'
    (node,) = library(f"<root>{tree('A', body)}</root>").trees["A"].children
    assert (node.tag, node.attributes) == ("Sequence", {"name": "x"})
    assert [node.children[0].tag, node.children[0].children[0].tag] == ["ForceSuccess", "AlwaysSuccess"]


def test_leaves_are_declared() -> None:
    ports = '<input_port name="w" default="2"/><output_port name="x"/>'
    leaves = f'<SubTree ID="S">{ports}</SubTree><Condition ID="C"/>'
    leaves += '<Action ID="A"><output_port name="out"/></Action>'
    model = f"<TreeNodesModel>{leaves}</TreeNodesModel>"
    found = library(f"<root>{tree('A')}{model}</root>")
    assert found.leaf_kinds == {"C": "Condition", "A": "Action"}
    assert (found.output_ports["A"], found.tree_ports) == ({"out"}, {"S": {"w": "2", "x": ""}})
    calls = tree("A", '<Sequence><B/><SubTree ID="S"/></Sequence>')
    new = library(f'<root BTCPP_format="4">{calls}</root>')
    assert (leaf_names(found), leaf_names(new)) == ({"A"}, {"B", "S"})
    assert (found.old_files, new.old_files) == ({"0.xml"}, set())


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            f"<root>{tree('A')}<TreeNodesModel><Action ID='X'/>\n<Condition ID='X'/></TreeNodesModel></root>",
            "0.xml:2: `X` is declared both an Action and a Condition",
        ),
        ("<tree/>", 'begins with <tree>, not with <root BTCPP_format="4">'),
        (f"<root>{tree('A')}\n{tree('A')}</root>", "0.xml:2: a second tree has the ID `A`"),
        (
            "<root>\n<BehaviorTree/><BehaviorTree/></root>",
            "0.xml:2: one of several <BehaviorTree>s",
        ),
        (f"<root>{tree('A', LEAF * 2)}</root>", "the tree `A` has 2 nodes at its root; it needs exactly one"),
    ],
)
def test_a_faulty_file_is_refused_with_its_line(text: str, message: str) -> None:
    with pytest.raises(TreeFileError) as caught:
        library(text)
    assert message in str(caught.value)
