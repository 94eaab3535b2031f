"""SMT-LIB text → what cvc5 makes of it, which shares neither code nor terms with Z3.  Sole importer of cvc5.

Of products of variables it decides less than Z3 does.  What is beyond it is UNKNOWN, which is never
taken for a yes.
"""

from __future__ import annotations

from typing import Final

import cvc5

from aeros.spec.backends.solver_results import SatResult, SolverAnswer

RLIMIT: Final = 1_000_000
"""cvc5 resource units for one question, the same on every machine: one to three seconds of work."""

_BACKSTOP_MS: Final = 60_000  # for work that cvc5 counts no resources for


class Cvc5:
    """A second solver.  Every question gets a solver of its own, so answers do not depend on their order."""

    def __init__(self, rlimit: int = RLIMIT) -> None:
        self.name = f"cvc5 {cvc5.__version__}"
        self._rlimit = rlimit

    def solve_script(self, script: str) -> SolverAnswer:
        """Whether what `script`, which asks once, asserts can hold together; never a model."""
        terms = cvc5.TermManager()
        solver = cvc5.Solver(terms)
        solver.setOption("rlimit-per", str(self._rlimit))
        solver.setOption("tlimit-per", str(_BACKSTOP_MS))
        parser = cvc5.InputParser(solver)
        parser.setStringInput(cvc5.InputLanguage.SMT_LIB_2_6, script, "question")
        said = ""
        try:
            while not (command := parser.nextCommand()).isNull():
                said = str(command.invoke(solver, parser.getSymbolManager())).strip() or said
        except RuntimeError as error:  # whatever cvc5 cannot read or do
            return SolverAnswer(SatResult.UNKNOWN, {}, str(error))
        if said in (SatResult.SAT.value, SatResult.UNSAT.value):
            return SolverAnswer(SatResult(said), {})
        return SolverAnswer(SatResult.UNKNOWN, {}, said)
