"""Trials of mutants outside of functions, such as constants and tables: each in a process that imports anew.

This process imports no module of AEROS, so a fork of it imports all of them, one with the mutant.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Sequence
from functools import partial
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import CodeType
from typing import Final, TextIO

import pytest

from tests.mutation.forks import fork
from tests.mutation.mutants import shape_of
from tests.mutation.quick_reports import OPTIONS, QuickReports
from tests.mutation.reach import Reach
from tests.mutation.results import KILLED, LATE, SAME, SURVIVED, Outcome

_SLOW_TO_IMPORT: Final = ("hypothesis", "networkx", "numpy", "yaml", "z3")
_IMPORTS: Final = 20
"""Seconds of the processor that imports and collection may take."""


class FirstFailure(QuickReports):
    """Plugin of pytest that writes which test failed first."""

    def __init__(self, pipe: TextIO) -> None:
        self._pipe = pipe

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Write the name of a test that failed."""
        if report.failed:
            self._pipe.write(f"failed {report.nodeid}\n")


def import_ahead() -> None:
    """Import libraries that every fork needs."""
    for name in _SLOW_TO_IMPORT:
        importlib.import_module(name)


def outcome_outside(file: str, text: str, reach: Reach, seconds: float) -> Outcome:
    """Try the tests that execute a file on another text of it.

    Args:
        file: path of the file.
        text: what is imported instead.
        reach: which tests execute it.
        seconds: of tests that are tried, tests named after the file first.

    Returns:
        The outcome.
    """
    assert not any(name.startswith("aeros") for name in sys.modules), "a fork would not import anew"
    code = compile(text, str(Path(file).resolve()), "exec", dont_inherit=True)
    if shape_of(code) == shape_of(compile(Path(file).read_text("utf-8"), file, "exec", dont_inherit=True)):
        return Outcome(SAME, "", 0.0)
    mirror = f"test_{Path(file).stem}."
    tests = sorted(reach.tests(file, 0, 100_000), key=lambda test: mirror not in test)
    chosen: list[str] = []
    for test in tests:
        if sum(map(reach.seconds, chosen)) + reach.seconds(test) <= seconds:
            chosen.append(test)
    stages = [[test for test in chosen if mirror in test], [test for test in chosen if mirror not in test]]
    used = 0.0
    for stage in filter(None, stages):
        expected = sum(map(reach.seconds, stage))
        end, written, spent = fork(partial(_try_anew, file, code, stage), _IMPORTS + 3 * expected)
        used += spent
        if end == LATE:
            return Outcome(LATE, "", used)
        first = written.splitlines()[:1] or ["failed import"]
        if end != "done" or first[0] != "passed":
            return Outcome(KILLED, first[0].removeprefix("failed "), used)
    return Outcome(SURVIVED, "", used)


def _try_anew(file: str, code: CodeType, tests: Sequence[str], pipe: TextIO) -> None:
    module = ".".join(Path(file).with_suffix("").parts)
    original = SourceFileLoader.get_code

    def get_code(loader: SourceFileLoader, name: str) -> CodeType | None:
        return code if name == module else original(loader, name)

    SourceFileLoader.get_code = get_code  # type: ignore[method-assign, assignment]
    end = pytest.main([*OPTIONS, "-x", *tests], plugins=[FirstFailure(pipe)])
    pipe.write("passed\n" if end == pytest.ExitCode.OK else "failed import\n")
