"""Mutation of the kernel: try mutants, and sum up the results.

    python -m tests.mutation try AREA... [--minutes M] [--seconds S] [--retry] [--slice N] [--match TEXT]
    python -m tests.mutation summary
"""

from __future__ import annotations

import argparse
import fnmatch
import random
import sys
import time
from collections import Counter
from pathlib import Path

import pytest

from tests.mutation.areas import Area, read_areas
from tests.mutation.mutants import CodeMutant, FileMutants
from tests.mutation.results import KILLED, SAME, AreaResults, Summary, summarise
from tests.mutation.trials import Trials


def _mutants(area: Area) -> list[CodeMutant]:
    return [mutant for name in area.files() for mutant in FileMutants(Path(name)).mutants]


def _try_area(area: Area, given: argparse.Namespace, until: float) -> int:
    results = AreaResults(area.name)
    mutants = _mutants(area)
    results.keep(Counter(mutant.unit.key for mutant in mutants))
    ended = {KILLED, SAME} if given.retry else {outcome.verdict for one in results.of.values() for outcome in one.values()}
    chosen = []
    for mutant in mutants:
        outcome = results.of.get(mutant.unit.key, {}).get(mutant.number)
        if given.again == (outcome is not None and outcome.verdict in ended) and fnmatch.fnmatch(
            mutant.unit.key[0], f"*{given.match}*"
        ):
            chosen.append(mutant)
    if given.slice:
        random.Random(given.seed).shuffle(chosen)  # noqa: S311 - not a secret
        chosen = chosen[: given.slice]
    sys.stdout.write(f"== {area.name}: {len(chosen)} of {len(mutants)} mutants to try\n")
    if not chosen:
        results.write()
        return 0
    options = ["--rootdir=.", "-q", "-s", "-p", "no:cacheprovider", "-p", "no:cov", "-p", "no:xdist", "-m", "not physics and not deep"]
    return int(pytest.main([*options, *area.tests], plugins=[Trials(area, results, chosen, given.seconds, until)]))


def _summary() -> int:
    rows = {name: summarise(AreaResults(name)) for name in read_areas()}
    names = [field for field in ("mutants", "tried", "killed", "equivalent")]
    rows["all"] = Summary(*(sum(getattr(one, name) for one in rows.values()) for name in names))
    sys.stdout.write("| area | mutants | untried | tried | killed | equivalent | survived |\n|---|---|---|---|---|---|---|\n")
    for name, one in rows.items():
        sys.stdout.write(
            f"| {name} | {one.mutants} | {one.mutants - one.tried} | {one.tried} | {one.killed} = {one.percent(one.killed):.1f} % "
            f"| {one.equivalent} = {one.percent(one.equivalent):.1f} % | {one.survived} = {one.percent(one.survived):.1f} % |\n"
        )
    return 0 if all(one.holds() for one in rows.values()) else 1


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    trying = commands.add_parser("try")
    trying.add_argument("areas", nargs="+", choices=read_areas())
    trying.add_argument("--minutes", type=float, default=1e6)
    trying.add_argument("--seconds", type=float, default=4.0)
    trying.add_argument("--retry", action="store_true")
    trying.add_argument("--again", action="store_true")
    trying.add_argument("--slice", type=int, default=0)
    trying.add_argument("--seed", default="")
    trying.add_argument("--match", default="")
    commands.add_parser("summary")
    given = parser.parse_args()
    if given.command == "summary":
        return _summary()
    until = time.time() + 60 * given.minutes
    return max(_try_area(read_areas()[name], given, until) for name in given.areas)


if __name__ == "__main__":
    sys.exit(main())
