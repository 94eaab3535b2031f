"""Trials of mutants: the tests of an area are collected once, and each mutant is tried in a fork.

No test has run in the process that forks, so nothing that one test keeps for another hides a mutant.
"""

from __future__ import annotations

import importlib
import os
import re
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterable, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Final, TextIO

import coverage
import pytest
from hypothesis.internal.conjecture import engine

from tests.mutation.areas import Area
from tests.mutation.forks import fork
from tests.mutation.live import LiveFunctions
from tests.mutation.mutants import CodeMutant
from tests.mutation.quick_reports import QuickReports
from tests.mutation.reach import Reach
from tests.mutation.results import KILLED, LATE, SAME, SURVIVED, AreaResults, Outcome

_TOO_LONG: Final = 20
"""Seconds of the processor after which a test is not used."""

_FEW: Final = 4
"""Tests of whole cases that are tried before those of the unit's own test file."""

_EVERY: Final = 20
"""Seconds between writes of the results."""


class Trials(QuickReports):
    """Plugin of pytest that tries mutants with the collected tests, instead of running them once.

    Args:
        area: the area.
        results: of the area; the outcomes are added.
        mutants: the mutants to try.
        seconds: of passing tests that are tried on one mutant.
        first: parts of the names of tests that are tried before all others.
        until: time on the clock (`time.time`) at which to stop.
    """

    def __init__(
        self,
        area: Area,
        results: AreaResults,
        mutants: Sequence[CodeMutant],
        seconds: float,
        until: float,
        first: Sequence[str] = (),
    ) -> None:
        self.area, self._results, self._mutants = area, results, mutants
        self._seconds, self._until, self._first = seconds, until, first
        self.killers: dict[tuple[str, str], list[str]] = defaultdict(list)
        for key, outcomes in results.of.items():
            for outcome in outcomes.values():
                self._note(key, outcome.killer)

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        """Measure which lines each test executes, then try the mutants."""
        if session.testsfailed:
            raise session.Interrupted(f"{session.testsfailed} tests were not collected")
        self.items = {item.nodeid: item for item in session.items if not item.get_closest_marker("xfail")}
        self.area.warm_up()
        if self.area.proves():
            importlib.import_module("aeros.spec.backends.z3_group")  # Z3, which each fork would import
        self._live = LiveFunctions(self.area.modules())
        self.measure()
        written = time.time()
        for count, mutant in enumerate(self._mutants, 1):
            if time.time() > self._until:
                _say(f"out of time after {count - 1} mutants")
                break
            if not self._live.can_run(mutant.unit):
                continue
            outcome = self.outcome(mutant)
            if outcome.verdict == SURVIVED and mutant.is_same():
                outcome = Outcome(SAME, "", outcome.seconds)
            self._results.of[mutant.unit.key][mutant.number] = outcome
            self._note(mutant.unit.key, outcome.killer)
            if outcome.verdict != KILLED:
                _say(f"{outcome.verdict}: {mutant.description()}")
            if time.time() > written + _EVERY:
                self._results.write()
                written = time.time()
                _say(f"-- {count} of {len(self._mutants)}")
        self._results.write()
        return True

    def _note(self, key: tuple[str, str], killer: str) -> None:
        """Put a test before all others that are tried on a unit."""
        if killer:
            killers = self.killers[key]
            if killer in killers:
                killers.remove(killer)
            killers.insert(0, killer)

    def outcome(self, mutant: CodeMutant) -> Outcome:
        """Try the tests that execute the statement."""
        tests = self.order(mutant)
        return self.outcome_with(mutant, tests, max(map(self._reach.seconds, tests), default=0.0))

    def outcome_with(self, mutant: CodeMutant, tests: Sequence[str], slowest: float) -> Outcome:
        """Try these tests, of which the slowest takes some seconds of the processor."""
        if not tests:
            return Outcome(SURVIVED, "", 0.0)
        end, text, used = fork(partial(self._try, mutant, tests), 1 + 2 * self._seconds + 1.5 * slowest)
        if end == LATE:
            return Outcome(LATE, "", used)
        verdict, _, last = text.rstrip("\n").rpartition("\n")[2].partition(" ")
        if end != "done":  # a test ended the process, or the mutant could not be installed
            tried = [line.partition(" ")[2] for line in text.splitlines() if line.startswith("trying ")]
            return Outcome(KILLED, tried[-1], used) if tried else Outcome(SURVIVED, "", used)
        return Outcome(KILLED, last, used) if verdict == "failed" else Outcome(SURVIVED, "", used)

    def order(self, mutant: CodeMutant) -> list[str]:
        """Tests that execute the statement, best first."""
        file = str(Path(*mutant.unit.module.split(".")).with_suffix(".py"))
        line = mutant.unit.line
        first, last = (line, line + 10_000) if mutant.in_signature else mutant.lines
        reaching = [test for test in self._reach.tests(file, first, last) if test in self.items]
        fit = set(reaching)
        killers = [test for test in self.killers[mutant.unit.key] if test in fit]
        mirror = f"test_{Path(file).stem}"
        about = [test for test in reaching if mirror in test]
        showing = _cases_with(_words(file, *mutant.lines), reaching)
        chosen = [test for test in reaching if any(part in test for part in self._first)]
        return list(dict.fromkeys([*chosen, *killers, *showing[:_FEW], *about, *showing, *reaching]))

    def _try(self, mutant: CodeMutant, tests: Sequence[str], pipe: TextIO) -> None:
        self._live.install(mutant)
        self.prepare(mutant.unit.name)
        started = time.process_time()
        for test in tests:
            if time.process_time() > started + self._seconds:
                break
            pipe.write(f"trying {test}\n")
            pipe.flush()
            if self.fails(test):
                pipe.write(f"failed {test}\n")
                return
        pipe.write("passed \n")

    def prepare(self, unit: str = "") -> None:
        """Give a fork folders of its own: a mutant's proofs are not for others to find.

        Questions are answered in the fork, whose code has the fault, and not by the solver process, which
        imports AEROS anew; but for faults of how that process is asked.  Hypothesis looks for no smaller case
        than the first that fails, which can take it most of a minute.
        """
        engine.MAX_SHRINKS = 0
        if self.area.proves():
            os.environ["AEROS_STORE_OF_TESTS"] = tempfile.mkdtemp(dir=os.environ["AEROS_STORE_OF_TESTS"])
            if not unit.startswith("SolverProcess"):
                from tests.mutation.solver_here import answer_here  # imports AEROS

                answer_here()

    def fails(self, test: str) -> bool:
        """Run a test in this process."""
        item = self.items[test]
        reports: list[pytest.TestReport] = []

        class _Watch:
            def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
                reports.append(report)

        watch = _Watch()
        item.config.pluginmanager.register(watch)
        item.config.hook.pytest_runtest_protocol(item=item, nextitem=None)
        item.config.pluginmanager.unregister(watch)
        return any(report.failed for report in reports)

    def measure(self) -> None:
        """Measure which lines each test executes."""
        files = self.area.files()
        self._reach = Reach(self.area.name, files)
        unknown = self._reach.unknown(self.items)
        _say(f"measuring {len(unknown)} of {len(self.items)} tests")
        unused = 0
        for count, test in enumerate(unknown, 1):
            end, text, _ = fork(partial(self._measure, test, files), _TOO_LONG)
            seconds, *found = text.splitlines() or ["no result"]
            if end != "done" or seconds == "failed":
                _say(f"not used: {test}: {end}, {text[-300:]}")
                del self.items[test]
                unused += 1
                continue
            lines = {
                name: [int(line) for line in numbers.split()]
                for name, _, numbers in (one.partition(" ") for one in found)
            }
            self._reach.add(test, lines, float(seconds))
            if count % 200 == 0:
                self._reach.write()
        self._reach.write()
        if unused > len(self.items):
            # Without tests every mutant would count as survived.
            raise pytest.UsageError(f"{unused} tests fail without a mutant, and {len(self.items)} pass")
        _say("measured")

    def _measure(self, test: str, files: Sequence[str], pipe: TextIO) -> None:
        self.prepare()
        measured = coverage.Coverage(data_file=None, config_file=False, include=list(files))
        measured.set_option("run:disable_warnings", ["no-data-collected"])
        started = time.process_time()
        measured.start()
        failed = self.fails(test)
        measured.stop()
        seconds = time.process_time() - started
        if failed:
            pipe.write("failed\n")
            return
        pipe.write(f"{seconds}\n")
        data = measured.get_data()
        for path in data.measured_files():
            lines = data.lines(path)
            if lines:
                pipe.write(f"{Path(path).relative_to(Path.cwd())} {' '.join(map(str, lines))}\n")


@cache
def _words(file: str, first: int, last: int) -> frozenset[str]:
    """Return the longer parts of the texts on these lines of a file, without what a format puts in."""
    code = "\n".join(Path(file).read_text("utf-8").splitlines()[first - 1 : last])
    texts = re.findall(r"\"((?:[^\"\\\n]|\\.)*)\"", code)
    return frozenset(part.strip() for one in texts for part in re.split(r"\{.*?\}", one) if len(part) > 4)


@cache
def _expected_text(test: str) -> str:
    """Return what a test on a folder compares with."""
    file, _, case = test.removesuffix("]").partition("[")
    expected = Path(file.partition("::")[0]).parent / case / "expected.txt"
    try:
        return expected.read_text("utf-8")
    except OSError:  # no folder is meant, or the case is too long for the name of one
        return ""


def _cases_with(words: frozenset[str], tests: Iterable[str]) -> list[str]:
    """Choose the tests that compare with some of these words, those with most of them first."""
    counts = {test: sum(word in _expected_text(test) for word in words) for test in tests} if words else {}
    return sorted((test for test, count in counts.items() if count), key=lambda test: -counts[test])


def _say(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()
