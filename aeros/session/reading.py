"""Reading of an instruction by a language model, which has to agree with the grammar."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from aeros.agent.instructions.meaning import Understanding
from aeros.agent.instructions.refusals import InstructionError, NothingAskedError
from aeros.runtime.gate.configuration import Configuration
from aeros.session.setup import declared_start

if TYPE_CHECKING:
    from aeros.agent.planning.llm_client import LlmEndpoint
    from aeros.agent.reading.reader import ModelReading

Confirm = Callable[["ModelReading", InstructionError], str]
"""Function that asks an operator to confirm a reading that the grammar has none of, and returns who did."""


def read_with_model(
    understand: Callable[[], Understanding],
    instruction: str,
    configuration: Configuration,
    endpoint: LlmEndpoint,
    timeout_s: float,
    confirm: Confirm,
) -> tuple[Understanding, ModelReading]:
    """Find the meaning of an instruction by the grammar and by a language model.

    Args:
        understand: Understands the instruction by the grammar.
        instruction: The user's words.
        configuration: The active modules.
        endpoint: Address of the model.
        timeout_s: Seconds of real time for the model.
        confirm: Called if the grammar does not understand the instruction.

    Returns:
        The meaning, and the model's reading of it.

    Raises:
        InstructionError: The instruction only prohibits, the model disagrees, or nobody confirmed it.
    """
    from aeros.agent.reading.reader import LlmReader

    grammar: Understanding | InstructionError
    try:
        grammar = understand()
    except NothingAskedError:
        raise
    except InstructionError as refusal:
        grammar = refusal
    site, modules = configuration.site, configuration.modules
    reader = LlmReader(
        site, modules, endpoint, timeout_s, lambda task: declared_start(site, task, modules.values())
    )
    reading = reader.read(instruction)
    if isinstance(grammar, Understanding):
        return reader.agree(grammar, reading), reading
    return reader.confirmed(reading, confirm(reading, grammar)), reading


def refuse_unconfirmed(reading: ModelReading, refusal: InstructionError) -> str:
    """Refuse a reading, where no operator can confirm it.

    Args:
        reading: The model's reading.
        refusal: Reason of the grammar.

    Returns:
        Nothing ever.

    Raises:
        InstructionError: Always; the message shows both.
    """
    raise InstructionError(
        f"{refusal.reason}; `{reading.model}` reads it as {'; '.join(reading.lines)}, which an operator has "
        "to confirm at a terminal: run it there, or give the task with --task"
    )
