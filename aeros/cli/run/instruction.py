"""The instruction of `aeros run`: if a part may mean several tasks, the user at a terminal chooses one."""

from __future__ import annotations

import sys

from aeros.agent.instructions.meaning import Understanding
from aeros.agent.instructions.refusals import AmbiguousInstructionError
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.registry.registry_governor import RegistryGovernor
from aeros.session.setup import understand_instruction


def understand_or_ask(
    instruction: str, configuration: Configuration, governor: RegistryGovernor
) -> Understanding:
    """Understand an instruction, and ask on a terminal which task is meant if several may be.

    In a script nothing is asked: standard input and error output must both be a terminal.  Nothing is asked
    either if the instruction has other parts, which the answer would drop.

    Args:
        instruction: The user's words.
        configuration: The active modules.
        governor: Governor of the run; its inactive modules are searched for a hint.

    Returns:
        The tasks that it asks for; after a question, the one meaning that was chosen.

    Raises:
        InstructionError: A part is not understood, or nobody chose one of several tasks.
    """
    try:
        return understand_instruction(instruction, configuration, governor)
    except AmbiguousInstructionError as ambiguous:
        is_asked = sys.stdin.isatty() and sys.stderr.isatty()
        if not is_asked or not ambiguous.is_about_all(instruction):
            raise
        print(f"aeros: {ambiguous}", file=sys.stderr)
        print(f"which? {', '.join(ambiguous.candidates)} ", end="", file=sys.stderr, flush=True)
        chosen = sys.stdin.readline().strip()
        if chosen not in ambiguous.candidates:
            raise
        return understand_instruction(ambiguous.candidates[chosen], configuration, governor)
