"""Mutation of the kernel: try mutants, and sum up the results.

    python -m tests.mutation try AREA                    untried mutants of functions
    python -m tests.mutation try AREA --outside          those outside of functions; after the others
    python -m tests.mutation try AREA --near --slice 100 --seed 7   a sample, with the tests near its code
    python -m tests.mutation try AREA --which survivors  again those that no test killed
    python -m tests.mutation try AREA --which survivors --anew   and with all imports after the fault
    python -m tests.mutation try AREA --which survivors --theorems   with theorems instead of tests
    python -m tests.mutation try AREA --which all --slice 200 --seed 2026-11-29
    python -m tests.mutation summary [AREA]              sums; exit code 1 below the floor
    python -m tests.mutation survivors AREA              one line for each
    python -m tests.mutation count AREA                  only count the mutants, so that none is left out

Results are in `tests/mutation/results/`.  A run may be ended at any time, and goes on with the next.
"""

from __future__ import annotations

import argparse
import random
import sys
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.mutation.areas import Area, near_tests, read_areas
from tests.mutation.mutants import CodeMutant, FileMutants
from tests.mutation.near import NearTrials
from tests.mutation.outside import import_ahead, outcome_outside
from tests.mutation.quick_reports import OPTIONS
from tests.mutation.reach import Reach
from tests.mutation.results import KILLED, SAME, AreaResults, argued, summary_table
from tests.mutation.trials import Trials


class _Campaign:
    """Mutants of one area with their results."""

    def __init__(self, area: Area, match: str = "") -> None:
        self.area = area
        self.results = AreaResults(area.name)
        module = match.partition(":")[0]
        names = [name for name, one in zip(area.files(), area.modules(), strict=True) if module in one]
        self.files = {one.module: one for one in (FileMutants(Path(name)) for name in names)}
        self.mutants = [mutant for one in self.files.values() for mutant in one.mutants]
        others = {
            key: total
            for key, total in self.results.totals.items()
            if key[0].partition(":")[0] not in self.files and key[0].partition(":")[0] in area.modules()
        }
        self.results.keep({**others, **Counter(mutant.unit.key for mutant in self.mutants)})
        self._before = {key: dict(outcomes) for key, outcomes in self.results.of.items()}

    def chosen(self, given: argparse.Namespace) -> list[CodeMutant]:
        """Choose mutants as the command line says."""
        found = []
        for mutant in self.mutants:
            outcome = self.results.of.get(mutant.unit.key, {}).get(mutant.number)
            survived = outcome is not None and outcome.verdict not in {KILLED, SAME}
            wanted = {"untried": outcome is None, "survivors": survived, "all": True}[given.which]
            if given.outside != (mutant.unit.line == 0) and not (given.anew or given.theorems):
                continue
            if wanted and given.match.partition(":")[2] in mutant.unit.name:
                found.append(mutant)
        if given.slice:
            random.Random(given.seed).shuffle(found)  # noqa: S311 - not a secret
            found = found[: given.slice]
        return found

    def run(self, given: argparse.Namespace) -> int:
        """Try mutants; return an exit code, which is 1 if one is killed no longer."""
        until = time.time() + 60 * given.minutes
        chosen = self.chosen(given)
        sys.stdout.write(f"== {self.area.name}: {len(chosen)} of {len(self.mutants)} mutants to try\n")
        sys.stdout.flush()
        if chosen and given.theorems:
            self._run_theorems(chosen, until)
        elif chosen and (given.outside or given.anew):
            self._run_outside(chosen, given.seconds, until)
        elif chosen:
            kind, tests = Trials, list(self.area.tests)
            if given.near:
                modules = {mutant.unit.module for mutant in chosen}
                kind, tests = NearTrials, ["-m", "not deep", *near_tests(self.area, modules)]
            trials = kind(self.area, self.results, chosen, given.seconds, until, given.first)
            pytest.main([*OPTIONS, *tests], plugins=[trials])
        self.results.write()
        lost = list(self._no_longer_killed(chosen))
        for mutant in lost:
            sys.stdout.write(f"no longer killed: {mutant.description()}\n")
        return 1 if lost else 0

    def _run_outside(self, mutants: list[CodeMutant], seconds: float, until: float) -> None:
        reach = Reach(self.area.name, self.area.files())
        import_ahead()
        for count, mutant in enumerate(mutants, 1):
            if time.time() > until:
                break
            file = self.files[mutant.unit.module]
            outcome = outcome_outside(str(file.path), file.whole(mutant), reach, seconds)
            self.results.of[mutant.unit.key][mutant.number] = outcome
            if outcome.verdict != KILLED:
                sys.stdout.write(f"{outcome.verdict}: {mutant.description()}\n")
                sys.stdout.flush()
            if count % 20 == 0:
                self.results.write()

    def _run_theorems(self, mutants: list[CodeMutant], until: float) -> None:
        from tests.mutation.by_theorems import TheoremTrials  # imports AEROS

        trials = TheoremTrials()
        for mutant in mutants:
            if time.time() > until:
                break
            if not trials.about(mutant.unit.module):
                continue
            text = self.files[mutant.unit.module].whole(mutant)
            outcome = trials.outcome(mutant.unit.module, text)
            if outcome.verdict == KILLED:
                self.results.of[mutant.unit.key][mutant.number] = outcome
                self.results.write()
            sys.stdout.write(f"{outcome.verdict} {outcome.killer}: {mutant.description()}\n")
            sys.stdout.flush()

    def _no_longer_killed(self, mutants: list[CodeMutant]) -> Iterator[CodeMutant]:
        for mutant in mutants:
            before = self._before.get(mutant.unit.key, {}).get(mutant.number)
            now = self.results.of.get(mutant.unit.key, {}).get(mutant.number)
            if before is not None and now is not None and before.verdict == KILLED != now.verdict:
                yield mutant

    def survivors(self) -> Iterator[str]:
        """Describe the mutants that no test kills and that no argument covers."""
        known = argued()
        for mutant in self.mutants:
            outcome = self.results.of.get(mutant.unit.key, {}).get(mutant.number)
            excused = (mutant.unit.key, mutant.number) in known
            if outcome is not None and outcome.verdict not in {KILLED, SAME} and not excused:
                yield f"{mutant.unit.digest} {outcome.verdict}: {mutant.description()}"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    trying = commands.add_parser("try")
    trying.add_argument("area", choices=read_areas())
    trying.add_argument("--which", choices=("untried", "survivors", "all"), default="untried")
    trying.add_argument("--outside", action="store_true", help="mutants outside of functions")
    trying.add_argument("--near", action="store_true", help="only tests near the code, not measured first")
    trying.add_argument("--anew", action="store_true", help="import AEROS anew for each mutant")
    trying.add_argument(
        "--match", default="", help="module, or part of its name; after a colon, part of a unit"
    )
    trying.add_argument("--theorems", action="store_true", help="prove the theorems about a mutant's code")
    trying.add_argument("--slice", type=int, default=0, help="number of mutants, drawn at random")
    trying.add_argument("--first", nargs="*", default=(), help="parts of names of tests to try before others")
    trying.add_argument("--seed", default="", help="of what is drawn")
    trying.add_argument("--seconds", type=float, default=4.0, help="of passing tests on one mutant")
    trying.add_argument("--minutes", type=float, default=1e6, help="after which no mutant is begun")
    commands.add_parser("summary").add_argument("area", nargs="?", choices=read_areas())
    commands.add_parser("survivors").add_argument("area", choices=read_areas())
    commands.add_parser("count").add_argument("area", choices=read_areas())
    given = parser.parse_args()
    if given.command == "try":
        return _Campaign(read_areas()[given.area], given.match).run(given)
    if given.command == "survivors":
        sys.stdout.writelines(f"{line}\n" for line in _Campaign(read_areas()[given.area]).survivors())
        return 0
    if given.command == "count":
        _Campaign(read_areas()[given.area]).results.write()
        return 0
    areas = [one for one in read_areas().values() if given.area in (None, one.name)]
    table, holds = summary_table(areas)
    sys.stdout.write(table)
    return 0 if holds else 1


if __name__ == "__main__":
    sys.exit(main())
