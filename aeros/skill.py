"""What skill code may know: the action it asks for and the observation it gets back.

A skill is a generator, `a_t = σ_i(s_t)` of the paper: it yields one `Action` at a time and is
sent the observation measured after it.  It holds no handle to anything else, so halting,
time-outs, isolation and replay need no help from it.

    def lift(observed: Observation, inputs: Inputs) -> SkillBody:
        x, y, z = observed["wrapper_position"]
        observed = yield act("move_tool", target=(x, y, z + 0.10), yaw=0.0, speed=0.2)

At its end it returns the outputs that it declares, by name, if it has any to give.
Parameters are SI numbers, booleans, enum members as strings, or 3-vectors as tuples.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping
from typing import Any, NamedTuple

Observation = Mapping[str, Any]
"""Measured values by vocabulary name, SI units.  A name that is absent is unknown, never false.

Example:
    >>> observation: aeros.Observation = {"human_distance": 3.2, "holding": False}
"""

Inputs = Mapping[str, Any]
"""The skill's declared inputs, SI units, defaults filled in."""


class Action(NamedTuple):
    """One action a skill asks for: a kind of the site's vocabulary and its parameters.

    Asking is all it does: the gate decides, and the plant executes what was decided.

    kind: an action kind of the site's vocabulary.
    parameters: by name; numbers in SI units, booleans, enum members as strings, 3-vectors as tuples.

    Example:
        >>> aeros.Action("wait", {"duration": 0.5}) == aeros.act("wait", duration=0.5)
        True
    """

    kind: str
    parameters: Mapping[str, Any]


SkillBody = Generator[Action, Observation, Any]


def act(kind: str, **parameters: Any) -> Action:
    """Make an `Action`; the gate checks it, and nothing is checked here.

    Args:
        kind: An action kind of the site's vocabulary.
        parameters: Numbers in SI units, booleans, enum members as strings, 3-vectors as tuples.

    Returns:
        The action.

    Example:
        >>> aeros.act("grip", width=0.04, force=8.0)
        Action(kind='grip', parameters={'width': 0.04, 'force': 8.0})
    """
    return Action(kind, parameters)
