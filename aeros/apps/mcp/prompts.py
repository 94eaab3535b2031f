"""Prompts of the MCP server: texts that a person can pick in the client, for a language model."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

_MAX_ARGUMENT_CHARS: Final = 1_000


class PromptError(Exception):
    """A prompt that does not exist, or lacks an argument; the message says why."""


@dataclass(frozen=True, slots=True)
class PromptEntry:
    """A prompt.

    Attributes:
        name: Its name.
        description: Text for the person who picks it.
        arguments: Description of each argument by name; all are required.
        text: Returns the text for given arguments.
    """

    name: str
    description: str
    arguments: Mapping[str, str]
    text: Callable[[Mapping[str, str]], str]


def _carry_out(given: Mapping[str, str]) -> str:
    return (
        f"Carry out this task with the robot: {given['task']}\n\n"
        "1. Call list_skills and state.  Use only skills that list_skills names.\n"
        "2. Call propose_plan with the task and the steps.  If it is not accepted, read the problems, "
        "correct the steps, and propose again.  Do not propose the same plan twice.\n"
        "3. Call execute_plan with the id and a `wait`.  If it waits for approval, tell the person the "
        "command in `operator` and call again only after they say that they ran it.\n"
        "4. After a failure, look at state and propose a new plan from there.  If anything is unclear or "
        "seems unsafe, call stop and ask the person."
    )


def _explain_latest(_: Mapping[str, str]) -> str:
    return (
        "Read the resources aeros://plan and aeros://records.  Explain in a few sentences what the robot did "
        "last, which action was denied or stopped and by which invariant, with the measured numbers.  Name "
        "the sequence numbers of the records that you rely on.  Do not guess what is not recorded."
    )


def _explain_module(given: Mapping[str, str]) -> str:
    return (
        f"Read aeros://modules/{given['module']} and aeros://policy.  Explain to an operator what the module "
        "can make the robot do, what it is permitted to use, and which invariants bind its actions."
    )


PROMPTS: Final[Mapping[str, PromptEntry]] = {
    one.name: one
    for one in (
        PromptEntry("carry_out", "carry out a task", {"task": "the task, in words or by name"}, _carry_out),
        PromptEntry("explain_latest", "explain what the robot did last", {}, _explain_latest),
        PromptEntry(
            "explain_module",
            "explain a module to an operator",
            {"module": "id of the module"},
            _explain_module,
        ),
    )
}


def prompt_text(name: str, arguments: Mapping[str, str]) -> str:
    """Return the text of a prompt.

    Args:
        name: Its name.
        arguments: Its arguments.

    Returns:
        The text.

    Raises:
        PromptError: There is no such prompt, or an argument is missing, unknown or too long.
    """
    entry = PROMPTS.get(name)
    if entry is None:
        raise PromptError(f"there is no prompt `{name[:80]}`; there are {', '.join(PROMPTS)}")
    if set(arguments) != set(entry.arguments):
        raise PromptError(f"`{name}` takes exactly these arguments: {', '.join(entry.arguments) or 'none'}")
    if any(len(value) > _MAX_ARGUMENT_CHARS for value in arguments.values()):
        raise PromptError(f"an argument is longer than {_MAX_ARGUMENT_CHARS} characters")
    return entry.text(arguments)
