"""`aeros prove`: check the theorems about AEROS itself, and that mutants of the code refute them."""

from __future__ import annotations

import argparse
import json
import os
import signal
import time
from collections.abc import Iterator, Sequence
from functools import cache, partial
from itertools import chain, groupby
from multiprocessing import current_process
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from aeros.cli.arguments import add_command, available_cpus, process_count, second_solver
from aeros.cli.terminal.progress import ProgressLine
from aeros.cli.terminal.rendering import print_table
from aeros.cli.terminal.streams import print_data
from aeros.exit_codes import Exit, UsageError
from aeros.spec.diagnostics.grammar import counted
from aeros.spec.obligations.verdicts import Verdict
from aeros.spec.theorems.check import SolverPanel, check_mutants, check_theorem
from aeros.spec.theorems.module_copies import ModuleSource
from aeros.spec.theorems.theorem_folder import (
    TheoremResult,
    load_theorem,
    proofs_folder,
    stale_files,
    theorem_folders,
    witness_to_json,
    write_generated,
)
from aeros.worker_interrupts import deferred_interrupts, set_interrupt_handler

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_EXAMPLES = """\
examples:
  aeros prove                                 all theorems in proofs/, with both solvers
  aeros prove gate_soundness                  one theorem
  aeros prove --solver z3                     with one solver
  aeros prove --format json                   for programs
  aeros prove --update                        rewrite the generated files of proofs/
"""


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "prove", __doc__, _EXAMPLES)
    parser.add_argument("names", nargs="*", metavar="NAME", help="a theorem (default: all of them)")
    parser.add_argument("--solver", choices=("z3", "cvc5", "both"), default="both", help="default: both")
    parser.add_argument("--format", choices=("text", "json"), default="text", help="default: text")
    parser.add_argument("--update", action="store_true", help="rewrite the SMT-LIB files and expected.json")
    parser.add_argument(
        "--jobs",
        type=process_count,
        metavar="N",
        help="number of theorems proved in parallel (default: one for each processor)",
    )
    parser.add_argument(
        "--proofs",
        type=Path,
        default=proofs_folder(),
        metavar="FOLDER",
        help="the folder of theorems (default: that of AEROS itself)",
    )
    parser.set_defaults(command=_command)


def _command(arguments: argparse.Namespace) -> Exit:
    folders = _select_theorems(arguments.proofs, arguments.names)
    update = arguments.update or os.environ.get("AEROS_UPDATE_GOLDEN") == "1"
    if update and arguments.solver != "both":
        raise UsageError("`--update` requires `--solver both`")
    _solvers(arguments.solver)  # a missing solver is reported here, not by each process
    found: list[dict[str, Any]] = []
    exits: list[Exit] = []
    for one in _prove_all(
        list(folders.values()), arguments.solver, update, arguments.jobs or available_cpus()
    ):
        if arguments.format == "text":
            print_table([one.row], least=(max(map(len, folders)), len(Verdict.REFUTED.value)))
            print("".join(f"{line}\n" for line in one.details), end="", flush=True)
        found.append(one.json_data)
        exits.append(one.exit)
    if arguments.format == "json":
        print_data(json.dumps({"theorems": found}, indent=2))
    return next((one for one in (Exit.REJECTED, Exit.UNDECIDED) if one in exits), Exit.SUCCESS)


class _TheoremResult(NamedTuple):
    """Result of one theorem as a row of a table with details below it, and as JSON, with its exit code."""

    row: tuple[str, str, str]
    details: list[str]
    json_data: dict[str, Any]
    exit: Exit


def _prove_all(folders: Sequence[Path], solver: str, update: bool, jobs: int) -> Iterator[_TheoremResult]:
    """Yield the results in order; several groups are proved at once in processes of their own."""
    prove = partial(_prove_group, solver=solver, update=update)
    groups = [list(group) for _, group in groupby(folders, _subject)]
    if jobs == 1 or len(groups) == 1:
        yield from chain.from_iterable(map(prove, groups))
        return
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    # Spawned, not forked: the caller may have threads, and a fork would copy their locks.
    pool = ProcessPoolExecutor(jobs, get_context("spawn"), _end_when_interrupted)
    try:
        with deferred_interrupts():
            running = [pool.submit(prove, group) for group in groups]
        for number, (group, proved) in enumerate(zip(groups, running, strict=True), 1):
            _progress(f"{number} of {len(groups)}, {_subject(group[0])}")
            yield from proved.result()
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def _end_when_interrupted() -> None:
    set_interrupt_handler(signal.SIG_DFL)  # end at once without a traceback; no result is lost


def _subject(folder: Path) -> str:
    """Return the first word of its name: theorems of one subject execute the same code symbolically."""
    return folder.name.partition("_")[0]


def _prove_group(folders: Sequence[Path], solver: str, update: bool) -> list[_TheoremResult]:
    """Prove theorems in turn, in one process, which executes code that they share once."""
    return [_prove(folder, solver, update) for folder in folders]


@cache
def _shipped_source() -> ModuleSource:
    """Return the source that ships, one object for all theorems of a process: results are cached by it."""
    return ModuleSource()


def _prove(folder: Path, solver: str, update: bool) -> _TheoremResult:
    outcome = _outcome(folder, _solvers(solver))
    rewritten = write_generated(outcome, folder) if update else []
    problems = [*_problems(outcome), *([] if update else stale_files(outcome, folder))]
    shown = {
        "name": folder.name,
        "verdict": outcome.verdict.value,
        **outcome.to_expected_json(),
        "problems": problems,
        "rewritten": rewritten,
    }
    row = _row(outcome, folder.name, problems)
    return _TheoremResult(row, _details(outcome, problems, rewritten), shown, _exit(outcome, problems))


def _select_theorems(proofs: Path, names: Sequence[str]) -> dict[str, Path]:
    folders = theorem_folders(proofs)
    if not folders:
        raise UsageError(f"there are no theorems in `{proofs}`")
    unknown = [name for name in names if name not in folders]
    if unknown:
        raise UsageError(f"there is no theorem `{unknown[0]}`; there are {', '.join(folders)}")
    return {name: folders[name] for name in names} if names else folders


def _solvers(which: str) -> SolverPanel:
    try:
        second = None if which == "z3" else second_solver("cvc5")
    except argparse.ArgumentTypeError as error:
        raise UsageError(f"{error}, or `--solver z3`") from error
    return SolverPanel(z3=which != "cvc5", second=second)


@cache
def _progress_line() -> ProgressLine:
    return ProgressLine()


def _progress(what: str) -> None:
    if current_process().name == "MainProcess":  # theorems are proved in other processes, too
        _progress_line().show(f"proving {what}")


def _outcome(folder: Path, solvers: SolverPanel) -> TheoremResult:
    start_time = time.monotonic()
    theorem = load_theorem(folder)

    def progress(what: str) -> None:
        _progress(f"{folder.name}: {what}")

    checked = check_theorem(theorem, _shipped_source(), solvers, progress)
    mutants = check_mutants(theorem, solvers, progress)
    return TheoremResult(
        theorem, solvers.names, tuple(checked), tuple(mutants), time.monotonic() - start_time
    )


def _problems(outcome: TheoremResult) -> list[str]:
    """List the reasons why the theorem does not pass."""
    problems = [
        f"obligation {one.name} is {one.verdict.value}{f' ({one.reason})' if one.reason else ''}"
        for one in outcome.obligations
        if one.verdict is not Verdict.PROVED
    ]
    if not outcome.mutants:
        problems.append("it has no mutant, so nothing shows that it can fail")
    return problems + [
        f"the theorem also holds for the mutant {one.mutant.name}"
        if one.checked.verdict is Verdict.PROVED
        else f"the mutant {one.mutant.name} is {one.checked.verdict.value}: {one.checked.reason}"
        for one in outcome.mutants
        if not one.refuted
    ]


def _exit(outcome: TheoremResult, problems: Sequence[str]) -> Exit:
    if not problems:
        return Exit.SUCCESS
    return Exit.UNDECIDED if outcome.verdict is Verdict.UNKNOWN else Exit.REJECTED


def _row(outcome: TheoremResult, name: str, problems: Sequence[str]) -> tuple[str, str, str]:
    verdict = "failed" if problems else outcome.verdict.value.lower()
    count, refuted = len(outcome.obligations), sum(one.refuted for one in outcome.mutants)
    counts = f"{counted(count, 'obligation')}, {counted(refuted, 'refuted mutant')}"
    return name, verdict, f"{counts}: {outcome.theorem.title}"


def _details(outcome: TheoremResult, problems: Sequence[str], rewritten: Sequence[str]) -> list[str]:
    lines = [f"  {problem}" for problem in problems]
    for one in outcome.obligations:
        if one.witness is not None:
            lines += [f"  {one.name} is refuted by"]
            found = witness_to_json(one.witness)
            lines += [f"    {table}: {'; '.join(way)}" for table, way in found["ways"].items()]
            if not found["ways"]:
                lines += [f"    {name} = {value}" for name, value in found["constants"].items()]
    return [*lines, *(f"  wrote {one}" for one in rewritten)]
