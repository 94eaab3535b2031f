"""Ports of a subtree: those that its node writes, and the defaults that its declaration has."""

from __future__ import annotations

from typing import NamedTuple

from aeros.apps.trees.library import TreeLibrary
from aeros.apps.trees.supported_nodes import ports_of
from aeros.apps.trees.tree_xml import TreeNode


class SubtreePorts(NamedTuple):
    """Ports of the node of a subtree.

    Attributes:
        values: text by name of the port.
        is_remapped: its other entries are those of the tree around it with the same names.
    """

    values: dict[str, str]
    is_remapped: bool


def subtree_ports(node: TreeNode, library: TreeLibrary, *, need_all: bool) -> SubtreePorts | str:
    """Find the ports of a subtree.

    Args:
        node: the node of a subtree.
        library: the trees of all files.
        need_all: refuse a node without a declared port that has no default.

    Returns:
        The ports, or the reason that they mean something that a composition does not have.
    """
    name = node.attributes.get("ID", "")
    ports = ports_of(node)
    is_old_file = node.path in library.old_files
    right, other = ("__autoremap", "_autoremap") if is_old_file else ("_autoremap", "__autoremap")
    is_old = is_old_file and node.tag == "SubTree"
    if is_old and ports:
        return (
            f'in a file without BTCPP_format="4", `{min(ports)}` of a SubTree is the name of an entry, '
            "not a value; convert the file to format 4"
        )
    if other in node.attributes:
        return f'a file {"without" if is_old_file else "with"} BTCPP_format="4" has `{right}`, not `{other}`'
    if node.attributes.get("__shared_blackboard", "false").lower() not in ("false", "0"):
        return "it shares its blackboard; let it remap the entries that it needs"
    is_remapped = node.attributes.get(right, "false").lower() in ("true", "1") and not is_old
    if not is_old_file and not is_remapped:
        declared = library.tree_ports.get(name, {})
        unset = sorted(port for port, default in declared.items() if not default and port not in ports)
        if unset and need_all:
            return f"the tree `{name}` is declared with the port `{unset[0]}`, which has no default; write it"
        ports = {**{port: default for port, default in declared.items() if default}, **ports}
    return SubtreePorts(ports, is_remapped)
