"""Contract of skill code: starts its generator, copies its actions, and turns its errors into words.

Used wherever skill code runs: in a worker, and in the runtime's own process for modules that the site
trusts. It imports very little, so that a worker holds very little.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from aeros.descriptions import describe_exception, type_name
from aeros.skill import Action, ActionDenied, Inputs, Models, Observation, SkillBody

MAX_PARAMETERS: Final = 64
"""Limit on the parameters of one action; no kind has nearly as many, and every one is recorded."""

SkillFunction = Callable[..., SkillBody]
"""Takes the observation and the inputs, and the models if the skill declares any."""


class SkillRefusedError(Exception):
    """The skill's code is not the certified code, or is not a skill; the message says which."""


class NoActionError(Exception):
    """The skill yielded something other than an action, or returned something other than outputs."""


def start_skill(
    function: SkillFunction, observation: Observation, inputs: Inputs, models: Models
) -> SkillBody:
    """Call a skill's function; its body runs no further than its generator is asked.

    Args:
        function: the generator function.
        observation: values that the skill senses now, SI, by name.
        inputs: checked inputs, SI, by name.
        models: the models that the skill declares, by name; it takes them as a third argument if there are
            any.

    Returns:
        The generator.
    """
    return function(observation, inputs, models) if models else function(observation, inputs)


def continue_skill(body: SkillBody, observation: Observation, denial: str) -> Action:
    """Continue a skill after its last action: with what was measured, or with the denial of the action.

    Args:
        body: the generator, which waits for the end of an action.
        observation: values that the skill senses now, SI, by name.
        denial: why the action was denied for good; empty if it was not.

    Returns:
        The object that it yields next, which should be an action.

    Raises:
        StopIteration: it has ended.
        ActionDenied: it did not catch the denial.
    """
    return body.throw(ActionDenied(denial, observation)) if denial else body.send(observation)


def copy_action(yielded: object) -> Action:
    """Copy a yielded action, so that later changes to its parameters do not change the decided action.

    Args:
        yielded: the object that the skill yielded.

    Returns:
        A copy with lists turned into tuples.

    Raises:
        NoActionError: it is not an `Action` with a dict of at most `MAX_PARAMETERS` named parameters.
    """
    if type(yielded) is not Action:
        raise NoActionError(f"the skill yielded a `{type_name(yielded)}`, not an action")
    if type(yielded.parameters) is not dict or len(yielded.parameters) > MAX_PARAMETERS:
        raise NoActionError(f"the skill yielded parameters that are not a dict of at most {MAX_PARAMETERS}")
    try:
        # Lists are copied to tuples. No action kind has deeper nesting, so the gate denies that.
        parameters = {
            name: tuple(value) if type(value) is list else value
            for name, value in dict(yielded.parameters).items()
        }
    except Exception as failure:
        raise NoActionError(
            f"the skill yielded parameters that are not a mapping: {describe_exception(failure)}"
        ) from failure
    if type(yielded.kind) is not str or not all(type(name) is str for name in parameters):
        raise NoActionError("the skill yielded a kind or a parameter name that is not a string")
    return Action(yielded.kind, parameters)


def check_outputs(value: object) -> dict[str, object] | None:
    """Copy the value that a skill returned.

    Args:
        value: the object that the skill returned.

    Returns:
        A copy with lists turned into tuples; None if the skill returned None.

    Raises:
        NoActionError: it is neither None nor a dict of at most `MAX_PARAMETERS` named outputs.
    """
    if value is None:
        return None
    if type(value) is not dict or len(value) > MAX_PARAMETERS:
        raise NoActionError(
            f"the skill returned a `{type_name(value)}`, not a dict of at most {MAX_PARAMETERS} outputs"
        )
    outputs = {name: tuple(part) if type(part) is list else part for name, part in value.items()}
    if not all(type(name) is str for name in outputs):
        raise NoActionError("the skill returned an output whose name is not a string")
    return outputs
