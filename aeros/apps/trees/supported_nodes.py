"""Nodes of BehaviorTree.CPP that have a counterpart in a composition, and the reasons against the others."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final

from aeros.apps.trees.tree_xml import TreeNode
from aeros.spec.model.step_graph import MAX_STEPS

MAX_REPEATS: Final = MAX_STEPS
SEQUENCES: Final = ("Sequence", "AsyncSequence", "SequenceWithMemory", "SequenceStar")
FALLBACKS: Final = ("Fallback", "AsyncFallback", "Selector")
RETRIES: Final = ("RetryUntilSuccessful", "RetryUntilSuccesful")
REACTIVE: Final = ("ReactiveSequence", "ReactiveFallback")
SUBTREES: Final = ("SubTree", "SubTreePlus")
_NAMED: Final = (*SUBTREES, "Action", "Condition", "Control", "Decorator")
SCRIPTS: Final = frozenset(
    (
        "_failureIf",
        "_successIf",
        "_skipIf",
        "_while",
        "_onHalted",
        "_onFailure",
        "_onSuccess",
        "_post",
    )
)
"""Attributes that hold scripts.  Others that begin with `_` are editors' notes, which no node reads."""
_REFUSED: Final[Mapping[str, str]] = {
    "ParallelAll": "its children all run to their ends; the branches of a `par` stop at the first failure",
    "ManualSelector": "a person chooses the child; a composition has no such part",
    "Delay": "a part has no delay; let a skill wait",
    "KeepRunningUntilFailure": "it repeats without a bound; a composition ends",
    "RunOnce": "it keeps a state from one run to the next; a composition has none",
    "LoopString": "it repeats for each entry of a queue; a composition has no queues",
    "LoopDouble": "it repeats for each entry of a queue; a composition has no queues",
    "LoopInt": "it repeats for each entry of a queue; a composition has no queues",
    "LoopBool": "it repeats for each entry of a queue; a composition has no queues",
    "ForEach": "it repeats for each entry of a list; a composition has no lists",
    "Script": "scripts change a blackboard, which a composition does not have",
    "ScriptCondition": "scripts read a blackboard, which a composition does not have",
    "Precondition": "scripts read a blackboard, which a composition does not have",
    "SetBlackboard": "it changes a blackboard, which a composition does not have",
    "UnsetBlackboard": "it changes a blackboard, which a composition does not have",
    "SkipUnlessUpdated": "it depends on the time of a blackboard entry; a composition has no blackboard",
    "WaitValueUpdate": "it depends on the time of a blackboard entry; a composition has no blackboard",
    "EntryUpdated": "it depends on the time of a blackboard entry; a composition has no blackboard",
    "Sleep": "a part has no delay; let a skill wait",
    "BlackboardCheckInt": "it reads a blackboard, which a composition does not have",
    "BlackboardCheckDouble": "it reads a blackboard, which a composition does not have",
    "BlackboardCheckString": "it reads a blackboard, which a composition does not have",
    "BlackboardCheckBool": "it reads a blackboard, which a composition does not have",
    "ConsumeQueue": "it repeats for each entry of a queue; a composition has no queues",
    "PipelineSequence": "Nav2's; its earlier children are ticked again while a later one runs",
    "RecoveryNode": "Nav2's; write it as `any` and `retry`, as docs/how-to/behaviour-trees.md shows",
    "RoundRobin": "Nav2's; it keeps a state from one run to the next, a composition has none",
    "RateController": "Nav2's; it ticks its child at a rate, a composition runs each part once",
    "DistanceController": "Nav2's; it ticks its child by distance, a composition runs each part once",
    "SpeedController": "Nav2's; it ticks its child by speed, a composition runs each part once",
    "GoalUpdater": "Nav2's; it changes a blackboard, which a composition does not have",
    "PathLongerOnApproach": "Nav2's; its child is ticked again while the robot moves",
    "SingleTrigger": "Nav2's; it keeps a state from one run to the next, a composition has none",
    "NonblockingSequence": "Nav2's; its children are ticked again while an earlier one runs",
    "PauseResumeController": "Nav2's; it keeps a state from one run to the next, a composition has none",
}


def is_built_in(name: str) -> bool:
    """Tell if a node's ID is one of BehaviorTree.CPP or Nav2, and not a leaf that somebody added.

    Args:
        name: the ID.

    Returns:
        True if it is.
    """
    return name in _REFUSED or name in _CHILDREN or re.fullmatch(r"Switch\d", name) is not None


def refusal_reason(node: TreeNode) -> str:
    """Return a reason against a node that holds wherever it stands.

    Args:
        node: the node.

    Returns:
        The reason in words; empty if there is none.
    """
    if node.tag in _REFUSED:
        return _REFUSED[node.tag]
    if re.fullmatch(r"Switch\d", node.tag):
        return "it reads a blackboard, which a composition does not have"
    if node.tag in _NAMED and not node.attributes.get("ID"):
        return "it has no ID; write the name of the node or tree there"
    for key, value in node.attributes.items():
        if key in SCRIPTS and value:
            return f"`{key}` is a script over a blackboard, which a composition does not have"
    least, most = _CHILDREN.get(node.tag, (0, 0 if node.tag in (*SUBTREES, "Action", "Condition") else None))
    found = len(node.children)
    if found < least or (most is not None and found > most):
        needed = f"{least}" if least == most else f"{least} or more" if most is None else f"{least} to {most}"
        return f"it has {found} children; it needs {needed}"
    known = _ATTRIBUTES.get(node.tag)
    odd = [] if known is None else sorted(ports_of(node).keys() - set(known))
    return f"`{odd[0]}` is not an attribute of it" if odd else ""


def ports_of(node: TreeNode) -> dict[str, str]:
    """Return the attributes of a node that are ports of it.

    Args:
        node: the node.

    Returns:
        Text by name; a port's name never begins with `_`.
    """
    return {
        name: text
        for name, text in node.attributes.items()
        if name not in ("name", "ID") and not name.startswith("_")
    }


_CHILDREN: Final[Mapping[str, tuple[int, int | None]]] = {
    **dict.fromkeys((*SEQUENCES, *FALLBACKS, "Parallel"), (1, None)),
    **dict.fromkeys(REACTIVE, (1, None)),
    **dict.fromkeys((*RETRIES, "Repeat", "ForceSuccess", "ForceFailure", "Inverter", "Timeout"), (1, 1)),
    "IfThenElse": (2, 3),
    "WhileDoElse": (2, 3),
    "AlwaysSuccess": (0, 0),
    "AlwaysFailure": (0, 0),
}
_ATTRIBUTES: Final[Mapping[str, tuple[str, ...]]] = {
    **dict.fromkeys((*SEQUENCES, *FALLBACKS, *REACTIVE, "ForceSuccess", "ForceFailure", "Inverter"), ()),
    **dict.fromkeys(("IfThenElse", "WhileDoElse"), ()),
    "Timeout": ("msec",),
    **dict.fromkeys(RETRIES, ("num_attempts",)),
    "Repeat": ("num_cycles",),
    "Parallel": ("success_count", "failure_count", "success_threshold", "failure_threshold"),
}


def leaf_name(node: TreeNode) -> str:
    """Return the ID of a leaf, in its explicit or its compact form.

    Args:
        node: the leaf.

    Returns:
        Its ID.
    """
    return node.attributes.get("ID", node.tag) if node.tag in ("Action", "Condition") else node.tag
