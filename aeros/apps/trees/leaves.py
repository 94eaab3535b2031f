"""Leaves of behaviour trees: actions as steps with inputs, conditions as expressions over the state."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from aeros.apps.trees.library import LEAF_KINDS, TreeLibrary
from aeros.apps.trees.supported_nodes import (
    FALLBACKS,
    REACTIVE,
    SEQUENCES,
    leaf_name,
    ports_of,
    refusal_reason,
)
from aeros.apps.trees.tree_xml import TreeNode
from aeros.spec.expr.parser import ExpressionSyntaxError, parse

STATE_CONDITION: Final = "StateCondition"
"""ID of a condition that has its expression as the port `expression`, as `aeros export bt` writes it."""


@dataclass(frozen=True)
class ImportSettings:
    """Meaning of leaves.

    Attributes:
        skills: skill that each action runs, by the action's ID; else the ID in lower case.  A subtree that
            no file has may be one of them, too.
        conditions: expression over the state that each condition stands for, by its ID.
        assume_actions: take leaves that no file declares for actions.
        ignore_ports: leave out the ports of leaves.
    """

    skills: Mapping[str, str] = field(default_factory=dict)
    conditions: Mapping[str, str] = field(default_factory=dict)
    assume_actions: bool = False
    ignore_ports: bool = False


def leaf_id(name: str) -> str:
    """Return the ID of the leaf for a skill; BehaviorTree.CPP allows no `.` in an ID.

    Args:
        name: name of the skill, as in `clean_table.wipe`.

    Returns:
        The ID, as in `clean_table-wipe`.
    """
    return name.replace(".", "-")


def declared_name(leaf: str) -> str:
    """Return the name that an unbound leaf stands for.

    Args:
        leaf: ID of the leaf.

    Returns:
        A name in a module or of its own, as `leaf_id` wrote it; else the ID as an identifier.
    """
    is_in_module = re.fullmatch(r"[a-z][a-z0-9_]*[-.][a-z][a-z0-9_]*", leaf)
    return leaf.replace("-", ".") if is_in_module else identifier(leaf)


def identifier(text: str) -> str:
    """Write a name as manifests do.

    Args:
        text: any name, as in `OpenGripper` or `Open Gripper`.

    Returns:
        An identifier, as in `open_gripper`.
    """
    spaced = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", text)
    name = re.sub(r"[^a-z0-9]+", "_", spaced.lower()).strip("_")
    return name if name[:1].isalpha() else f"step_{name}".rstrip("_")


@dataclass(frozen=True)
class TreeScope:
    """Blackboard of one tree: every tree has its own, and sees those of others by its ports alone.

    Attributes:
        ports: values of the ports of the tree, by name; entries in them have the mark of their tree.
        mark: begins the names of the entries of this tree; empty for the outermost tree.
        private_mark: begins the names of its entries that begin with `_`, which no other tree sees.
    """

    ports: Mapping[str, str] = field(default_factory=dict)
    mark: str = ""
    private_mark: str = ""

    def resolve(self, port: str, written: str) -> str:
        """Return a port's value, with the tree of an entry as its mark.

        Args:
            port: name of the port.
            written: its value as the file has it; `=` and `{=}` are the entry that has the port's name.

        Returns:
            A value, or an entry in braces.
        """
        entry = port if written.strip() in ("=", "{=}") else blackboard_entry(written)
        if entry is None:
            return written
        if entry.startswith("@"):
            return f"{{{entry[1:]}}}"
        mark = self.private_mark if entry.startswith("_") else self.mark
        return self.ports.get(entry, f"{{{mark}{entry}}}")

    def inner(self, ports: Mapping[str, str], number: int, *, is_remapped: bool) -> TreeScope:
        """Return the blackboard of a subtree.

        Args:
            ports: its ports as its node has them, by name.
            number: number of the subtree, which no other has.
            is_remapped: its other entries are those of this tree with the same names.

        Returns:
            The blackboard.
        """
        mark = f"{number}\x1f"  # a character that XML cannot have
        own = {port: self.resolve(port, written) for port, written in ports.items()}
        if not is_remapped:
            return TreeScope(own, mark, mark)
        shared = {port: value for port, value in self.ports.items() if not port.startswith("_")}
        return TreeScope({**shared, **own}, self.mark, mark)


class LeafBinder:
    """Binder of the leaves of one tree.

    Args:
        library: the trees of all files.
        settings: meaning of the leaves.
    """

    def __init__(self, library: TreeLibrary, settings: ImportSettings) -> None:
        self._library = library
        self._settings = settings
        self._ids: set[str] = set()
        self._leaf_of: dict[tuple[str, str], str] = {}
        self._outputs: dict[str, str] = {}

    def skill(self, node: TreeNode) -> str:
        """Return the skill that an action runs.

        Args:
            node: the action.

        Returns:
            Its name.
        """
        leaf = leaf_name(node)
        return self._settings.skills.get(leaf, declared_name(leaf))

    def is_skill(self, name: str) -> bool:
        """Tell if the settings bind an ID to a skill.

        Args:
            name: ID of an action or a subtree.

        Returns:
            True if they do.
        """
        return name in self._settings.skills

    def inputs(self, node: TreeNode, step: str, scope: TreeScope) -> tuple[dict[str, Any], str]:
        """Convert the ports of an action.

        Args:
            node: the action.
            step: id of its step.
            scope: blackboard of the tree around it.

        Returns:
            The inputs of the step, and a reason to refuse the action; empty if there is none.
        """
        inputs: dict[str, Any] = {}
        outputs = self._library.output_ports.get(leaf_name(node), set())
        named: dict[str, str] = {}
        for port, written in ports_of(node).items() if not self._settings.ignore_ports else ():
            other = named.setdefault(identifier(port), port)
            if other != port:
                return {}, f"the ports `{other}` and `{port}` are both `{identifier(port)}`; rename one"
            value = scope.resolve(port, written)
            entry = blackboard_entry(value)
            if port in outputs:
                if entry is None:
                    return (
                        {},
                        f"the output port `{port}` is not an entry of the blackboard, as `{{result}}` is",
                    )
                if entry in self._outputs:
                    return {}, f"a second leaf writes `{written}`; give each its own entry"
                self._outputs[entry] = f"{step}.{identifier(port)}"
            elif entry is None:
                inputs[identifier(port)] = value
            elif entry in self._outputs:
                inputs[identifier(port)] = {"from": self._outputs[entry]}
            else:
                return {}, (
                    f"the port `{port}` reads `{written}`, which no leaf before it has as an output, or none "
                    "of its own tree (a SubTree node has to pass it on as a port); "
                    "write a value, or leave ports out by --ignore-ports"
                )
        return inputs, ""

    def new_id(self, wanted: str) -> str:
        """Return an id that no step has yet.

        Args:
            wanted: the id if none has it; else a number is added.

        Returns:
            The id.
        """
        name, number = wanted, 1
        while name in self._ids:
            number += 1
            name = f"{wanted}_{number}"
        self._ids.add(name)
        return name

    def kind(self, node: TreeNode) -> str:
        """Return the kind of a leaf.

        Args:
            node: any node.

        Returns:
            `Action` or `Condition`; empty for a node that is no leaf, or of which no file says what it is.
        """
        leaf = leaf_name(node)
        if node.tag in ("Action", "Condition") and leaf not in (
            *self._settings.skills,
            *self._settings.conditions,
        ):
            return node.tag
        if node.children:
            return ""
        if leaf in self._settings.conditions:
            return "Condition"
        if leaf in self._settings.skills:
            return "Action"
        return self._library.leaf_kinds.get(leaf, "Action" if self._settings.assume_actions else "")

    def condition(self, node: TreeNode) -> str | None:
        """Return the expression for a node that consists of conditions alone.

        Args:
            node: any node.

        Returns:
            A condition on the state; None if an action is in it, or it is refused.
        """
        if refusal_reason(node):
            return None
        match node.tag:
            case "AlwaysSuccess":
                return "true"
            case "AlwaysFailure":
                return "false"
            case "Inverter":
                inner = self.condition(node.children[0])
                return None if inner is None else f"not ({inner})"
            case tag if tag in (*SEQUENCES, *FALLBACKS, *REACTIVE) or _is_conjunction(node):
                parts = [self.condition(one) for one in node.children]
                known = [one for one in parts if one is not None]
                is_fallback = tag in (*FALLBACKS, "ReactiveFallback")
                joined = joined_condition(known, "or" if is_fallback else "and") if known else ""
                return joined if len(known) == len(parts) else None
        if self.kind(node) != "Condition" or self.fault(node):
            return None
        return self._expression(node)

    def fault(self, node: TreeNode) -> str:
        """Return the reason against a leaf that is a condition without an expression, or declared otherwise.

        Args:
            node: any node.

        Returns:
            The reason; empty if there is none.
        """
        leaf = leaf_name(node)
        is_bound = leaf in self._settings.conditions or leaf in self._settings.skills
        declared = self._library.leaf_kinds.get(leaf, node.tag)
        if node.tag in LEAF_KINDS and declared != node.tag and not is_bound:
            return f"it is declared as {declared}; correct that, or bind it by --action or --condition"
        kind = self.kind(node)
        if kind and not is_bound and leaf != STATE_CONDITION:
            reason = self._name_fault(leaf, kind)
            if reason:
                return reason
        if kind != "Condition":
            return ""
        ports = sorted(ports_of(node))
        if leaf == STATE_CONDITION and not is_bound:
            if "expression" not in ports:
                return "it has no `expression`; write the condition on the state there"
        elif ports and not is_bound and not self._settings.ignore_ports:
            return f"a condition on the state has no port `{ports[0]}`; bind the leaf by --condition"
        text = self._expression(node)
        try:
            parse(text)
        except ExpressionSyntaxError as error:
            return f"`{text}` is not a condition on the state: {error.message}"
        return ""

    def _name_fault(self, leaf: str, kind: str) -> str:
        """Return the reason that no name of a skill or a variable stands for this leaf alone."""
        option = "--action" if kind == "Action" else "--condition"
        lost = "".join(one for one in leaf if one.isalnum() and not one.isascii())
        if lost or not any(one.isalnum() for one in leaf):
            letters = f"`{lost}`" if lost else "its characters"
            return f"names have the letters a to z, digits and `_`, not {letters}; bind it by {option}"
        name = declared_name(leaf)
        other = self._leaf_of.setdefault((kind, name), leaf)
        if other != leaf:
            return f"`{other}` and `{leaf}` are both `{name}`; bind one of them by {option}"
        return ""

    def _expression(self, node: TreeNode) -> str:
        leaf = leaf_name(node)
        if leaf == STATE_CONDITION and leaf not in self._settings.conditions:
            return node.attributes.get("expression", "")
        return self._settings.conditions.get(leaf, declared_name(leaf))


def joined_condition(conditions: Sequence[str], word: str) -> str:
    """Join conditions to one.

    Args:
        conditions: expressions, at least one.
        word: `and` or `or`.

    Returns:
        One expression.
    """
    joined = f" {word} ".join(f"({one})" for one in conditions)
    return conditions[0] if len(conditions) == 1 else joined


def _is_conjunction(node: TreeNode) -> bool:
    return node.tag == "WhileDoElse" and len(node.children) == 2


def blackboard_entry(value: str) -> str | None:
    """Return the name of the blackboard entry that a port refers to.

    Args:
        value: value of the port, as in `{goal}`.

    Returns:
        The name; None for a value.
    """
    found = re.fullmatch(r"\s*\{([^{}]*)\}\s*", value)
    return found.group(1) if found else None
