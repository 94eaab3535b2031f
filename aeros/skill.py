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

An action that the gate denies for good, or that the robot cannot do, raises `ActionDenied` where it was
yielded; a skill that does not catch it ends so. A skill that knows several ways to do the same gives them
to `first_allowed`:

    yield from first_allowed(
        observed,
        lambda seen: lift(seen, yaw=0.0),
        lambda seen: lift(seen, yaw=pi / 2.0),
    )
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
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


class ActionDenied(Exception):  # noqa: N818  as `GeneratorExit`, it says what happened
    """The gate denied an action for good, or the robot cannot do it, as it is out of reach.

    Nothing moved, unless the robot was on a way round an obstacle: then it stands where that broke off. The
    text names the rules, and no measured values. A denial that may pass by waiting, as with a person nearby,
    is no such one: it ends the skill, and the agent asks again later.

    Attributes:
        observed: values measured after the denial, as an action would have returned them.
        denials: number of denials that no other way made up for: this one, or those of all ways.
    """

    def __init__(self, reason: str, observed: Observation, denials: int = 1) -> None:
        super().__init__(reason)
        self.observed = observed
        self.denials = denials


Way = Callable[[Observation], Generator[Action, Observation, Observation]]
"""One way to do something: takes the values measured now, yields actions, returns those measured last."""


def first_allowed(observed: Observation, *ways: Way) -> Generator[Action, Observation, Observation]:
    """Do something in the first way in which no action is denied.

    A denial counts as a failure of its way, and the next way begins from where the robot is then.

    Args:
        observed: values measured now.
        ways: ways in the order of trial; at least one.

    Yields:
        The actions of one way after the other.

    Returns:
        What the way that was not denied returns.

    Raises:
        ActionDenied: every way was denied; this is the denial of the last one, and counts those of all.
        ValueError: there is no way.
    """
    caught: list[ActionDenied] = []
    for way in ways:
        try:
            return (yield from way(observed))
        except ActionDenied as denial:
            caught.append(denial)
            observed = denial.observed
    if not caught:
        raise ValueError("no way is given")
    raise ActionDenied(str(caught[-1]), observed, sum(one.denials for one in caught)) from caught[-1]
