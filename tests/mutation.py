"""Mutation testing of `aeros/spec`: mutmut's mutants against the tests that reach them.

    python tests/mutation.py [--sample N] [--seed TEXT] [--seconds S] [--retry] [PATTERN...]

mutmut generates the mutants, as pyproject.toml says, and switches between them.  Its own runner collects
the tests anew for each mutant; here they are collected once, and each mutant is tried in a fork of the
process that did: no test has run in it, so nothing that one test keeps for another hides a mutant.
The test that killed the last mutant of a function is tried first on its next, then the fastest.
What came of each mutant is kept in `mutants/results.json`, and which tests reach which functions in
`mutants/reached.json`, so that a run can be taken up again; to start anew, remove `mutants/`.
"""

from __future__ import annotations

import argparse
import fnmatch
import json
import os
import random
import resource
import signal
import sys
import time
from collections import defaultdict
from collections.abc import Callable
from contextlib import redirect_stdout
from functools import partial
from math import ceil
from pathlib import Path

import mutmut.__main__ as tool
import pytest
from mutmut.configuration import config
from mutmut.mutation import trampoline
from mutmut.mutation.data import SourceFileMutationData
from mutmut.utils.file_utils import (
    copy_also_copy_files,
    copy_src_dir,
    setup_source_paths,
    walk_mutatable_files,
)
from mutmut.utils.format_utils import mangled_name_from_mutant_name

RESULTS = Path("results.json")
REACHED = Path("reached.json")
FRAMES = 3  # that one call of a mutated function takes
TOO_LONG = 300  # seconds of the processor for one test on what is not mutated
CASES = {
    **dict.fromkeys(("flows", "parallel", "joint"), "composition"),
    **dict.fromkeys(("skill_code", "skill_reach", "skill_source", "entry_points"), "form/"),
    **dict.fromkeys(("check", "sugar"), "rejected/expressions"),
    "policy": "rejected/site/",
    **dict.fromkeys(("chain", "chances", "exploration", "invocation", "transition_system"), "closed_loop"),
    "store": "test_oracle",
}
"""Tests about a file that they are not named after; they are tried first."""


class MutationRun:
    """A plugin of pytest that runs the collected tests once for each mutant, instead of once."""

    def __init__(self, mutants: list[str], seconds: float, retry: bool) -> None:
        self.results: dict[str, list[str]] = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
        done = {name for name, (status, _) in self.results.items() if status == "killed" or not retry}
        self.mutants = [name for name in mutants if name not in done]
        self.seconds = seconds
        self.killer: dict[str, str] = {}

    def pytest_configure(self) -> None:
        from hypothesis import Phase, settings  # not before pytest has begun, which rewrites it

        settings.register_profile("first", settings(), phases=(Phase.explicit, Phase.generate))
        settings.load_profile("first")  # the first failure kills, and need not be made small

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        if session.testsfailed:
            raise session.Interrupted(f"{session.testsfailed} tests were not collected")
        self.items = {item.nodeid: item for item in session.items}
        self._measure_all()
        for mutant in self.mutants:
            function = mangled_name_from_mutant_name(mutant)
            tests = self._order(function)
            limit = 10 + 5 * sum(self.duration[test] for test in tests)
            code, killed_by = self._forked(partial(self._try, mutant, tests), limit)
            if killed_by:
                self.killer[function] = killed_by
            status = "no tests" if not tests else "killed" if killed_by else code
            self.results[mutant] = [status, killed_by]
            RESULTS.write_text(json.dumps(self.results, indent=0))
            sys.stdout.write(f"{status} {mutant} {killed_by}\n")
        return True

    def _order(self, function: str) -> list[str]:
        """The tests worth trying, best first, for as many seconds as there are."""
        area = next(part for part in reversed(function.split(".")) if not part.startswith("x"))
        areas = (area, CASES.get(area, area))

        def rank(test: str) -> tuple[bool, bool, float]:
            about = any(one in test for one in areas)
            return test != self.killer.get(function), not about, self.duration[test]

        chosen, spent = [], 0.0
        reaching = [test for test in self.reached.get(function, []) if test in self.items]
        for test in sorted(reaching, key=rank):
            if spent + self.duration[test] <= self.seconds:
                spent += self.duration[test]
                chosen.append(test)
        return chosen

    def _measure_all(self) -> None:
        """Measure the functions that each test reaches, and its time: each in a fork, as on a mutant."""
        kept = json.loads(REACHED.read_text()) if REACHED.exists() else {"reached": {}, "duration": {}}
        self.reached: dict[str, list[str]] = defaultdict(list, kept["reached"])
        self.duration: dict[str, float] = kept["duration"]
        missing = [test for test in self.items if test not in self.duration]
        for measured, test in enumerate(missing, 1):
            how, message = self._forked(partial(self._measure, test), TOO_LONG)
            if how != "survived":
                raise pytest.UsageError(f"{test}, on what is not mutated: {how}")
            reached, self.duration[test] = json.loads(message)
            for function in reached:
                self.reached[function].append(test)
            if measured % 100 == 0 or test == missing[-1]:
                REACHED.write_text(json.dumps({"reached": self.reached, "duration": self.duration}))
                sys.stdout.write(f"measured {measured} of {len(missing)} tests\n")

    def _measure(self, test: str) -> str:
        """The functions that `test` reaches, and how many seconds of the processor it takes."""
        reached: set[str] = set()
        trampoline.get_mutant_under_test = lambda: "stats"
        trampoline.record_trampoline_hit = lambda name, caller=None: reached.add(name)
        started = time.process_time()
        for report in self._failures(test):
            raise AssertionError(report.longreprtext)
        return json.dumps([sorted(reached), time.process_time() - started])

    def _try(self, mutant: str, tests: list[str]) -> str:
        """The first test that fails on `mutant`."""
        trampoline.get_mutant_under_test = lambda: mutant
        return next((test for test in tests if self._failures(test)), "")

    def _failures(self, name: str) -> list[pytest.TestReport]:
        item = self.items[name]
        reports: list[pytest.TestReport] = []
        watch = type(
            "Watch", (), {"pytest_runtest_logreport": staticmethod(lambda report: reports.append(report))}
        )
        plugin = watch()
        item.config.pluginmanager.register(plugin)
        item.config.hook.pytest_runtest_protocol(item=item, nextitem=None)
        item.config.pluginmanager.unregister(plugin)
        return [report for report in reports if report.failed]

    def _forked(self, work: Callable[[], str], limit: float) -> tuple[str, str]:
        """Run `work` in a fork; return its end and its output.

        limit: in seconds of its processor, as the others on a busy machine are no fault of a mutant's.
        """
        reading, writing = os.pipe()
        child = os.fork()
        if child == 0:
            resource.setrlimit(resource.RLIMIT_CPU, (ceil(limit), ceil(limit) + 1))
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
            try:
                with os.fdopen(writing, "w") as pipe:
                    pipe.write(work())
            except BaseException as error:  # a fork never returns into the loop of its parent
                os.write(2, f"{error}\n".encode())
                os._exit(1)
            os._exit(0)
        os.close(writing)
        with os.fdopen(reading) as pipe:
            message = pipe.read()
        code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        late = code in (-signal.SIGXCPU, -signal.SIGKILL)
        return "timed out" if late else "survived" if code == 0 else f"crashed ({code})", message


def generated(patterns: list[str], sample: int, seed: str) -> list[str]:
    """The names of `sample` mutants, drawn from all that fit a pattern; the same for the same seed.

    Any first part of them is a fair sample, too.
    """
    Path("mutants").mkdir(exist_ok=True)
    with redirect_stdout(sys.stderr):
        copy_src_dir()
        copy_also_copy_files()
        setup_source_paths()
        tool.create_mutants(1)
    names: list[str] = []
    for path in sorted(walk_mutatable_files()):
        data = SourceFileMutationData(path=path)
        data.load()
        names += [
            name
            for name in data.exit_code_by_key
            if any(fnmatch.fnmatch(name, pattern) for pattern in patterns)
        ]
    random.Random(seed).shuffle(names)  # noqa: S311 - not a secret
    sys.stderr.write(f"{len(names)} mutants fit\n")
    return names[: sample or None]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("patterns", nargs="*", default=["*"])
    parser.add_argument("--sample", type=int, default=0, help="mutants drawn; 0 for all")
    parser.add_argument("--seed", default="", help="of what is drawn")
    parser.add_argument(
        "--seconds", type=float, default=60, help="of passing tests that are tried on a mutant"
    )
    parser.add_argument("--retry", action="store_true", help="try again what was not killed before")
    given = parser.parse_args()
    mutants = generated(given.patterns or ["*"], given.sample, given.seed)
    sys.setrecursionlimit(FRAMES * sys.getrecursionlimit())
    chosen = [*config().pytest_add_cli_args, *config().pytest_add_cli_args_test_selection]
    os.chdir("mutants")
    return int(
        pytest.main(
            ["--rootdir=.", "-q", "-s", *chosen], plugins=[MutationRun(mutants, given.seconds, given.retry)]
        )
    )


if __name__ == "__main__":
    sys.exit(main())
