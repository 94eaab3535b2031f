"""The instruction of `aeros run`: what is left open is asked for, if there is a user at a terminal.

If a part may mean several tasks, the user chooses one. If only a part is understood, the user confirms it.
"""

from __future__ import annotations

import sys
from dataclasses import replace

from aeros.agent.instructions.meaning import Understanding
from aeros.agent.instructions.refusals import AmbiguousInstructionError
from aeros.agent.reading.nearest import NearlyUnderstoodError
from aeros.cli.terminal.questions import is_attended, is_confirmed
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.registry.registry_governor import RegistryGovernor
from aeros.session.setup import understand_instruction
from aeros.spec.diagnostics.codes import quoted


def understand_or_ask(
    instruction: str, configuration: Configuration, governor: RegistryGovernor
) -> Understanding:
    """Understand an instruction; ask on a terminal which task is meant, or if a part of it is.

    In a script nothing is asked: standard input and error output must both be a terminal.  Nothing is asked
    either if the instruction has other parts, which the answer would drop.

    Args:
        instruction: The user's words.
        configuration: The active modules.
        governor: Governor of the run; its inactive modules are searched for a hint.

    Returns:
        The tasks that it asks for; after a question, the one meaning that was chosen.

    Raises:
        InstructionError: A part is not understood, or nobody chose one of several tasks or confirmed a part.
    """
    try:
        return understand_instruction(instruction, configuration, governor)
    except AmbiguousInstructionError as ambiguous:
        if not is_attended() or not ambiguous.is_about_all(instruction):
            raise
        print(f"aeros: {ambiguous}", file=sys.stderr)
        print(f"which? {', '.join(ambiguous.candidates)} ", end="", file=sys.stderr, flush=True)
        chosen = sys.stdin.readline().strip()
        if chosen not in ambiguous.candidates:
            raise
        return understand_instruction(ambiguous.candidates[chosen], configuration, governor)
    except NearlyUnderstoodError as near:
        if not is_attended():
            raise
        return _confirmed(near)


def _confirmed(near: NearlyUnderstoodError) -> Understanding:
    """Ask the user at the terminal if the part that is understood is all that was asked for.

    Raises:
        NearlyUnderstoodError: The user did not confirm it.
    """
    meaning, left_out = near.nearest.meaning, quoted(near.nearest.left_out)
    print(f"aeros: {near.refusal}", file=sys.stderr)
    print(f"without {left_out}: {'; '.join(meaning.formal_lines)}", file=sys.stderr)
    if not is_confirmed():
        raise near
    account = (*meaning.account, f"{left_out}: left out, as the operator at the terminal confirmed")
    return replace(meaning, account=account)
