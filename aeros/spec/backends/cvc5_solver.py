"""Second solver: cvc5 on SMT-LIB text. It shares neither code nor terms with Z3. Sole importer of cvc5.

It decides fewer questions with products of variables than Z3. Where it cannot decide, it answers UNKNOWN,
which never counts as a yes.
"""

from __future__ import annotations

from typing import Final

import cvc5

from aeros.spec.backends.solver_process import SOLVER_PROCESS, NoAnswerError
from aeros.spec.backends.solver_results import SatResult, SolverAnswer

RLIMIT: Final = 1_000_000
"""cvc5 resource units for one question, the same on every machine: one to three seconds of work."""

_SECONDS: Final = 60  # time limit of one question, s, for work that cvc5 counts no resources for


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


def _solve_script(script: str, rlimit: int) -> SolverAnswer:
    terms = cvc5.TermManager()
    solver = cvc5.Solver(terms)
    solver.setOption("rlimit-per", str(rlimit))
    solver.setOption("tlimit-per", str(1000 * _SECONDS))
    parser = cvc5.InputParser(solver)
    parser.setStringInput(cvc5.InputLanguage.SMT_LIB_2_6, script, "question")
    output = ""
    try:
        while not (command := parser.nextCommand()).isNull():
            output = str(command.invoke(solver, parser.getSymbolManager())).strip() or output
    except RuntimeError as error:  # anything that cvc5 cannot read or do
        return SolverAnswer(SatResult.UNKNOWN, {}, str(error))
    if output in (SatResult.SAT.value, SatResult.UNSAT.value):
        return SolverAnswer(SatResult(output), {})
    return SolverAnswer(SatResult.UNKNOWN, {}, output)
