"""Reactive nodes of BehaviorTree.CPP: conditions are decided at every tick while one other child runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from aeros.apps.trees.leaves import joined_condition
from aeros.apps.trees.tree_xml import TreeNode


@dataclass(frozen=True)
class ReactiveForm:
    """Meaning of a reactive node.

    Attributes:
        child: its one child that is more than a condition.
        guard: the conditions before that child as one; empty if there are none.
        after: the conditions after it.
        is_fallback: the node succeeds with a condition that holds, and else fails with one that does not.
    """

    child: TreeNode
    guard: str
    after: tuple[str, ...]
    is_fallback: bool

    @property
    def held(self) -> str:
        """The condition that is held while the child runs; empty for none."""
        return f"not ({self.guard})" if self.guard and self.is_fallback else self.guard

    @property
    def note(self) -> str:
        """The form in words."""
        return f"hold: {self.held}" if self.guard else "any" if self.is_fallback else "seq"

    @property
    def goes_on(self) -> bool:
        """True if something follows a failure of the child."""
        return self.is_fallback and bool(self.guard or self.after)

    def part(self, child: dict[str, Any], *, stops: bool) -> dict[str, Any]:
        """Make the part of a composition.

        Args:
            child: the child as a part.
            stops: the composition stops as failed after a failure.

        Returns:
            The part, as a manifest writes it.
        """
        held = child
        if self.guard:
            held = {"hold": self.held, "part": child, **({"on_failure": "stop"} if stops else {})}
        if self.is_fallback:
            rest = [*([self.guard] if self.guard else []), *self.after]
            return {"any": [held, {"check": joined_condition(rest, "or")}]} if rest else held
        return {"seq": [held, *({"check": one} for one in self.after)]} if self.after else held

    def idle_part(self, child: dict[str, Any]) -> dict[str, Any]:
        """Make the part of a composition for a child without an action: nothing changes while it runs.

        Args:
            child: the child as a part.

        Returns:
            The part, as a manifest writes it.
        """
        before = [{"check": self.guard}] if self.guard else []
        parts = [*before, child, *({"check": one} for one in self.after)]
        return {"any" if self.is_fallback else "seq": parts}


def reactive_form(node: TreeNode, conditions: Sequence[str | None]) -> ReactiveForm | str:
    """Find the meaning of a reactive node.

    Args:
        node: a `ReactiveSequence`, `ReactiveFallback` or `WhileDoElse`.
        conditions: for each child its expression if it is a condition, else None.

    Returns:
        The meaning, or the reason that a composition has no such part.
    """
    others = [number for number, one in enumerate(conditions) if one is None]
    if node.tag == "WhileDoElse":
        if 0 in others:
            return "its first child is not a condition; write it as a condition on the state"
        if len(node.children) == 3:
            return "it may change between its children without a bound; a composition ends"
    if len(others) > 1:
        return (
            "it runs its children again from the first while a later one runs; at most one of them may be "
            "more than a condition on the state"
        )
    first = others[0]
    known = [one or "" for one in conditions]
    is_fallback = node.tag == "ReactiveFallback"
    before = known[:first]
    guard = joined_condition(before, "or" if is_fallback else "and") if before else ""
    return ReactiveForm(node.children[first], guard, tuple(known[first + 1 :]), is_fallback)
