"""The solver process in this process: its questions are answered by the code that a mutant has changed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from aeros.spec.backends.solver_process import SOLVER_PROCESS, SolverProcess
from aeros.spec.backends.solver_results import NoAnswerError


def answer_here() -> None:
    """Let questions to `SOLVER_PROCESS` be answered in this process from now on."""
    setattr(SolverProcess, "ask", _answer_here)  # noqa: B010 - mypy allows no other way


_ask: Final = SolverProcess.ask


def _answer_here(
    process: SolverProcess, answer: Callable[..., Any], *arguments: object, seconds: float
) -> Any:
    """Answer a question of the solver process in this one; tests of other processes ask these."""
    if process is not SOLVER_PROCESS:
        return _ask(process, answer, *arguments, seconds=seconds)
    try:
        return answer(*arguments)
    except (MemoryError, RecursionError) as error:
        raise NoAnswerError(f"the solver gave up: {type(error).__name__}") from error
