"""Mutants of a plan: one step dropped, two steps swapped, one step postponed."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations


def mutants_of(plan: Sequence[str]) -> dict[tuple[str, ...], str]:
    """List the mutants of a plan, each once.

    Args:
        plan: its steps.

    Returns:
        The kind of each mutant, `dropped`, `swapped` or `postponed`, by its steps; without the plan itself.
    """
    steps, found = tuple(plan), dict[tuple[str, ...], str]()
    for at in range(len(steps)):
        found.setdefault(steps[:at] + steps[at + 1 :], "dropped")
    for one, other in combinations(range(len(steps)), 2):
        swapped = list(steps)
        swapped[one], swapped[other] = swapped[other], swapped[one]
        found.setdefault(tuple(swapped), "swapped")
    for one, other in combinations(range(len(steps)), 2):
        moved = steps[:one] + steps[one + 1 : other + 1] + (steps[one],) + steps[other + 1 :]
        found.setdefault(moved, "postponed")
    found.pop(steps, None)
    return found
