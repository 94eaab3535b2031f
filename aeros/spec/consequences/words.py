"""Words on a predicate that a step has left at either value, and on the cure."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from aeros.spec.model.ecm import Skill


def unsettled_note(read: Collection[str], steps: Iterable[tuple[str, Skill]]) -> str | None:
    """Say which predicate of a condition is not known any more after the steps of a path.

    Args:
        read: names of what the condition reads that may not hold after them.
        steps: name of each step and its skill, the latest first.

    Returns:
        The predicate, the reading, the step and the cure in words; None if no step leaves one at either
        value.
    """
    for step, skill in steps:
        for name, reading in skill.disturbed.items():
            if name in read and name in skill.unsettled:
                cause = f"`{name}` is defined by {reading}, which `{step}` may change"
                cure = f"state `{name}` as an effect of `{skill.id}`, or run a step that makes it true again"
                return f"{cause}, so it may be either afterwards: {cure}"
    return None
