"""The interface of skill code: actions that it asks for, and observations that it receives.

A skill is a generator, `a_t = σ_i(s_t)` of the paper: it yields one `Action` at a time and receives the
observation measured after it. It has no handle to anything else, so the runtime can halt, time out, isolate
and replay it without its help.

    def lift(observed: Observation, inputs: Inputs) -> SkillBody:
        x, y, z = observed["block_position"]
        observed = yield act("move_tool", target=(x, y, z + 0.10), yaw=0.0, speed=0.2)

A skill that declares outputs returns them at its end, by name. A skill that declares `models` receives them
as a third argument:

    def centre(observed: Observation, inputs: Inputs, models: Models) -> SkillBody:
        velocity = models["policy"].run(offset=(0.1, 0.0, 0.2))["velocity"]

Parameters are SI numbers, booleans, enum members as strings, or 3-vectors as tuples.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping
from typing import Any, NamedTuple, Protocol

Observation = Mapping[str, Any]
"""Measured values by vocabulary name, in SI units. A missing value is unknown, never false.

Example:
    >>> observation: aeros.Observation = {"human_distance": 3.2, "holding": False}
"""

Inputs = Mapping[str, Any]
"""Values of the skill's declared inputs, in SI units, with defaults filled in."""


class ModelError(ValueError):
    """A model was called with a value that it does not take, or gave one outside its interface."""


class Model(Protocol):
    """A model of the module: a network, a table or a file, from its certified bytes.

    Attributes:
        content: bytes of its file.
    """

    content: bytes

    def run(self, **inputs: Any) -> Mapping[str, Any]:
        """Evaluate the model. The same inputs give the same outputs.

        Args:
            inputs: every input by name, in SI units: a number, or a tuple of numbers where it has a shape.

        Returns:
            Every output by name, in SI units.

        Raises:
            ModelError: a value is missing, of another shape, not finite or outside its declared range.
        """


Models = Mapping[str, Model]
"""The models that the skill declares, by name."""


class Action(NamedTuple):
    """One action that a skill asks for: an action kind of the site and its parameters.

    An `Action` is only a request: the gate decides it, and the plant executes what the gate allowed.

    Attributes:
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
    """Make an `Action`. Nothing is checked here; the gate checks the action when it decides it.

    Args:
        kind: an action kind of the site's vocabulary.
        parameters: numbers in SI units, booleans, enum members as strings, 3-vectors as tuples.

    Returns:
        The action.

    Example:
        >>> aeros.act("grip", width=0.04, force=8.0)
        Action(kind='grip', parameters={'width': 0.04, 'force': 8.0})
    """
    return Action(kind, parameters)
