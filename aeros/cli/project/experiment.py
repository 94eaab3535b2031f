"""`aeros experiment`: run seeded trials of experiments and compare them with exact predictions."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from concurrent.futures import BrokenExecutor
from importlib import import_module
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any, Final

from aeros.cli.arguments import add_command, available_cpus, existing_path, process_count
from aeros.cli.terminal.progress import ProgressLine
from aeros.cli.terminal.rendering import print_labelled, print_table
from aeros.cli.terminal.streams import print_line
from aeros.distribution import install_command
from aeros.exit_codes import Exit, UsageError
from aeros.experiments.architecture import load_class
from aeros.experiments.catalogue import PLANTS, EnteredArchitecture, Experiment, catalogue, select_rows
from aeros.experiments.inputs import InputPaths, load_inputs
from aeros.experiments.report.write import write_report
from aeros.experiments.trial_runner import InputsMismatchError, RunProgress, TlsFiles, executor_at, run_trials
from aeros.experiments.trial_store import TRIALS_FILE, TrialStore
from aeros.session.plant_factory import PlantSetupError
from aeros.session.setup import create_output_folder
from aeros.spec.diagnostics.errors import MisuseError

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_EXAMPLES = """\
Experiments have numbers, and their conditions have paths below, as `aeros experiment list` shows.  The
folder of --out gets trials.jsonl (each finished trial), results.json, report.html, report.md and figures/.
After Ctrl-C or a kill, --resume with the same --out runs the missing trials.  Trials of other modules, of
another site or of another release of AEROS are not reused.  The same seeds give the same results.
Trials only simulate, and use no state folder: no command of an operator, such as `aeros block`, reaches them.

examples:
  aeros experiment list
  aeros experiment 4 --plant symbolic
  aeros experiment 8/aeros/make_dumplings/0.90 --trials 1000 --plant symbolic
  aeros experiment all --out runs/full --resume
  aeros experiment 4 8 --architecture my_package.my_module:MyArchitecture --plant symbolic
  aeros experiment all --executor dask://10.0.0.7:8786 --tls-ca ca.pem --tls-cert me.pem --tls-key me.key
"""

_TLS_OPTIONS: Final = {
    "ca": "certificate of the authority that signs for the cluster and for you (PEM)",
    "cert": "your certificate (PEM)",
    "key": "your private key (PEM)",
}
"""Options for an encrypted connection to a cluster; all of them or none."""

_REPORT_PACKAGES: Final = ("jinja2", "markdown_it", "matplotlib", "scipy.stats")
"""Packages of results and the report writer, imported before the first trial."""


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "experiment", __doc__, _EXAMPLES)
    parser.add_argument(
        "experiments", nargs="+", metavar="list|N|all", help="experiments, or conditions of one"
    )
    parser.add_argument(
        "--trials", type=_count, default=100, metavar="N", help="trials of each condition (default: 100)"
    )
    parser.add_argument(
        "--first-seed", type=_seed, default=0, metavar="SEED", help="the first seed (default: 0)"
    )
    parser.add_argument("--plant", choices=PLANTS, default="physics", help="default: physics")
    where = parser.add_mutually_exclusive_group()
    where.add_argument(
        "--workers",
        type=process_count,
        metavar="N",
        help="number of processes (default: one for each processor)",
    )
    where.add_argument("--executor", metavar="dask://HOST:PORT", help="run on a cluster instead")
    for option, help_text in _TLS_OPTIONS.items():
        parser.add_argument(f"--tls-{option}", type=existing_path, metavar="FILE", help=help_text)
    parser.add_argument(
        "--out", type=Path, help="the folder for trials and report (default: a new one in runs/)"
    )
    parser.add_argument("--resume", action="store_true", help="reuse the finished trials in --out")
    parser.add_argument(
        "--architecture",
        action="append",
        default=[],
        metavar="MODULE:CLASS",
        help="add your own architecture to comparisons (repeatable)",
    )
    parser.add_argument(
        "--ecms", type=existing_path, default=Path("ecms"), help="the modules (default: ecms)"
    )
    parser.add_argument("--site", type=existing_path, help="the site file (default: the reference site)")
    parser.set_defaults(command=_command)


def _count(text: str) -> int:
    if not text.isascii() or not text.isdigit() or not 0 < int(text) <= 1_000_000:
        raise argparse.ArgumentTypeError("expected a whole number from 1 to 1000000")
    return int(text)


def _seed(text: str) -> int:
    if not text.isascii() or not text.isdigit() or not int(text) < 2**62:
        raise argparse.ArgumentTypeError("expected a whole number from 0 on")
    return int(text)


def _command(arguments: argparse.Namespace) -> Exit:
    try:
        experiments = catalogue(
            arguments.plant, [EnteredArchitecture(name) for name in arguments.architecture]
        )
        if arguments.experiments == ["list"]:
            for place, one in enumerate(experiments.values()):
                _list_experiment(one, is_first=not place)
            return Exit.SUCCESS
        return _run(arguments, select_rows(experiments, arguments.experiments))
    except (MisuseError, PlantSetupError) as error:
        raise UsageError(str(error)) from error


def _list_experiment(one: Experiment, *, is_first: bool) -> None:
    print(f"{one.number}  {one.title}" if is_first else f"\n{one.number}  {one.title}")
    print_table([(row.id, ", ".join(row.labels)) for row in one.rows], indent=4)


def _run(arguments: argparse.Namespace, experiments: list[Experiment]) -> Exit:
    where = InputPaths(str(arguments.ecms), None if arguments.site is None else str(arguments.site))
    out = _folder(arguments)
    seeds = range(arguments.first_seed, arguments.first_seed + arguments.trials)
    conditions = [row.condition for one in experiments for row in one.rows]
    results_of = _import_report_writer()
    for name in {row.architecture for one in experiments for row in one.rows if row.architecture}:
        load_class(name)
    shown = _progress_printer()
    chosen = executor_at(arguments.executor, arguments.workers or available_cpus(), _tls_files(arguments))
    with TrialStore(out) as store:
        ProgressLine().show("proving the modules")
        premises = load_inputs(where)
        hint = f"finished trials are in {out}; continue with --out {out} --resume"
        try:
            with chosen as (executor, workers):
                run_trials(conditions, seeds, where, executor, workers, store, shown)
            again = _rerun_options(arguments)
            results = results_of(experiments, store.trials, premises, seeds, arguments.plant, again)
            write_report(results, out)
        except KeyboardInterrupt:
            print(f"\naeros: {hint}", file=sys.stderr)
            return Exit.INTERRUPTED
        except BrokenExecutor as broken:
            print(f"\naeros: a worker process died ({broken}); {hint}", file=sys.stderr)
            return Exit.REJECTED
        except (InputsMismatchError, OSError) as refused:
            print(f"\naeros: {refused}; {hint}", file=sys.stderr)
            return Exit.REJECTED
    off = [row["id"] for one in results["experiments"] for row in one["rows"] if _interval_misses(row)]
    rows = sum(len(one.rows) for one in experiments)
    print(
        f"{rows} conditions, {len(dict.fromkeys(conditions))} of them different, {len(seeds)} trials of each"
    )
    print_line(
        f"{len(off)} with intervals that exclude the exact value" + (f": {', '.join(off)}" if off else "")
    )
    print_labelled("output", f"{out}/: " + ", ".join(sorted(path.name for path in out.iterdir())))
    return Exit.SUCCESS


def _tls_files(arguments: argparse.Namespace) -> TlsFiles | None:
    given = [getattr(arguments, f"tls_{option}") for option in _TLS_OPTIONS]
    if not any(given):
        return None
    if not all(given):
        raise UsageError("--tls-ca, --tls-cert and --tls-key belong together: give all of them")
    return TlsFiles(*given)


def _import_report_writer() -> Callable[..., dict[str, Any]]:
    """Import the report writer before any trial runs.

    Raises:
        UsageError: A package is missing.
    """
    try:
        from aeros.experiments.report.results import compute_results

        for name in _REPORT_PACKAGES:
            import_module(name)
    except ImportError as error:
        needs = f"experiments need {install_command('experiments')} ({error.name} is missing)"
        raise UsageError(needs) from error
    return compute_results


def _interval_misses(row: dict[str, object]) -> bool:
    cells = row["cells"]
    return isinstance(cells, dict) and any("exact" in cell["misses"] for cell in cells.values())


def _rerun_options(arguments: argparse.Namespace) -> str:
    """Return the options that repeat a row."""
    options = [f"--plant {arguments.plant} --trials {arguments.trials}"]
    options += [f"--first-seed {arguments.first_seed}"] if arguments.first_seed else []
    options += [f"--architecture {quote(name)}" for name in arguments.architecture]
    options += [f"--ecms {quote(str(arguments.ecms))}"] if arguments.ecms != Path("ecms") else []
    options += [f"--site {quote(str(arguments.site))}"] if arguments.site is not None else []
    return " ".join(options)


def _folder(arguments: argparse.Namespace) -> Path:
    """Return the output folder.

    Raises:
        UsageError: It holds trials and --resume is not given, or --resume is given without it.
    """
    out: Path | None = arguments.out
    if out is None:
        if arguments.resume:
            raise UsageError("--resume requires --out FOLDER, the folder of the trials")
        return create_output_folder(None, "experiment")
    if not arguments.resume and (out / TRIALS_FILE).exists():
        raise UsageError(f"`{out}` already holds trials: continue with --resume, or give another folder")
    return out


def _progress_printer() -> Callable[[RunProgress], None]:
    """Return a function that shows the progress of trials, and what follows Ctrl-C."""
    is_ending, line = False, None

    def show(progress: RunProgress) -> None:
        nonlocal is_ending, line
        if progress.is_interrupted and not is_ending:
            is_ending = True
            print("\naeros: finishing running trials; press Ctrl-C again to abort", file=sys.stderr)
        line = ProgressLine(progress.total) if line is None else line
        line.show("trials", progress.done)
        if progress.done == progress.total:
            line.end()

    return show
