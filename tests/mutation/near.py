"""Trials of a sample of mutants with the tests near their code, without measuring which lines tests execute.

Near are the test files that mirror the code's file, then those that `areas.toml` names as `whole`, which are
about all files of the area at once, then those that import its module, then those of the mirrored folder.
To measure all tests of an area takes longer than to try a sample of its mutants with these.
"""

from __future__ import annotations

from functools import partial
from typing import Final, TextIO

from tests.mutation.areas import tests_near
from tests.mutation.forks import fork
from tests.mutation.mutants import CodeMutant
from tests.mutation.results import KILLED, Outcome
from tests.mutation.trials import Trials

_SLOWEST: Final = 10.0
"""Seconds of the processor for the slowest test."""


class NearTrials(Trials):
    """Trials with near tests.  A test that fails without a fault, too, kills nothing."""

    def measure(self) -> None:
        """Measure nothing."""
        self._failing: set[str] = set()

    def order(self, mutant: CodeMutant) -> list[str]:
        """Near tests: those that killed other mutants of the function first, then the nearest."""
        of_file: dict[str, list[str]] = {}
        for test in self.items:
            of_file.setdefault(test.partition("::")[0], []).append(test)
        near = [test for name in tests_near(self.area, mutant.unit.module) for test in of_file.get(name, [])]
        killers = [test for test in self.killers[mutant.unit.key] if test in self.items]
        return [test for test in dict.fromkeys([*killers, *near]) if test not in self._failing]

    def outcome(self, mutant: CodeMutant) -> Outcome:
        """Try near tests until one fails because of the fault."""
        while True:
            outcome = self.outcome_with(mutant, self.order(mutant), _SLOWEST)
            if outcome.verdict != KILLED or self._passes_without_fault(outcome.killer):
                return outcome
            self._failing.add(outcome.killer)

    def _passes_without_fault(self, test: str) -> bool:
        end, text, _ = fork(partial(self._run_alone, test), 2 * _SLOWEST)
        return end == "done" and text == "passed\n"

    def _run_alone(self, test: str, pipe: TextIO) -> None:
        self.prepare()
        pipe.write("failed\n" if self.fails(test) else "passed\n")
