"""Meaning of the instruction of `aeros run`: by the grammar, and on request by a language model, too.

Where the grammar understands the instruction, the model has to agree. Where it does not, an operator at a
terminal confirms the formal goals that the model read; a script is refused. An instruction that the grammar
understands as a prohibition alone is refused without asking the model.
"""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING

from aeros.agent.errors import AgentError
from aeros.agent.instructions.meaning import Understanding
from aeros.agent.instructions.refusals import InstructionError, NothingAskedError
from aeros.agent.instructions.understand import is_task_name
from aeros.cli.run.instruction import understand_or_ask
from aeros.cli.run.planners import llm_endpoint, llm_timeout, require_planner_options
from aeros.cli.terminal.questions import is_attended, is_confirmed
from aeros.cli.terminal.streams import print_line
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.registry.registry_governor import RegistryGovernor
from aeros.session.reading import read_with_model, refuse_unconfirmed
from aeros.session.setup import understand_instruction
from aeros.spec.diagnostics.codes import did_you_mean
from aeros.spec.diagnostics.render import escape_invisible
from aeros.spec.model.ecm import Ecm

if TYPE_CHECKING:
    from aeros.agent.reading.reader import ModelReading


def _require_task(name: str, modules: Mapping[str, Ecm]) -> None:
    """Require that a name is that of a task, also of a module that is not active: another error says so.

    Raises:
        InstructionError: There is no such task.
    """
    if is_task_name(shlex.quote(name), modules):
        return
    known = [task for module in modules.values() for task in module.tasks]
    known += [f"{module.id}.{task}" for module in modules.values() for task in module.tasks]
    near = did_you_mean(name, known)
    listed = f"did you mean `{near}`?" if near else "`aeros tasks` lists the tasks"
    raise InstructionError(f"there is no task `{escape_invisible(name)}`; {listed}")


def find_meaning(
    arguments: argparse.Namespace, configuration: Configuration, governor: RegistryGovernor
) -> Understanding:
    """Find the meaning of the instruction, before anything moves.

    A model reads an instruction once: a resumed run, and a plant in a process of its own, follow the grammar,
    with which the model has agreed. A goal or a task that the user names formally is not read.

    Args:
        arguments: Parsed options of `aeros run`.
        configuration: The active modules.
        governor: Governor of the run; its inactive modules are searched for a hint.

    Returns:
        The meaning.

    Raises:
        InstructionError: It is not understood, the model disagrees, or nobody confirmed it.
        AgentError: A package for language models is missing.
        UsageError: Options contradict each other.
    """
    instruction = arguments.instruction
    require_planner_options(arguments)
    if arguments.task is not None and not is_task_name(shlex.quote(arguments.task[0]), configuration.modules):
        _require_task(arguments.task[0], {**governor.inactive_modules(), **configuration.modules})
    is_formal = arguments.goal is not None or is_task_name(instruction, configuration.modules)
    if arguments.planner != "llm" or arguments.resume or arguments.serve_plant or is_formal:
        return understand_or_ask(instruction, configuration, governor)

    def understood() -> Understanding:
        try:
            return understand_instruction(instruction, configuration, governor)
        except NothingAskedError:
            raise
        except InstructionError as refusal:
            if arguments.supervised:
                why = f"only the grammar's meaning survives a crash, and it has none: {refusal.reason}"
                raise AgentError(why) from refusal
            raise

    meaning, reading = read_with_model(
        understood,
        instruction,
        configuration,
        llm_endpoint(arguments),
        llm_timeout(arguments, configuration.site),
        _confirm,
    )
    if meaning.source.startswith("grammar"):
        for line in reading.lines:
            print_line(f"understood {line}")
    return meaning


def _confirm(reading: ModelReading, refusal: InstructionError) -> str:
    """Ask the operator at a terminal; a script is refused.

    Raises:
        InstructionError: Nobody is there, or the operator does not confirm the reading.
    """
    shown = "; ".join(reading.lines)
    if not is_attended():
        refuse_unconfirmed(reading, refusal)
    print(f"aeros: {refusal.reason}", file=sys.stderr)
    for line in reading.lines:
        print(f"aeros: `{reading.model}` reads {line}", file=sys.stderr)
    if not is_confirmed():
        raise InstructionError(f"the operator did not confirm {shown}, so nothing moves")
    return "the operator at the terminal"
