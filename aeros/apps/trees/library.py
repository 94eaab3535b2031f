"""Trees of several files by their IDs, and the ports and kinds of leaves that the files declare."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

from aeros.apps.trees.supported_nodes import is_built_in, leaf_name
from aeros.apps.trees.tree_xml import TreeFileError, TreeNode

LEAF_KINDS = ("Action", "Condition")
_PORTS = ("input_port", "output_port", "inout_port")
_EXPLICIT_KINDS = (*LEAF_KINDS, "Control", "Decorator")


@dataclass
class TreeLibrary:
    """Trees and declared leaves.

    Attributes:
        trees: `<BehaviorTree>` elements by ID.
        first_tree: ID of the tree to run: that which the first file names, or the only one of it that no
            other tree runs; empty if there is none.
        leaf_kinds: `Action` or `Condition` by ID of a leaf, as `<TreeNodesModel>` declares it.
        output_ports: names of the output ports of each declared leaf.
        tree_ports: of each tree that is declared its ports, each with its default; empty for none.
        first_place: file and line of the first file's beginning, where it may name its main tree.
        old_files: files that are not of format 4, in which attributes of `SubTree` mean something else.
    """

    trees: dict[str, TreeNode] = field(default_factory=dict)
    first_tree: str = ""
    leaf_kinds: dict[str, str] = field(default_factory=dict)
    output_ports: dict[str, set[str]] = field(default_factory=dict)
    tree_ports: dict[str, dict[str, str]] = field(default_factory=dict)
    first_place: str = ""
    old_files: set[str] = field(default_factory=set)


def collect_trees(files: Iterable[TreeNode]) -> TreeLibrary:
    """Collect the trees of files.

    Args:
        files: outermost element of each file.

    Returns:
        The trees.

    Raises:
        TreeFileError: a file has no tree, or a tree has no ID, one of another tree, or no single node, or a
            leaf is declared both an action and a condition.
    """
    found = TreeLibrary()
    for number, file in enumerate(files):
        if file.tag != "root":
            reason = f'begins with <{file.tag}>, not with <root BTCPP_format="4">'
            raise TreeFileError(file.path, file.line, reason)
        if file.attributes.get("BTCPP_format") != "4":
            found.old_files.add(file.path)
        own = [one for one in file.children if one.tag == "BehaviorTree"]
        for tree in own:
            name = tree.attributes.get("ID", "") or ("" if len(own) > 1 else "BehaviorTree")
            if not name:
                raise TreeFileError(
                    tree.path, tree.line, "one of several <BehaviorTree>s has no ID; give it one"
                )
            if name in found.trees:
                reason = f"a second tree has the ID `{name}`; rename one, or leave out one file"
                raise TreeFileError(tree.path, tree.line, reason)
            if len(tree.children) != 1:
                reason = f"the tree `{name}` has {len(tree.children)} nodes at its root; it needs exactly one"
                raise TreeFileError(tree.path, tree.line, reason)
            found.trees[name] = replace(tree, children=[_compact(one) for one in tree.children])
        for model in (one for one in file.children if one.tag == "TreeNodesModel"):
            _declare_leaves(model, found)
        if number == 0:
            found.first_tree = file.attributes.get("main_tree_to_execute", "") or _only_root(found)
            found.first_place = f"{file.path}:{file.line}"
    return found


def _compact(node: TreeNode) -> TreeNode:
    """Write a node in the compact form: `<Control ID="Sequence">` is `<Sequence>`."""
    name = node.attributes.get("ID", "")
    tag = node.tag
    if tag in _EXPLICIT_KINDS and name and (tag not in LEAF_KINDS or is_built_in(name)):
        tag = name
    attributes = (
        node.attributes if tag == node.tag else {k: v for k, v in node.attributes.items() if k != "ID"}
    )
    return replace(node, tag=tag, attributes=attributes, children=[_compact(one) for one in node.children])


def _only_root(found: TreeLibrary) -> str:
    """Return the ID of the one tree that no other tree runs; empty if there are several."""
    called = {name for tree in found.trees.values() for name in called_trees(tree)}
    roots = [name for name in found.trees if name not in called]
    return roots[0] if len(roots) == 1 else ""


def called_trees(tree: TreeNode) -> Iterator[str]:
    """Yield the IDs of the subtrees that a tree runs directly.

    Args:
        tree: the tree.

    Yields:
        The IDs, in the order written.
    """
    pending = [tree]
    while pending:
        one = pending.pop()
        if one.tag in ("SubTree", "SubTreePlus"):
            yield one.attributes.get("ID", "")
        pending += reversed(one.children)


def leaf_names(library: TreeLibrary) -> set[str]:
    """Return the IDs of all leaves that trees have.

    Args:
        library: the trees.

    Returns:
        The IDs, with those of subtrees that no file has.
    """
    called = {name for tree in library.trees.values() for name in called_trees(tree)}
    found = called - library.trees.keys()
    pending = [one for tree in library.trees.values() for one in tree.children]
    while pending:
        one = pending.pop()
        pending += one.children
        if not one.children and one.tag not in ("SubTree", "SubTreePlus"):
            found.add(leaf_name(one))
    return found


def _declare_leaves(model: TreeNode, found: TreeLibrary) -> None:
    for leaf in model.children:
        name = leaf.attributes.get("ID", "")
        if leaf.tag in LEAF_KINDS and name:
            if found.leaf_kinds.get(name, leaf.tag) != leaf.tag:
                reason = f"`{name}` is declared both an Action and a Condition; remove one declaration"
                raise TreeFileError(leaf.path, leaf.line, reason)
            found.leaf_kinds[name] = leaf.tag
            ports = {port.attributes.get("name", "") for port in leaf.children if port.tag == "output_port"}
            found.output_ports[name] = ports
        elif leaf.tag == "SubTree" and name:
            declared = (one.attributes for one in leaf.children if one.tag in _PORTS)
            ports_of_tree = {one.get("name", ""): one.get("default", "") for one in declared}
            found.tree_ports.setdefault(name, {}).update(ports_of_tree)
