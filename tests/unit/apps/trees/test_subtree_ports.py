"""Ports of subtrees: written ones, defaults, and what a composition cannot have."""

from __future__ import annotations

import pytest

from aeros.apps.trees.library import TreeLibrary
from aeros.apps.trees.subtree_ports import SubtreePorts, subtree_ports
from aeros.apps.trees.tree_xml import TreeNode

LIBRARY = TreeLibrary(tree_ports={"S": {"w": "2", "x": ""}}, old_files={"old.xml"})


def ports(path: str = "t.xml", need_all: bool = True, **attributes: str) -> SubtreePorts | str:
    return subtree_ports(TreeNode("SubTree", {"ID": "S", **attributes}, path, 1), LIBRARY, need_all=need_all)


def test_defaults_stand_where_nothing_is_written() -> None:
    assert ports(x="{y}") == SubtreePorts({"w": "2", "x": "{y}"}, False)
    assert ports(need_all=False, w="3") == SubtreePorts({"w": "3"}, False)
    assert ports(_autoremap="true") == SubtreePorts({}, True)
    assert ports("old.xml") == SubtreePorts({}, False)


@pytest.mark.parametrize(
    ("path", "attributes", "reason"),
    [
        ("t.xml", {"w": "3"}, "the tree `S` is declared with the port `x`, which has no default; write it"),
        ("t.xml", {"__autoremap": "1"}, 'with BTCPP_format="4" has `_autoremap`, not `__autoremap`'),
        ("t.xml", {"__shared_blackboard": "true"}, "it shares its blackboard"),
        ("old.xml", {"w": "3"}, "`w` of a SubTree is the name of an entry"),
    ],
)
def test_other_meanings_are_refused(path: str, attributes: dict[str, str], reason: str) -> None:
    found = ports(path, True, **attributes)
    assert isinstance(found, str)
    assert reason in found
