"""Second solver: cvc5 on SMT-LIB text. It shares neither code nor terms with Z3. Sole importer of cvc5.

It decides fewer questions with products of variables than Z3. Where it cannot decide, it answers UNKNOWN,
which never counts as a yes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import cvc5

from aeros.spec.backends.smtlib import add_points, split_points
from aeros.spec.backends.solver_process import SOLVER_PROCESS
from aeros.spec.backends.solver_results import NoAnswerError, SatResult, SolverAnswer

RLIMIT: Final = 1_000_000
"""cvc5 resource units for one question, the same on every machine: one to three seconds of work."""

_SECONDS: Final = 60
"""Limit of processor time of one question, s, for work that cvc5 counts no resources for.

The solver process keeps it: limits of cvc5 itself are by the clock, and give other answers on a busy machine.
"""


class Cvc5:
    """Second solver. Every question gets a new solver, so answers do not depend on their order.

    Attributes:
        name: `cvc5` and its version.
    """

    def __init__(self, rlimit: int = RLIMIT) -> None:
        self.name = f"cvc5 {cvc5.__version__}"
        self._rlimit = rlimit

    def solve_script(self, script: str) -> SolverAnswer:
        """Check if the assertions of a script can hold together.

        Args:
            script: SMT-LIB 2.6 text with one `check-sat`.

        Returns:
            SAT (without a model), UNSAT, or UNKNOWN with the reason.
        """
        try:
            return SOLVER_PROCESS.ask(_solve_script, script, self._rlimit, seconds=_SECONDS)
        except NoAnswerError as why:
            return SolverAnswer(SatResult.UNKNOWN, {}, str(why))


def truths_at(script: str, points: Sequence[Mapping[str, str]]) -> list[list[bool | None]]:
    """Evaluate the assertions of a script at points, without solving.

    Args:
        script: SMT-LIB text.
        points: for each point, the value of each constant of the script, as SMT-LIB text by name.

    Returns:
        For each point the truth of each assertion in order; None where no truth value is left.

    Raises:
        NoAnswerError: cvc5 cannot read the script.
    """
    solver = cvc5.Solver(cvc5.TermManager())
    try:
        for _ in _results(solver, add_points(script, points)):
            pass
    except RuntimeError as error:
        raise NoAnswerError(str(error)) from error
    assertions, values = split_points(solver.getAssertions(), points)
    truths: list[list[bool | None]] = []
    for point in values:
        constants, numbers = [one[0] for one in point], [one[1] for one in point]
        simple = [solver.simplify(one.substitute(constants, numbers)) for one in assertions]
        truths.append([one.getBooleanValue() if one.isBooleanValue() else None for one in simple])
    return truths


def _solve_script(script: str, rlimit: int) -> SolverAnswer:
    solver = cvc5.Solver(cvc5.TermManager())
    solver.setOption("rlimit-per", str(rlimit))
    output = ""
    try:
        for result in _results(solver, script):
            output = result or output
    except RuntimeError as error:  # anything that cvc5 cannot read or do
        return SolverAnswer(SatResult.UNKNOWN, {}, str(error))
    if output in (SatResult.SAT.value, SatResult.UNSAT.value):
        return SolverAnswer(SatResult(output), {})
    return SolverAnswer(SatResult.UNKNOWN, {}, output)


def _results(solver: cvc5.Solver, script: str) -> Iterator[str]:
    """Carry out the commands of a script; yield the output of each."""
    parser = cvc5.InputParser(solver)
    parser.setStringInput(cvc5.InputLanguage.SMT_LIB_2_6, script, "question")
    while not (command := parser.nextCommand()).isNull():
        yield str(command.invoke(solver, parser.getSymbolManager())).strip()
