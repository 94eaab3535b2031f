"""Import of behaviour trees (BehaviorTree.CPP v4 XML, and v3 where it means the same) as compositions.

A node becomes a part with the same order of leaves, or it is refused with its line and a reason; nothing is
approximated.  Leaves that take time and conditions that are decided when their turn comes mean the same in
both.  A reactive node whose other children are conditions holds them while its one other child runs.
Source: https://www.behaviortree.dev/docs/category/nodes-library
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

from aeros.apps.trees.leaves import ImportSettings, LeafBinder, TreeScope, identifier
from aeros.apps.trees.library import TreeLibrary
from aeros.apps.trees.reactive_nodes import reactive_form
from aeros.apps.trees.subtree_ports import subtree_ports
from aeros.apps.trees.supported_nodes import (
    FALLBACKS,
    MAX_REPEATS,
    REACTIVE,
    RETRIES,
    SEQUENCES,
    SUBTREES,
    refusal_reason,
)
from aeros.apps.trees.tree_xml import TreeNode
from aeros.spec.model.step_graph import MAX_DEPTH, MAX_STEPS

PartForm = dict[str, Any]
"""A part as a manifest writes it."""

MAX_NODES: Final = 2000
"""The most nodes of one tree, with those of its subtrees each time that they run."""

MAX_NODE_DEPTH: Final = 60
MAX_PART_DEPTH: Final = MAX_DEPTH - 1
"""The deepest part of a composition whose outermost part is no `seq`."""


@dataclass(frozen=True)
class NodeReport:
    """The end of the import of one node.

    Attributes:
        path: the file.
        line: its line, from 1.
        node: its element and ID, or its name.
        reason: reason that it is refused; empty if it was imported.
        note: its form in the composition.
    """

    path: str
    line: int
    node: str
    reason: str
    note: str = ""


@dataclass(frozen=True)
class ImportedTree:
    """A tree as a composition.

    Attributes:
        part: the composition's graph; None if a node was refused.
        reports: every node of the tree, in the order in which it was read.
    """

    part: PartForm | None
    reports: tuple[NodeReport, ...]

    @property
    def refused(self) -> tuple[NodeReport, ...]:
        """The nodes that were refused."""
        return tuple(one for one in self.reports if one.reason)


def import_tree(library: TreeLibrary, tree: str, settings: ImportSettings) -> ImportedTree:
    """Import a tree with its subtrees.

    Args:
        library: the trees of all files.
        tree: ID of the tree, which the library has.
        settings: meaning of the leaves.

    Returns:
        The composition's graph, and each node with the reason if it is refused.
    """
    importer = _Importer(library, settings)
    root = library.trees[tree]
    part = importer.part(root.children[0], _Place((tree,)))
    if part is not None:
        reason = _size_reason(part)
        if reason:
            importer.refuse(root, reason)
    reports = tuple(importer.reports)
    return ImportedTree(None if any(one.reason for one in reports) else part, reports)


@dataclass(frozen=True)
class _Place:
    """Surroundings of a node.

    Attributes:
        trees: IDs of the trees around it, the innermost last.
        goes_on: something follows a failure of it.
        is_repeated: it may run again from its beginning.
        scope: blackboard of the innermost tree.
        depth: number of nodes around it.
    """

    trees: tuple[str, ...]
    goes_on: bool = False
    is_repeated: bool = False
    scope: TreeScope = field(default_factory=TreeScope)
    depth: int = 0


class _NodeReports:
    """Reports on nodes, in the order in which the import comes to them."""

    def __init__(self) -> None:
        self.reports: list[NodeReport] = []

    def refuse(self, node: TreeNode, reason: str) -> None:
        self._report(node, reason)

    def _report(self, node: TreeNode, reason: str, note: str = "") -> None:
        name = node.attributes.get("ID") or node.attributes.get("name") or ""
        shown = f"{node.tag} `{name}`" if name else node.tag
        self.reports.append(NodeReport(node.path, node.line, shown, reason, note))

    def _renote(self, number: int, *, reason: str = "", note: str = "") -> None:
        """Replace what the report with this number says of its node."""
        self.reports[number] = replace(self.reports[number], reason=reason, note=note)


class _Importer(_NodeReports):
    def __init__(self, library: TreeLibrary, settings: ImportSettings) -> None:
        super().__init__()
        self._library = library
        self._leaves = LeafBinder(library, settings)
        self._ignores_ports = settings.ignore_ports
        self._is_full = False

    def part(self, node: TreeNode, place: _Place) -> PartForm | None:
        """Import a node with everything inside it; None after a refusal."""
        if self._refuses_size(node, 1):
            return None
        if place.depth > MAX_NODE_DEPTH:
            self.refuse(
                node, f"the tree is more than {MAX_NODE_DEPTH} deep with its subtrees; make it flatter"
            )
            return None
        place = replace(place, depth=place.depth + 1)
        reason = refusal_reason(node) or self._leaves.fault(node)
        if reason:
            self.refuse(node, reason)
            self._look_inside(node, place)
            return None
        condition = self._leaves.condition(node)
        if condition is not None:
            nodes = list(_within(node))
            if self._refuses_size(node, len(nodes)):
                return None
            for one in nodes:
                self._report(one, "", f"check: {condition}" if one is node else "part of the condition")
            return {"check": condition}
        return self._control(node, place)

    def _refuses_size(self, node: TreeNode, count: int) -> bool:
        """Refuse a tree that has too many nodes with so many more, once; return True then."""
        is_full = len(self.reports) + count > MAX_NODES
        if is_full and not self._is_full:
            self.refuse(node, f"the tree has more than {MAX_NODES} nodes with those of its subtrees")
        self._is_full |= is_full
        return self._is_full

    def _control(self, node: TreeNode, place: _Place) -> PartForm | None:
        match node.tag:
            case tag if tag in SEQUENCES:
                if tag in ("SequenceWithMemory", "SequenceStar") and place.is_repeated:
                    reason = "it would go on at its failed child when it is tried again; a `seq` begins anew"
                    return self._refuse_with_children(node, place, reason)
                self._report(node, "", "seq")
                return _joined("seq", self._parts(node.children, place))
            case tag if tag in FALLBACKS:
                self._report(node, "", "any")
                last = len(node.children) - 1
                inside = replace(place, goes_on=True)
                parts = [
                    self.part(one, place if number == last else inside)
                    for number, one in enumerate(node.children)
                ]
                return _joined("any", parts)
            case "Parallel":
                return self._parallel(node, place)
            case "IfThenElse":
                return self._if_then_else(node, place)
            case tag if tag in (*REACTIVE, "WhileDoElse"):
                return self._reactive(node, place)
            case "Timeout":
                return self._timed(node, place)
            case tag if tag in RETRIES:
                return self._retried(node, place)
            case "Repeat":
                return self._repeated(node, place)
            case "ForceSuccess":
                self._report(node, "", "tolerate")
                part = self.part(node.children[0], replace(place, goes_on=True))
                return None if part is None else {"tolerate": part}
            case "ForceFailure":
                self._report(node, "", "tolerate, and a check that fails")
                part = self.part(node.children[0], replace(place, goes_on=True))
                return None if part is None else {"seq": [{"tolerate": part}, {"check": "false"}]}
            case "Inverter":
                reason = "an action's success cannot be made a failure; invert conditions alone"
                return self._refuse_with_children(node, place, reason)
            case tag if tag in SUBTREES:
                return self._subtree(node, place)
            case _:
                return self._leaf(node, place)

    def _parts(self, nodes: Sequence[TreeNode], place: _Place) -> list[PartForm | None]:
        return [self.part(one, place) for one in nodes]

    def _refuse_with_children(self, node: TreeNode, place: _Place, reason: str) -> PartForm | None:
        self.refuse(node, reason)
        self._look_inside(node, place)
        return None

    def _look_inside(self, node: TreeNode, place: _Place) -> None:
        """Report the nodes inside one that is refused, as each may have a reason of its own."""
        for one in node.children:
            self.part(one, replace(place, goes_on=True))

    def _parallel(self, node: TreeNode, place: _Place) -> PartForm | None:
        count = str(len(node.children))
        wanted = node.attributes.get("success_count", node.attributes.get("success_threshold", "-1"))
        allowed = node.attributes.get("failure_count", node.attributes.get("failure_threshold", "1"))
        if wanted not in ("-1", count) or allowed != "1":
            reason = "it succeeds or fails with some of its children; a `par` needs all to succeed"
            return self._refuse_with_children(node, place, reason)
        number = len(self.reports)
        self._report(node, "", "par")
        parts = self._parts(node.children, place)
        known = [one for one in parts if one is not None]
        if len(known) < len(parts):
            return None
        # A child without an action takes no time: those at the beginning end before an action starts.
        first = next((place for place, one in enumerate(known) if _has_step(one)), len(known))
        if not all(_has_step(one) for one in known[first:]):
            reason = (
                "a child without an action comes after one with an action, which runs by then; put it first"
            )
            self._renote(number, reason=reason)
            return None
        branches = known[first:]
        if len(branches) < 2:
            self._renote(number, note="seq")
        return _joined("seq", [*known[:first], *([_joined("par", branches)] if branches else [])])

    def _reactive(self, node: TreeNode, place: _Place) -> PartForm | None:
        found = reactive_form(node, [self._leaves.condition(one) for one in node.children])
        if isinstance(found, str):
            return self._refuse_with_children(node, place, found)
        number = len(self.reports)
        self._report(node, "", found.note)
        for one in (one for child in node.children if child is not found.child for one in _within(child)):
            self._report(one, "", "part of the condition")
        inside = replace(place, goes_on=True) if found.goes_on else place
        part = self.part(found.child, inside)
        if part is None:
            return None
        if found.guard and not _has_step(part):
            self._renote(number, note="any" if found.is_fallback else "seq")
            return found.idle_part(part)
        return found.part(part, stops=not inside.goes_on)

    def _timed(self, node: TreeNode, place: _Place) -> PartForm | None:
        time = node.attributes.get("msec", "")
        if _number(time) < 1:
            reason = f"`msec` is {_shown(time)}; a composition needs a number of milliseconds above 0"
            return self._refuse_with_children(node, place, reason)
        number = len(self.reports)
        self._report(node, "", f"timeout: {int(time)} ms")
        part = self.part(node.children[0], place)
        if part is None:
            return None
        if not _has_step(part):
            self._renote(number, note="its child, which takes no time")
            return part
        return {"timeout": f"{int(time)} ms", "part": part} | (
            {} if place.goes_on else {"on_failure": "stop"}
        )

    def _if_then_else(self, node: TreeNode, place: _Place) -> PartForm | None:
        condition = self._leaves.condition(node.children[0])
        if condition is None:
            return self._refuse_with_children(
                node, place, "its first child is not a condition; write it as a condition on the state"
            )
        self._report(node, "", f"if: {condition}")
        self._report(node.children[0], "", "part of the condition")
        then, *others = self._parts(node.children[1:], place)
        otherwise = others[0] if others else {"check": "false"}
        if then is None or otherwise is None:
            return None
        return {"if": condition, "then": then, "else": otherwise}

    def _retried(self, node: TreeNode, place: _Place) -> PartForm | None:
        tries = node.attributes.get("num_attempts", "")
        if not 1 <= _number(tries) <= 101:
            reason = f"`num_attempts` is {_shown(tries)}; a composition needs a number from 1 to 101"
            return self._refuse_with_children(node, place, reason)
        self._report(node, "", f"retry: {int(tries) - 1}")
        if int(tries) == 1:
            return self.part(node.children[0], place)
        part = self.part(node.children[0], replace(place, goes_on=True, is_repeated=True))
        if part is None:
            return None
        part = {"seq": [part]} if "retry" in part else part
        return {**part, "retry": int(tries) - 1}

    def _repeated(self, node: TreeNode, place: _Place) -> PartForm | None:
        cycles = node.attributes.get("num_cycles", "")
        if not 1 <= _number(cycles) <= MAX_REPEATS:
            reason = f"`num_cycles` is {_shown(cycles)}; a number from 1 to {MAX_REPEATS} is written out"
            return self._refuse_with_children(node, place, reason)
        self._report(node, "", f"{cycles} times one after the other")
        return _joined("seq", self._parts(node.children * int(cycles), replace(place, is_repeated=True)))

    def _subtree(self, node: TreeNode, place: _Place) -> PartForm | None:
        name = node.attributes.get("ID", "")
        tree = self._library.trees.get(name)
        if tree is None and not self._leaves.is_skill(name):
            self.refuse(
                node,
                f"no tree `{name}` is in these files; add the file that has it, or bind it to a skill by "
                "--action",
            )
            return None
        if name in place.trees:
            self.refuse(node, f"the tree `{name}` runs itself; a composition ends")
            return None
        found = subtree_ports(node, self._library, need_all=not self._ignores_ports)
        if isinstance(found, str):
            self.refuse(node, found)
            return None
        if tree is None:
            attributes = {**found.values, **node.attributes}
            return self._leaf(replace(node, tag="Action", attributes=attributes), place)
        self._report(node, "", f"the tree `{name}`, written out")
        scope = place.scope.inner(found.values, len(self.reports), is_remapped=found.is_remapped)
        return self.part(tree.children[0], replace(place, trees=(*place.trees, name), scope=scope))

    def _leaf(self, node: TreeNode, place: _Place) -> PartForm | None:
        if self._leaves.kind(node) != "Action":
            self.refuse(
                node,
                "no file declares it; bind it by --action or --condition, or add its TreeNodesModel"
                if not node.children
                else "this control node or decorator has no counterpart in a composition",
            )
            if node.children:
                self._look_inside(node, place)
            return None
        skill = self._leaves.skill(node)
        id_ = self._leaves.new_id(identifier(node.attributes.get("name") or skill.rpartition(".")[2]))
        form: PartForm = {"skill": skill}
        if id_ != skill:
            form["id"] = id_
        inputs, reason = self._leaves.inputs(node, id_, place.scope)
        if reason:
            self.refuse(node, reason)
            return None
        if inputs:
            form["inputs"] = inputs
        if not place.goes_on:
            form["on_failure"] = "stop"
        self._report(node, "", f"skill: {skill}")
        return form


def _within(node: TreeNode) -> Iterator[TreeNode]:
    yield node
    for one in node.children:
        yield from _within(one)


def _number(text: str) -> int:
    """Return a number of at most nine digits; -1 for any other text."""
    return int(text) if re.fullmatch(r"[0-9]{1,9}", text) else -1


def _shown(number: str) -> str:
    return f"{number[:20]}…" if len(number) > 20 else number or "missing"


def _joined(form: str, parts: Sequence[PartForm | None]) -> PartForm | None:
    known = [one for one in parts if one is not None]
    if len(known) < len(parts):
        return None
    return known[0] if len(known) == 1 else {form: known}


def _size_reason(part: PartForm) -> str:
    """Return the reason that a plan cannot have this part; empty if it can."""
    actions = sum(isinstance(one.get("skill"), str) for one in _forms(part))
    if not actions:
        return "no action is in it; a composition runs at least one skill"
    if actions > MAX_STEPS:
        return f"it has {actions} actions with those of its subtrees; a plan has at most {MAX_STEPS}"
    depth = _depth(part)
    if depth > MAX_PART_DEPTH:
        return f"its parts are nested {depth} deep; a plan is nested at most {MAX_PART_DEPTH} deep"
    return ""


def _depth(part: PartForm) -> int:
    inner = [one for value in part.values() for one in (value if isinstance(value, list) else [value])]
    parts = [one for one in inner if isinstance(one, dict) and "from" not in one]
    own = 1 + ("retry" in part and "skill" not in part) + ("tolerate" in part or "check" in part)
    return own + max((_depth(one) for one in parts if "skill" not in part), default=0)


def _has_step(part: PartForm) -> bool:
    return any(isinstance(one.get("skill"), str) for one in _forms(part))


def _forms(part: PartForm) -> Iterator[PartForm]:
    yield part
    for value in part.values():
        for one in value if isinstance(value, list) else [value]:
            if isinstance(one, dict) and "from" not in one:
                yield from _forms(one)
